#include "worker/renderers/zbuffer/shown_labels.h"

#include <algorithm>

namespace slabstream {
namespace {

template <class T>
std::uint32_t SampleOf(const BrickedVoxels& voxels, const Index3& voxel) {
  const BrickView<T> brick = voxels.View<T>(voxel / kBrick);
  return brick.Row(voxel.y, voxel.z)[voxel.x - brick.begin.x];
}

}  // namespace

std::uint16_t ShownLabels::NumberOf(const Index3& voxel) const {
  const std::uint32_t number =
      numbers->type() == ScalarType::kUint8 ? SampleOf<std::uint8_t>(*numbers, voxel) : SampleOf<std::uint16_t>(*numbers, voxel);
  return std::uint16_t(std::min(number, std::uint32_t(uses.size() - 1)));
}

bool ShownLabels::AnyOpaqueBetween(float low, float high) const {
  if (!(low <= high)) return false;
  const auto at = [&](float number) { return uses.begin() + std::ptrdiff_t(std::min(std::size_t(number), uses.size() - 1)); };
  return std::find(at(low), at(high) + 1, LabelUse::kOpaque) != at(high) + 1;
}

std::vector<float> LabelColors(const LabelLook& look) {
  std::vector<float> colors(4);
  for (const LabelLook::Entry& entry : look.entries) {
    const float share = !entry.shown ? 0 : look.mode == LabelMode::kTint ? float(look.tint) : 1;
    colors.insert(colors.end(), {share * entry.color.r, share * entry.color.g, share * entry.color.b, share});
  }
  return colors;
}

}  // namespace slabstream
