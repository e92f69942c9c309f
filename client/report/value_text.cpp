#include "client/report/value_text.h"

#include <fmt/format.h>

#include <cmath>

#include "common/volume/exact_value.h"

namespace slabstream {

std::string ValueText(double value) {
  constexpr double kEnd = 0x1p64;
  if (std::abs(value) <= kEnd && std::trunc(value) == value) return fmt::format("{}", Int128(value));
  const auto single = float(value);
  return double(single) == value ? fmt::format("{}", single) : fmt::format("{}", value);
}

}  // namespace slabstream
