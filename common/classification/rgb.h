// Rgb: a colour, straight (not premultiplied) and linear.
#pragma once

namespace slabstream {

struct Rgb {
  float r = 0, g = 0, b = 0;  // each in [0, 1]
  friend bool operator==(const Rgb&, const Rgb&) = default;
};

}  // namespace slabstream
