// MeanColor: the mean of weighted colours.
#pragma once

#include "common/classification/rgb.h"

namespace slabstream {

class MeanColor {
 public:
  // weight >= 0
  void Add(const Rgb& color, double weight) {
    total_ += weight;
    r_ += weight * double(color.r);
    g_ += weight * double(color.g);
    b_ += weight * double(color.b);
  }
  bool any() const { return total_ > 0; }
  Rgb Get() const { return {float(r_ / total_), float(g_ / total_), float(b_ / total_)}; }  // if any()

 private:
  double total_ = 0, r_ = 0, g_ = 0, b_ = 0;
};

}  // namespace slabstream
