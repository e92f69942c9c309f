// Finds the samples of a row that lie in any of a few intervals, as bits. It selects the occupied voxels.
#pragma once

#include <cstdint>
#include <span>

namespace slabstream {

template <class T>
struct SampleInterval {
  T low, high;  // both are inside
};

inline constexpr int kSelectRow = 16;  // samples of a row

// Bit i of masks[row] is set if an interval holds samples[row * stride + i]. No interval holds NaN. T: std::uint8_t, std::uint16_t, float.
template <class T>
void SelectSamples(const T* samples, std::ptrdiff_t stride, int rows, std::span<const SampleInterval<T>> intervals, std::uint16_t* masks);

}  // namespace slabstream
