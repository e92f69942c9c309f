// MeasuredCost: the render cost of each part of a volume, learnt from the render times of boxes in earlier frames.
//
// Every macrocell of the volume's OccupancyGrid has a cost, which begins as its work (MacrocellWork). A frame reports the time of each of
// its boxes; all macrocells of a box are then scaled by the ratio of measured to predicted time (iterative proportional fitting: Deming and
// Stephan 1940). So what one partition taught about the inside of a box stays known when boxes are cut anew.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/decomposition/work_field.h"

namespace slabstream {

struct BoxSeconds {
  Box box;
  double seconds = 0;  // >= 0: rendering, without one-time work (fetching, classification)
};

class MeasuredCost {
 public:
  explicit MeasuredCost(const OccupancyGrid& grid);

  // The boxes of one frame, which do not overlap. `weight` in (0, 1]: how much of the deviation from the prediction is believed.
  void Learn(std::span<const BoxSeconds> boxes, double weight);

  bool any() const { return any_; }
  WorkField Field() const;  // seconds

 private:
  // One frame scales costs by factors between these: what one view hides, the next may show.
  static constexpr double kLeastFactor = 0.1, kMostFactor = 10;

  Index3 size_;
  std::vector<double> cost_;  // by macrocell: seconds; until anything is learnt, work
  bool any_ = false;
};

}  // namespace slabstream
