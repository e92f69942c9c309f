// PictureKey: what the colours of a picture mean, for a colour bar and a legend.
#pragma once

#include <string>
#include <vector>

#include "common/classification/transfer_function.h"

namespace slabstream {

struct PictureKey {
  // Colours of the data values of a field.
  struct Bar {
    std::string name;                // UTF-8, one line
    std::vector<ColorPoint> colors;  // at least two, ascending; linear between them; first value < last value
    double low() const { return colors.front().value; }
    double high() const { return colors.back().value; }
    friend bool operator==(const Bar&, const Bar&) = default;
  };
  // A label, or a surface.
  struct Entry {
    std::string name;  // UTF-8, one line
    Rgb color;
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::vector<Bar> bars;  // of the fields that show, in their order
  std::vector<Entry> entries;
  friend bool operator==(const PictureKey&, const PictureKey&) = default;
};

}  // namespace slabstream
