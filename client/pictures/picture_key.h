// PictureKey: what the colours of a picture mean, for a colour bar and a legend.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/classification/transfer_function.h"

namespace slabstream {

struct PictureKey {
  // Colours of data values from `low` to `high`, low < high.
  struct Bar {
    std::vector<ColorPoint> colors;  // at least one, ascending; linear between them
    double low = 0, high = 1;
  };
  // A label, or a surface.
  struct Entry {
    std::string name;  // UTF-8, one line
    Rgb color;
  };
  std::optional<Bar> bar;
  std::vector<Entry> entries;
};

// Values for the ticks of a bar: multiples of 1, 2 or 5 times a power of ten in [low, high], 3 to 7 of them. low < high, both finite.
std::vector<double> TicksOf(double low, double high);

}  // namespace slabstream
