#include "client/pictures/picture_key.h"

#include <algorithm>
#include <cmath>

namespace slabstream {

std::vector<double> TicksOf(double low, double high) {
  constexpr int kMost = 7;
  const double range = high - low;
  if (!std::isnormal(range)) return {low};
  for (int exponent = int(std::floor(std::log10(range))) - 1;; ++exponent) {
    for (const int digit : {1, 2, 5}) {
      // 10^-n is not exact, but the quotient by 10^n is rounded once.
      const double power = std::pow(10, std::abs(exponent));
      const auto tick = [&](double n) { return exponent < 0 ? n * digit / power : n * digit * power; };
      const double first = std::ceil(low / tick(1) - 1e-9), last = std::floor(high / tick(1) + 1e-9);
      if (last - first + 1 > kMost) continue;
      std::vector<double> ticks;
      for (double n = first; n <= last; ++n) ticks.push_back(std::clamp(tick(n), low, high) + 0.0);
      return ticks;
    }
  }
}

}  // namespace slabstream
