#include "tests/common/kernels/over_reference.h"

#include <cmath>

namespace slabstream {

bool OverRowReference(const float* front, const float* back, float* out, std::size_t pixel_count) {
  bool finite = true;
  for (std::size_t pixel = 0; pixel < pixel_count; ++pixel, front += 4, back += 4, out += 4) {
    const float transmittance = 1.0F - front[3];
    for (int channel = 0; channel < 4; ++channel) {
      out[channel] = front[channel] + transmittance * back[channel];
      finite &= std::isfinite(out[channel]);
    }
  }
  return finite;
}

}  // namespace slabstream
