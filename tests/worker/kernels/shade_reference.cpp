#include "tests/worker/kernels/shade_reference.h"

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

float LevelOf(const ShadeTables& tables, const OctetWork& octet, float slope_step, int voxel) {
  const float slope = octet.slope + float(voxel) * slope_step;
  return std::clamp(std::sqrt(octet.across + slope * slope) * tables.level_scale - tables.level_offset, 0.0F, tables.last_level);
}

PhongFactors Shared(const PhongFactors& factors, const OctetShares& shares, std::size_t voxel) {
  return {factors.diffuse * shares.scale[voxel][0] + shares.add[voxel][0],
          factors.specular * shares.scale[voxel][1] + shares.add[voxel][1]};
}

}  // namespace

void ShadeOctetsReference(const ShadeTables& tables, float slope_step, std::span<const OctetWork> octets) {
  for (const OctetWork& octet : octets) {
    const VoxelRecord* record = octet.records;
    for (int i = 0; i < kOctet; ++i) {
      float* out = octet.rgba + 4 * i;
      if ((octet.occupied >> i & 1) == 0) {
        std::fill_n(out, 4, 0.0F);
        continue;
      }
      PhongFactors factors = tables.by_normal[record->normal];
      if (octet.shares != nullptr) factors = Shared(factors, *octet.shares, std::size_t(i));
      const float* color = &tables.color[4 * std::size_t{record->bin}];
      float opacity = color[3];
      if (tables.levels > 1) {
        const float level = LevelOf(tables, octet, slope_step, i);
        const int below = int(level);
        const float* table = &tables.opacity[std::size_t(tables.levels) * record->bin + std::size_t(below)];
        opacity = table[0] + (level - float(below)) * (table[1] - table[0]);
      }
      for (std::size_t c = 0; c < 3; ++c) out[c] = std::min(color[c] * factors.diffuse + factors.specular, 1.0F) * opacity;
      out[3] = opacity;
      ++record;
    }
  }
}

}  // namespace slabstream
