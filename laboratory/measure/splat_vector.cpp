#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "laboratory/measure/splat_vector.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include "laboratory/measure/splat_loops.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void Spread(const PhaseWork& work) {
  const hn::ScalableTag<float> d;
  for (std::int32_t j = 0; j < work.k; ++j) {
    for (std::int32_t i = 0; i < work.k; ++i) {
      const auto weight = hn::Set(d, work.weights[j * work.k + i]);
      for (std::int32_t row = 0; row < work.rows; ++row) {
        const float* from = work.voxels + std::size_t(row) * work.voxel_stride;
        float* to = work.sheet + std::size_t(row + j) * work.sheet_stride + 4 * std::size_t(i);
        for (std::size_t n = 0; n < work.floats; n += hn::Lanes(d)) {
          hn::StoreU(hn::MulAdd(weight, hn::LoadU(d, from + n), hn::LoadU(d, to + n)), d, to + n);
        }
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Spread);

void SpreadInPhases(const PhaseWork& work) { HWY_DYNAMIC_DISPATCH(Spread)(work); }

}  // namespace slabstream
#endif
