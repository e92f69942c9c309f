// How the author of a label volume wants a label to look, where the volume itself says so.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace slabstream {

struct StatedLabel {
  std::uint64_t value = 0;                         // above 0
  std::optional<std::array<float, 3>> color = {};  // straight red, green, blue, [0, 1]
  std::string name = {};                           // "": none is known
  friend bool operator==(const StatedLabel&, const StatedLabel&) = default;
};

}  // namespace slabstream
