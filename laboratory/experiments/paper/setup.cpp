#include "laboratory/experiments/paper/setup.h"

#include <algorithm>
#include <numbers>

#include "common/renderers/registry.h"
#include "laboratory/bench/bench_machine.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/paper/printed.h"

namespace slabstream {
namespace {

// Oblique, so that no slab hides behind another, and slices are seen neither edge-on nor face-on.
constexpr double kAzimuth = 30, kElevation = 20;

}  // namespace

PaperSetup::PaperSetup(ExperimentContext& context) : context_(context) {
  const std::vector<int> sizes = context.quick() ? std::vector{50, 100, 200} : std::vector{50, 100, 150, 200, 250, 300};
  for (const int size : sizes) {
    const int scaled = context.Scaled(size);
    if (sizes_.empty() || sizes_.back() != scaled) sizes_.push_back(scaled);
  }
  workers_ = context.quick() ? std::vector{1, 2, 5, 10, 20, 30} : std::vector{1, 2, 5, 10, 15, 20, 25, 30};
}

std::vector<int> PaperSetup::MeasuredWorkers() const {
  std::vector<int> workers;
  for (const int p : {1, 2}) {
    if (p <= DescribeMachine().cores) workers.push_back(p);
  }
  return workers;
}

FrameCase PaperSetup::Frame(const RendererKind* renderer, int size, int workers) const {
  FrameCase frame;
  frame.volume = StandardSphere(SphereClass::kHollow, size, renderer);
  frame.size = {size, size};
  frame.view.azimuth_degrees = kAzimuth;
  frame.view.elevation_degrees = kElevation;
  frame.view.zoom = std::numbers::sqrt3;  // at 1 the cube's diagonal fills the picture
  frame.policy.groups = 1;
  frame.workers = workers;
  return frame;
}

MachineModel PaperSetup::Machine(const RendererKind* renderer) const {
  return PaperMachine(context_, Recall(context_, Frame(renderer, table_size(), 1)).RenderSeconds(), double(table_size()) * table_size());
}

std::vector<FrameCase> PaperSetup::Frames() const {
  std::vector<FrameCase> frames;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const int size : sizes_) {
      for (const int p : workers_) frames.push_back(Frame(renderer, size, p));
    }
  }
  return frames;
}

std::vector<Trial> FrameTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  const std::vector<int> measured = setup.MeasuredWorkers();
  for (const FrameCase& frame : setup.Frames()) {
    trials.push_back(BoxCostTrial(setup.context(), frame));
    trials.push_back(FinishTrial(setup.context(), frame));
    if (std::ranges::find(measured, frame.workers) == measured.end()) continue;
    trials.push_back(ValidationTrial(setup.context(), frame, kValidationTurns));
  }
  trials.push_back(HostTrial());
  return trials;
}

}  // namespace slabstream
