// Plans and costs made by hand: as many workers as ranks, images that fill a share of a square frame evenly.
#pragma once

#include <string>
#include <vector>

#include "common/combining/schemes.h"
#include "simulator/simulate_frames.h"
#include "tests/support/machine_models.h"
#include "tests/support/renderers.h"

namespace slabstream {

// Owns what FrameInput points at.
class MadeFrame {
 public:
  // `groups` groups of `workers` boxes each, box i of worker i % workers + 1, on a frame of side x side pixels of which every image fills
  // `share`; the display worker is the root. `combining`: as --combine takes it.
  MadeFrame(std::uint32_t workers, std::uint32_t groups, std::int32_t side, double share, double seconds, const std::string& combining,
            const RendererKind* renderer = ZBuffer())
      : coverage_(UniformCoverage({0, 0, side, side}, share * side * side, side, side)) {
    SetRenderer(*renderer, plan_.setup);
    plan_.setup.camera.width = plan_.setup.camera.height = side;
    plan_.setup.sheets.width = plan_.setup.sheets.height = side;
    plan_.slots = workers;
    plan_.display = 1;
    for (std::uint32_t g = 0; g < groups; ++g) {
      GroupPlan group;
      for (std::uint32_t i = 0; i < workers; ++i) group.placements.push_back({g * workers + i, {}, i + 1});
      group.schedule = {combining, workers, {0}};
      plan_.groups.push_back(std::move(group));
    }
    costs_.assign(std::size_t(workers) * groups, {seconds, &coverage_, 0});
  }
  MadeFrame(const MadeFrame&) = delete;

  FrameInput input() const { return {&plan_, costs_, finish_seconds, 0, picture_bytes}; }
  FramePlan& plan() { return plan_; }
  std::vector<RenderCost>& costs() { return costs_; }
  double finish_seconds = 0, picture_bytes = 0;

 private:
  CoverageMap coverage_;
  FramePlan plan_;
  std::vector<RenderCost> costs_;
};

inline Timeline Simulate(const std::vector<FrameInput>& frames, const MachineModel& machine, int in_flight = 1) {
  return SimulateFrames(frames, machine, {.in_flight = in_flight}).value();
}

}  // namespace slabstream
