#include "worker/kernels/shade.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/shade.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void Shade(const ShadeTables& tables, std::span<const OctetWork> octets) { ShadeOctetsReference(tables, octets); }

#else

template <bool kLevels>
HWY_INLINE void ShadeAll(const ShadeTables& tables, std::span<const OctetWork> octets) {
  const hn::FixedTag<float, 4> d;  // the channels of a voxel
  // The fourth channel is 1 * 1 + 0 under every light.
  alignas(16) static constexpr float kIsColor[4] = {1, 1, 1, 0}, kIsOpacity[4] = {0, 0, 0, 1};
  const auto is_color = hn::Load(d, kIsColor), is_opacity = hn::Load(d, kIsOpacity), one = hn::Set(d, 1.0F);
  const float* HWY_RESTRICT colors = tables.color.data();
  const float* HWY_RESTRICT opacities = tables.opacity.data();
  const PhongFactors* HWY_RESTRICT by_normal = tables.by_normal.data();
  const auto bins = std::size_t(tables.bins);
  for (const OctetWork& octet : octets) {
    const VoxelRecord* record = octet.records;
    for (std::uint32_t rest = octet.occupied; rest != 0; rest &= rest - 1, ++record) {
      const int i = std::countr_zero(rest);
      const PhongFactors factors = by_normal[record->normal];
      float opacity = 0;
      if constexpr (kLevels) {
        const float level = octet.level + float(i) * octet.level_step;
        const auto below = std::size_t(std::int32_t(level));
        const float* table = opacities + below * bins + record->bin;
        opacity = table[0] + (level - float(below)) * (table[bins] - table[0]);
      } else {
        opacity = opacities[record->bin];
      }
      const auto diffuse = hn::MulAdd(hn::Set(d, factors.diffuse), is_color, is_opacity);
      const auto specular = hn::Mul(hn::Set(d, factors.specular), is_color);
      const auto shaded = hn::Min(hn::MulAdd(hn::Load(d, colors + 4 * std::size_t(record->bin)), diffuse, specular), one);
      hn::Store(hn::Mul(shaded, hn::Set(d, opacity)), d, octet.rgba + 4 * i);
    }
  }
}

void Shade(const ShadeTables& tables, std::span<const OctetWork> octets) {
  tables.levels > 1 ? ShadeAll<true>(tables, octets) : ShadeAll<false>(tables, octets);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Shade);

void ShadeOctets(const ShadeTables& tables, std::span<const OctetWork> octets) { HWY_DYNAMIC_DISPATCH(Shade)(tables, octets); }

void ShadeOctetsReference(const ShadeTables& tables, std::span<const OctetWork> octets) {
  for (const OctetWork& octet : octets) {
    const VoxelRecord* record = octet.records;
    for (int i = 0; i < kOctet; ++i) {
      float* out = octet.rgba + 4 * i;
      if ((octet.occupied >> i & 1) == 0) continue;
      const PhongFactors& factors = tables.by_normal[record->normal];
      const float* table = &tables.opacity[record->bin];
      float opacity = table[0];
      if (tables.levels > 1) {
        const float level = octet.level + float(i) * octet.level_step;
        const int below = int(level);
        opacity = table[below * tables.bins] + (level - float(below)) * (table[(below + 1) * tables.bins] - table[below * tables.bins]);
      }
      for (std::size_t c = 0; c < 3; ++c) {
        out[c] = std::min(tables.color[4 * std::size_t(record->bin) + c] * factors.diffuse + factors.specular, 1.0F) * opacity;
      }
      out[3] = opacity;
      ++record;
    }
  }
}

}  // namespace slabstream
#endif
