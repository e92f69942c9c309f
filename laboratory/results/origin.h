// The source of a number.
#pragma once

#include <cstdint>
#include <string_view>

namespace slabstream {

enum class Origin : std::uint8_t {
  kMeasured = 0,   // on this machine, by running it
  kSimulated = 1,  // in virtual time, from costs measured on this machine
  kPaper = 2,      // printed by Yagel and Machiraju
};

// "measured", "simulated", "paper".
std::string_view ToString(Origin origin);

}  // namespace slabstream
