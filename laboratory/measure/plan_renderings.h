// PlanRenderings: what the boxes of a frame's plan take on the workers that they are placed on, by the clock on the wall: alone, and with
// two workers also at once. Each worker has two threads as in the service, one that orders and one that renders, and both sleep until they
// are told: so what the operating system does with threads that are woken at the same time (it may put both on one core for a while, though
// another one is idle) is in it.
#pragma once

#include <memory>
#include <vector>

#include "common/planning/frame_plan.h"
#include "common/volume/volume.h"

namespace slabstream {

struct PlanSeconds {
  std::vector<double> boxes;  // by BoxId; alone
  double slowdown = 0;        // of two workers that render at once (neighbours.h); 0 with one
};

class PlanRenderings {
 public:
  // `volume` outlives the object; `workers` >= 1 with ids from 1 on, as RosterOf has them.
  PlanRenderings(const Volume& volume, int workers);
  ~PlanRenderings();

  // The first call also makes what workers keep between frames.
  PlanSeconds Measure(const FramePlan& plan);

 private:
  class Worker;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace slabstream
