// RegionTable: the regions of a transfer function, sampled once, so that a sample is classified by one look-up. Values lie at equal
// distances, and so do square roots of slopes: gradual changes, where most voxels are, have more places than steep ones.
#pragma once

#include <cstddef>

#include "common/classification/classification_table.h"
#include "common/memory/aligned_buffer.h"

namespace slabstream {

struct RegionTable {
  static constexpr int kValues = 1024, kSlopes = 256;

  // Place of a stored sample s: floor(clamp((s - origin) * scale + 0.5, 0, kValues - 1)).
  float origin = 0, scale = 0;
  // Place of a slope m, in stored samples per unit of the world: floor(min(sqrt(m * slope_scale) + 0.5, kSlopes - 1)). No region reaches
  // the last place.
  float slope_scale = 0;
  // [value][slope], four floats each: straight colour, and the opacity of the transfer function's distance, times its gradient opacity.
  AlignedVector<float> entries;

  // The four numbers of a place; both finite, slope at least 0.
  const float* At(float stored, float slope) const;

  // Puts of(opacity) in the place of each opacity above 0.
  template <class Of>
  void ReplaceOpacities(Of&& of) {
    for (std::size_t i = 3; i < entries.size(); i += 4) {
      if (entries[i] > 0) entries[i] = float(of(double(entries[i])));
    }
  }
};

// `transfer` has regions; `table`: of `transfer` and `mapping`, which says the range. Parallel.
RegionTable MakeRegionTable(const TransferFunction& transfer, const ClassificationTable& table, const ValueMapping& mapping);

}  // namespace slabstream
