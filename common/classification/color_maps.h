// Colour maps that people know by name. Each is a small table of ours, made from a published formula or from colours that are published
// for everybody's use, as `source` says.
//
// As presets of transfer functions they span the values that "auto" shows and have its opacities. In slices, where nothing lies behind,
// they are opaque (ResolveLook).
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "common/classification/transfer_function.h"

namespace slabstream {

struct ColorMap {
  struct Point {
    double at = 0;  // [0, 1]: from the least value to the greatest; points ascend from 0 to 1
    Rgb color;
  };
  std::string_view name;     // what --transfer takes
  std::string_view purpose;  // one line for --help
  std::string_view source;   // and its terms
  std::vector<Point> points;

  Rgb At(double place) const;  // linear between the points; `place` in [0, 1]
};
// The only list.
const std::vector<ColorMap>& NamedColorMaps();

}  // namespace slabstream
