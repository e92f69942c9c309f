// FrameCase: one way to render one frame. The costs of its boxes are measured by rendering each of them alone
// (laboratory/measure/box_costs.h). The frame time is measured with the service if this machine has enough cores, and simulated from the
// box costs for any number of workers (simulator/model).
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/image/coverage_map.h"
#include "common/planning/frame_plan.h"
#include "common/planning/layout.h"
#include "common/stats/report.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/measure/box_costs.h"
#include "laboratory/measure/cost_model.h"
#include "laboratory/measure/measured_layouts.h"
#include "simulator/simulate_frames.h"

namespace slabstream {

struct FrameCase {
  BenchCase volume;  // with the renderer and the transfer function
  ImageSize size;
  ViewParameters view;
  Policy policy;
  int workers = 1;
  FrameRequest look = {};  // what the request says beside all that: parameters of the renderer, shading, ...
};

// The renderers of the paper.
const RendererKind* Splatting();
const RendererKind* ZBuffer();

FrameRequest RequestOf(const FrameCase& frame);

// `columns`, and the columns of results that a frame fills (laboratory/results/results.h). Those of the policy say what was asked for.
Json ColumnsOf(const FrameCase& frame, Json columns = Json::object());

// The keys of trials hold all that decides their numbers (frame_keys.h).

// Box costs depend on the partition and the view, not on how images are combined. Boxes of equal volume do not depend on the assignment
// either. Cases that differ only in such fields share one trial.
Trial BoxCostTrial(ExperimentContext& context, const FrameCase& frame);
Json BoxCostKey(ExperimentContext& context, const FrameCase& frame);

// Times on one thread: "finish_seconds" to make the picture from the accumulated frame and encode it, "receive_seconds" for the client to
// decode it. And "picture_bytes", encoded.
Trial FinishTrial(ExperimentContext& context, const FrameCase& frame);
Json FinishKey(ExperimentContext& context, const FrameCase& frame);

// Frames of the embedded service with frame.workers workers of one thread each, one frame in flight, after WarmUpFrames. Numbers: those of
// MeasureLatency.
inline constexpr int kServiceFrames = 5;
Trial ServiceTrial(ExperimentContext& context, const FrameCase& frame, int frames);
Json ServiceKey(ExperimentContext& context, const FrameCase& frame, int frames);

// The same frame measured with the service and simulated, in turns (laboratory/measure/validate.h), for frame.workers of 1 or 2:
// "measured_ms" and "simulated_ms".
Trial ValidationTrial(ExperimentContext& context, const FrameCase& frame, int turns);
Json ValidationKey(ExperimentContext& context, const FrameCase& frame, int turns);

// The frame's request for its volume (ResolveCompared). Errors of Validate and ResolveRequest.
ResolvedRequest Resolve(ExperimentContext& context, const FrameCase& frame);

// The service's plan for its first frame. Errors of Resolve, MakeFrameSetup and PlanFrame.
FramePlan PlanOf(ExperimentContext& context, const FrameCase& frame);
// The plan of the next frame with the next of these layouts.
FramePlan NextPlan(ExperimentContext& context, const FrameCase& frame, MeasuredLayouts& layouts);

// A planned frame with the measured costs of its boxes: medians over repeats.
struct MeasuredFrame {
  FramePlan plan;
  struct Cost {
    double seconds = 0;
    std::array<double, kStageCount> stage_seconds{};
    double drawn_voxels = 0, covered_pixels = 0;
    double voxel_bytes = 0;    // voxels of the box and its halo
    double fetched_bytes = 0;  // the part of these that its worker must fetch before it renders
    WorkUnits work{};
    CoverageMap coverage;
  };
  std::vector<Cost> boxes;  // by BoxId; those without a placement cost nothing
  double finish_seconds = 0, receive_seconds = 0, picture_bytes = 0;

  FrameInput Input() const;  // for SimulateFrames, valid as long as this lives
  // The sum over the boxes of each worker, including workers without a box.
  std::vector<double> OfWorkers(double Cost::*number) const;
  std::vector<double> WorkerSeconds() const { return OfWorkers(&Cost::seconds); }
  double LongestSeconds() const { return std::ranges::max(WorkerSeconds()); }
  double ImbalanceOfWorkers() const { return Imbalance(WorkerSeconds()); }
  double RenderSeconds() const;            // the sum over all boxes
  double StageSeconds(Stage stage) const;  // the sum over all boxes
};
// Both trials must have been run.
MeasuredFrame Recall(ExperimentContext& context, const FrameCase& frame);
// The same for each repeat of the box costs separately.
std::vector<MeasuredFrame> RecallRepeats(ExperimentContext& context, const FrameCase& frame);

// The numbers of a BoxCostTrial for a plan of the frame, and the plan with such numbers.
Json MeasureBoxes(ExperimentContext& context, const FrameCase& frame, const FramePlan& plan);
Json NumbersOf(const std::vector<BoxCost>& costs, const FramePlan& plan);
MeasuredFrame WithBoxCosts(ExperimentContext& context, const FrameCase& frame, FramePlan plan, const std::vector<const Json*>& repeats);

// Pretends that every image fills the whole frame, as the paper's did: no empty pixel is left out.
void FillImages(MeasuredFrame& frame);

// The same frame over and over: a client's view who asks for `frames` frames, `in_flight` ahead. Even the first is warm: voxels are cached
// and normals made. The frame's workers are one of `teams` teams of equal size (common/planning/team.h).
Timeline Simulate(const MeasuredFrame& frame, const MachineModel& machine, int frames = 1, int in_flight = 1, bool keep_spans = false,
                  int teams = 1);

// Time from picture to picture, with enough frames requested ahead to keep the service busy: a few more than it has under way, or as many
// as one client may have open (kMaxOpenRequests).
double SteadySeconds(const MeasuredFrame& frame, const MachineModel& machine, int teams = 1);

}  // namespace slabstream
