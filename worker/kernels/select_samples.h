// Which samples of a row lie in any of a few intervals, as bits: occupied voxels are found by it.
#pragma once

#include <cstdint>
#include <span>

namespace slabstream {

template <class T>
struct SampleInterval {
  T low, high;  // both are inside
};

inline constexpr int kSelectRow = 16;  // samples of a row

// Bit i of masks[row]: an interval holds samples[row * stride + i]. NaN lies in none. T: std::uint8_t, std::uint16_t, float.
template <class T>
void SelectSamples(const T* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<T>> intervals, std::uint16_t* masks);

}  // namespace slabstream
