// Operators that treat the four channels of a pixel alike. Loops that the compiler vectorises suffice: they wait for memory.
#include <limits>

#include "common/kernels/combine.h"

namespace slabstream {
namespace {

template <class Operator>
bool CombineChannels(const float* a, const float* b, float* out, std::size_t pixel_count, Operator combine) {
  int infinite = 0;
  for (std::size_t i = 0; i < 4 * pixel_count; ++i) {
    const float value = combine(a[i], b[i]);
    infinite |= int(!(value <= std::numeric_limits<float>::max() && value >= -std::numeric_limits<float>::max()));
    out[i] = value;
  }
  return infinite == 0;
}

}  // namespace

bool MaximumRow(const float* a, const float* b, float* out, std::size_t pixel_count) {
  return CombineChannels(a, b, out, pixel_count, [](float x, float y) { return x > y ? x : y; });
}

bool SumRow(const float* a, const float* b, float* out, std::size_t pixel_count) {
  return CombineChannels(a, b, out, pixel_count, [](float x, float y) { return x + y; });
}

}  // namespace slabstream
