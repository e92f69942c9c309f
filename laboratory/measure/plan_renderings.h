// PlanRenderings: elapsed render times of the boxes of a frame's plan on their workers: alone, and with two workers also together. Each
// worker has two threads as in the service, one that orders and one that renders, and both sleep until they are woken. So the times include
// the operating system's treatment of threads that wake at the same time (it may put both on one core for a while, though another one is
// idle).
#pragma once

#include <memory>
#include <vector>

#include "common/planning/frame_plan.h"
#include "common/volume/volume.h"

namespace slabstream {

// Two renderings take `first` and `second` seconds alone; started together, both are done after `both` seconds. Returns the factor by which
// each was slower while both ran, less one (MachineModel::memory_slowdown). All > 0. Below 0 only by noise.
double SlowdownOf(double first, double second, double both);

struct PlanSeconds {
  std::vector<double> boxes;  // by BoxId; alone
  double slowdown = 0;        // how much two workers that render together slow each other down (SlowdownOf); 0 with one
};

class PlanRenderings {
 public:
  // `volume` outlives the object; `workers` >= 1 with ids from 1 on, as in RosterOf.
  PlanRenderings(const Volume& volume, int workers);
  ~PlanRenderings();

  // The first call also makes the data that workers keep between frames.
  PlanSeconds Measure(const FramePlan& plan);

 private:
  class Worker;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace slabstream
