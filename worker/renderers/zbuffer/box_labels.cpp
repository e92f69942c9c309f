#include "worker/renderers/zbuffer/box_labels.h"

#include <algorithm>
#include <utility>

#include "common/parallel/parallel.h"
#include "common/volume/affine_map.h"

namespace slabstream {
namespace {

// Numbers of the labels nearest to the voxels of `box`.
VoxelBlock NearestOn(const Box& box, const PaddedVoxels& labels, const AffineMap& map) {
  VoxelBlock numbers = MakeVoxelBlock(box, ScalarType::kUint32);
  VisitLabelType(labels.type, [&]<class T>(const T*) {
    ParallelFor(box.begin.z, box.end.z, [&](std::int32_t z) {
      std::uint32_t* to = numbers.samples<std::uint32_t>() + numbers.Offset({box.begin.x, box.begin.y, z});
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        for (std::int32_t x = box.begin.x; x < box.end.x; ++x, ++to) {
          const Vec3 p = map.To({double(x), double(y), double(z)});
          const Index3 voxel = {std::int32_t(std::floor(p.x + 0.5)), std::int32_t(std::floor(p.y + 0.5)),
                                std::int32_t(std::floor(p.z + 0.5))};
          if (labels.box.Contains(voxel)) *to = std::uint32_t(*reinterpret_cast<const T*>(labels.At(voxel)));
        }
      }
    });
  });
  return numbers;
}

std::vector<float> ColorsOf(const LabelLook& look, const std::vector<LabelStyle>& styles) {
  std::vector<float> colors;
  colors.reserve(4 * styles.size());
  for (const LabelStyle& style : styles) {
    const float share = !style.shown ? 0 : look.mode == LabelMode::kTint ? float(look.tint) : 1;
    colors.insert(colors.end(), {share * style.color.r, share * style.color.g, share * style.color.b, share});
  }
  return colors;
}

}  // namespace

bool BoxLabels::AnyOpaqueBetween(float low, float high) const {
  if (!(low <= high)) return false;
  const auto at = [&](float number) { return uses.begin() + std::ptrdiff_t(std::min(std::size_t(number), uses.size() - 1)); };
  return std::find(at(low), at(high) + 1, LabelUse::kOpaque) != at(high) + 1;
}

Result<const BoxLabels*> LabelsOfBox::Of(const BoxData& data, const FrameSetup& setup, bool& changed) {
  const FieldSetup* const field = slabstream::LabelsOf(setup);
  BoxData* const box = field == nullptr ? nullptr : data.fields().back();
  if (box == nullptr) {
    changed = shown_.has_value();
    shown_.reset();
    return nullptr;
  }
  auto& volume = box->CacheOf<LabelVolume>();
  const Result<const NumberedLabels*> numbered = volume.Of(*box);
  if (!numbered.ok()) return numbered.status();
  const PaddedVoxels& labels = (*numbered)->numbers.voxels;
  const std::weak_ptr<std::byte[]> from = labels.samples;
  changed = !shown_ || from.owner_before(found_from_) || found_from_.owner_before(from);
  if (changed) {
    VoxelBlock numbers = NearestOn(data.bricks().box(), labels, MapTo(setup, *field, 0));
    BrickRanges ranges{VoxelBricks(numbers)};
    shown_.emplace(BoxLabels{std::move(numbers), std::move(ranges), {}, {}});
    found_from_ = from;
  }
  const std::vector<LabelStyle>& styles = volume.StylesOf(*field->labels);
  std::vector<LabelUse> uses;
  uses.reserve(styles.size());
  for (const LabelStyle& style : styles) uses.push_back(UseOf(field->labels->mode, style));
  changed = changed || uses != shown_->uses;
  shown_->uses = std::move(uses);
  shown_->colors = ColorsOf(*field->labels, styles);
  return &*shown_;
}

std::size_t LabelsOfBox::bytes() const {
  return !shown_ ? 0 : shown_->numbers.bytes.capacity() + shown_->ranges.bytes() + shown_->uses.capacity() + 4 * shown_->colors.capacity();
}

}  // namespace slabstream
