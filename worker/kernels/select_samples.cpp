#include "worker/kernels/select_samples.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/select_samples.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class T>
HWY_INLINE void Select(const T* HWY_RESTRICT samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<T>> intervals,
                       std::uint16_t* HWY_RESTRICT masks) {
  const hn::CappedTag<T, kSelectRow> d;
  for (int row = 0; row < rows; ++row, samples += stride) {
    std::uint32_t mask = 0;
    for (std::size_t i = 0; i < std::size_t{kSelectRow}; i += hn::Lanes(d)) {
      const auto v = hn::LoadU(d, samples + i);
      for (const SampleInterval<T>& interval : intervals) {
        // There is no comparison instruction for unsigned integers; NaN equals nothing.
        const auto inside = hn::Eq(hn::Min(hn::Max(v, hn::Set(d, interval.low)), hn::Set(d, interval.high)), v);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, inside, bits);
        mask |= (std::uint32_t{bits[0]} | std::uint32_t{bits[1]} << 8) << i;
      }
    }
    masks[row] = std::uint16_t(mask);
  }
}

void Select8(const std::uint8_t* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<std::uint8_t>> intervals,
             std::uint16_t* masks) {
  Select(samples, stride, rows, intervals, masks);
}
void Select16(const std::uint16_t* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<std::uint16_t>> intervals,
              std::uint16_t* masks) {
  Select(samples, stride, rows, intervals, masks);
}
void SelectFloat(const float* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<float>> intervals,
                 std::uint16_t* masks) {
  Select(samples, stride, rows, intervals, masks);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Select8);
HWY_EXPORT(Select16);
HWY_EXPORT(SelectFloat);

template <>
void SelectSamples(const std::uint8_t* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<std::uint8_t>> intervals,
                   std::uint16_t* masks) {
  HWY_DYNAMIC_DISPATCH(Select8)(samples, stride, rows, intervals, masks);
}
template <>
void SelectSamples(const std::uint16_t* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<std::uint16_t>> intervals,
                   std::uint16_t* masks) {
  HWY_DYNAMIC_DISPATCH(Select16)(samples, stride, rows, intervals, masks);
}
template <>
void SelectSamples(const float* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<float>> intervals,
                   std::uint16_t* masks) {
  HWY_DYNAMIC_DISPATCH(SelectFloat)(samples, stride, rows, intervals, masks);
}

}  // namespace slabstream
#endif
