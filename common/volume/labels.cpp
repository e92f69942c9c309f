#include "common/volume/labels.h"

#include <algorithm>
#include <cmath>

namespace slabstream {

LabelColor StandardColor(std::uint64_t value) {
  // Hues that follow each other by the golden section are far apart, however many there are. A double has digits behind the point for
  // numbers up to 2^32; greater ones begin anew.
  constexpr double kGoldenSection = 0.6180339887498949;
  const std::uint64_t number = (value & 0xFFFFFFFF) ^ ((value >> 32) * 0x9E3779B1 % 0xFFFFFFFF);
  const double hue = 6 * std::fmod(double(number) * kGoldenSection, 1.0);
  const double saturation = number / 3 % 2 == 0 ? 0.75 : 0.5, brightness = number % 3 == 0 ? 0.75 : 1;
  LabelColor color{};
  for (std::size_t i = 0; i < color.size(); ++i) {
    // HSV to RGB: each channel falls and rises along the hue (Smith 1978).
    const double k = std::fmod(5 - 2 * double(i) + hue, 6.0);
    color.at(i) = float(brightness * (1 - saturation * std::max(0.0, std::min({k, 4 - k, 1.0}))));
  }
  return color;
}

}  // namespace slabstream
