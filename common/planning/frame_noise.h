// FrameNoise: by how much the render time of a box scatters from frame to frame, on these machines. It tells a change that pays from one
// that only follows chance.
#pragma once

#include <optional>
#include <span>

namespace slabstream {

class FrameNoise {
 public:
  // A frame: of each box, its render time over the mean of its earlier ones, less 1. `frames`: that these means are of, >= 1.
  void Learn(std::span<const double> deviations, double frames);

  // The standard deviation of a box's render time, over its mean. From the median of the absolute deviations of a frame (Hampel, "The
  // influence curve and its role in robust estimation", 1974), so that it does not grow if few boxes have changed. None: nothing is learnt.
  std::optional<double> deviation() const;

 private:
  static constexpr double kLeastWeight = 0.1;  // the least weight of a frame, however many came before it

  double square_ = 0;
  int frames_ = 0;
};

}  // namespace slabstream
