#include "laboratory/experiments/paper/setup.h"

#include <numbers>

#include "laboratory/bench/bench_machine.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/measure/lab_service.h"

namespace slabstream {
namespace {

// Oblique, so that no slab hides behind another, and slices are seen neither edge-on nor face-on.
constexpr double kAzimuth = 30, kElevation = 20;

std::vector<int> SizesOf(const ExperimentOptions& options) {
  std::vector<int> sizes;
  for (const int size : options.quick ? std::vector{50, 100, 200} : std::vector{50, 100, 150, 200, 250, 300}) {
    const int scaled = Scaled(options, size);
    if (sizes.empty() || sizes.back() != scaled) sizes.push_back(scaled);
  }
  return sizes;
}

}  // namespace

std::vector<BenchCase> PaperVolumes(const ExperimentOptions& options) {
  std::vector<BenchCase> volumes;
  for (const int size : SizesOf(options)) volumes.push_back(StandardSphere(SphereClass::kHollow, size, Splatting()));
  return volumes;
}

PaperSetup::PaperSetup(ExperimentContext& context) : context_(context), sizes_(SizesOf(context.options())) {
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
  frame.policy = EqualSlabs().policy;
  frame.policy.axis = AxisChoice::kView;
  frame.workers = workers;
  return frame;
}

std::vector<Trial> PaperSetup::TrialsOf(const std::vector<FrameCase>& frames) const {
  std::vector<Trial> trials;
  for (const FrameCase& frame : frames) {
    trials.push_back(CostTrial(context_, frame));
    trials.push_back(FinishTrial(context_, frame));
  }
  return trials;
}

MeasuredFrame PaperSetup::AsPaper(MeasuredFrame frame, Images images) {
  frame.finish_seconds = frame.receive_seconds = 0;
  if (images == Images::kWhole) FillImages(frame);
  return frame;
}

std::vector<MachineModel> PaperSetup::Machines(const RendererKind* renderer) const {
  std::vector<MachineModel> machines;
  for (const MeasuredFrame& one : RecallRepeats(context_, Frame(renderer, table_size(), 1))) {
    machines.push_back(PaperMachine(renderer == Splatting() ? kPaperSplatting : kPaperZBuffer, one.RenderSeconds(),
                                    double(FrameBounds(one.plan.setup).pixel_count())));
  }
  return machines;
}

Picture PaperSetup::RenderAlone(const BenchCase& volume, const ViewParameters& view, int pixels) const {
  ServiceConnection connection = OrThrow(OpenLabService(1, {context_.volumes().Get(volume).volume}));
  FrameRequest request = BenchRequest(volume, view, {pixels, pixels});
  request.dataset = connection.dataset();
  return OrThrow(connection.client().Render(request));
}

}  // namespace slabstream
