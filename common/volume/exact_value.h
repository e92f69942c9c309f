// ExactValue: a data value that double alone may not hold.
#pragma once

#include <cstdint>

namespace slabstream {

// A type that GNU C++ and clang have. Sums and differences of integers of 64 bits need it.
__extension__ using Int128 = __int128;

// The data value is value + rest. The rest is what the nearest double leaves of a whole number of 64 bits: in [-1024, 1024], mostly 0.
struct ExactValue {
  double value = 0;
  std::int64_t rest = 0;
  friend bool operator==(const ExactValue&, const ExactValue&) = default;
};

}  // namespace slabstream
