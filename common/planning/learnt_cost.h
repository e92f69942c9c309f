// LearntCost: what rendering costs where in a volume, learnt from the render times of boxes in earlier frames.
//
// Every cell of the volume's OccupancyGrid has a cost, which begins as the work that WorkField sees in it. A frame says what each of its
// boxes took; the costs of a box's cells are scaled alike, by how much longer the box took than they predicted (iterative proportional
// fitting: Deming and Stephan 1940). So what one partition taught about the inside of a box stays known when boxes are cut anew.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/decomposition/work_field.h"

namespace slabstream {

struct BoxSeconds {
  Box box;
  double seconds = 0;  // >= 0: rendering; what is done once (fetching, classification) does not belong to it
};

class LearntCost {
 public:
  explicit LearntCost(const OccupancyGrid& grid);

  // One frame's boxes, which do not overlap. `weight` in (0, 1]: how much of what they took beyond the prediction is believed.
  void Learn(std::span<const BoxSeconds> boxes, double weight);

  bool any() const { return any_; }
  WorkField Field() const;  // seconds

 private:
  // A frame scales costs by factors between these: what is hidden today may be seen tomorrow.
  static constexpr double kLeastFactor = 0.1, kMostFactor = 10;

  Index3 size_;
  std::vector<double> cost_;  // by cell: seconds; until anything is learnt, work
  bool any_ = false;
};

}  // namespace slabstream
