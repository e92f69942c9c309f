// The source of a number. Every plot and table distinguishes the three, by drawing and in words.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace slabstream {

enum class Origin : std::uint8_t {
  kMeasured = 0,   // on this machine, by running it; solid line, filled marker
  kSimulated = 1,  // in virtual time, from costs measured on this machine; dashed line, open marker
  kPaper = 2,      // printed by Yagel and Machiraju; dotted line, cross
};
inline constexpr std::array<Origin, 3> kOrigins = {Origin::kMeasured, Origin::kSimulated, Origin::kPaper};

// "measured", "simulated", "paper".
std::string_view ToString(Origin origin);

}  // namespace slabstream
