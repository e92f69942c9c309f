#include "worker/kernels/shade.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/shade.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using ChannelTag = hn::CappedTag<float, 4>;  // the channels of a voxel, or one after the other where there are no vectors

template <bool kPerVoxelArea>
HWY_INLINE void Shade(const ShadeTables& tables, VoxelBatch& batch) {
  const ChannelTag d;
  constexpr std::size_t kLanes = hn::MaxLanes(ChannelTag());
  // The fourth channel is 1 * 1 + 0 under every light.
  alignas(16) static constexpr float kIsColor[4] = {1, 1, 1, 0}, kIsOpacity[4] = {0, 0, 0, 1};
  const float* HWY_RESTRICT colors = tables.color.data();
  const float* HWY_RESTRICT opacities = tables.opacity.data();
  const PhongFactors* HWY_RESTRICT by_normal = tables.by_normal.data();
  const float* HWY_RESTRICT area = batch.area.data();
  float* HWY_RESTRICT out = batch.rgba.data();
  const VoxelRecord* HWY_RESTRICT records = batch.record.data();
  for (std::size_t n = 0; n < batch.voxel_count; ++n, out += 4) {
    const VoxelRecord record = records[n];
    const PhongFactors factors = by_normal[record.normal];
    const float* color = colors + 4 * std::size_t(record.bin);
    const auto opacity = hn::Set(d, kPerVoxelArea ? opacities[record.bin] * area[n] : opacities[record.bin]);
    for (std::size_t c = 0; c < 4; c += kLanes) {
      const auto is_color = hn::Load(d, kIsColor + c);
      const auto diffuse = hn::MulAdd(hn::Set(d, factors.diffuse), is_color, hn::Load(d, kIsOpacity + c));
      const auto specular = hn::Mul(hn::Set(d, factors.specular), is_color);
      const auto shaded = hn::Min(hn::MulAdd(hn::Load(d, color + c), diffuse, specular), hn::Set(d, 1.0F));
      hn::Store(hn::Mul(shaded, opacity), d, out + c);
    }
  }
}

void ShadeWithoutArea(const ShadeTables& tables, VoxelBatch& batch) { Shade<false>(tables, batch); }
void ShadeWithArea(const ShadeTables& tables, VoxelBatch& batch) { Shade<true>(tables, batch); }

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>

namespace slabstream {
HWY_EXPORT(ShadeWithoutArea);
HWY_EXPORT(ShadeWithArea);

void ShadePieces(const ShadeTables& tables, bool per_voxel_area, VoxelBatch& batch) {
  per_voxel_area ? HWY_DYNAMIC_DISPATCH(ShadeWithArea)(tables, batch) : HWY_DYNAMIC_DISPATCH(ShadeWithoutArea)(tables, batch);
}

void ShadePiecesReference(const ShadeTables& tables, bool per_voxel_area, VoxelBatch& batch) {
  for (std::size_t n = 0; n < batch.voxel_count; ++n) {
    const VoxelRecord& record = batch.record[n];
    const PhongFactors& factors = tables.by_normal[record.normal];
    const float opacity = tables.opacity[record.bin] * (per_voxel_area ? batch.area[n] : 1.0F);
    for (std::size_t c = 0; c < 3; ++c) {
      const float color = tables.color[4 * std::size_t(record.bin) + c];
      batch.rgba[4 * n + c] = std::min(color * factors.diffuse + factors.specular, 1.0F) * opacity;
    }
    batch.rgba[4 * n + 3] = opacity;
  }
}

}  // namespace slabstream
#endif
