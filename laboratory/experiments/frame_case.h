// FrameCase: one way to render one frame. What its boxes cost is measured by rendering each of them alone (laboratory/measure/box_costs.h); what a
// frame of it takes is measured by the service where this machine has the cores, and simulated from the boxes' costs for any number of
// workers (common/simulation).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "client/cli/bench_cases.h"
#include "laboratory/experiments/experiment.h"
#include "common/image/coverage_map.h"
#include "common/planning/cost_model.h"
#include "common/planning/frame_plan.h"
#include "common/planning/layout.h"
#include "simulator/simulate_frames.h"
#include "common/stats/report.h"

namespace slabstream {

struct FrameCase {
  BenchCase volume;  // with the renderer and the look
  ImageSize size;
  ViewParameters view;
  Policy policy;
  int workers = 1;
};

FrameRequest RequestOf(const FrameCase& frame);
std::string_view NameOf(RendererKind renderer);  // "splatting", "Z-buffer"

// Box costs depend on the partition and the view, not on who owns a box or how images are combined: cases that differ in these alone share
// one trial (and key).
Trial BoxCostTrial(ExperimentContext& context, const FrameCase& frame);
Json BoxCostKey(const FrameCase& frame);

// How long the picture takes to be made of the accumulated frame and encoded, and to be decoded by the client, on one thread:
// "finish_seconds", "receive_seconds".
Trial FinishTrial(ExperimentContext& context, const FrameCase& frame);
Json FinishKey(const FrameCase& frame);

// Frames of the embedded service with frame.workers workers of one thread each, one frame in flight, after two to warm up. Numbers:
// "latency_ms" (the median of `frames`), "stages_ms" by name, "imbalance", "idle_share", "image_bytes".
Trial ServiceTrial(ExperimentContext& context, const FrameCase& frame, int frames);
Json ServiceKey(const FrameCase& frame);

// The same frame by the service and as the simulation says, in turns (laboratory/measure/validate.h), for frame.workers of 1 or 2: "measured_ms"
// and "simulated_ms".
Trial ValidationTrial(ExperimentContext& context, const FrameCase& frame, int turns);
Json ValidationKey(const FrameCase& frame);

// What a picture is of, whoever renders it: the beginning of every key. `what`: of the trial.
Json PictureKey(std::string_view what, const FrameCase& frame);
// The plan that the service would make of its first frame. Errors of Validate and PlanFrame.
Result<FramePlan> PlanOf(ExperimentContext& context, const FrameCase& frame);
// The same with boxes that somebody else has laid out.
Result<FramePlan> PlanOf(ExperimentContext& context, const FrameCase& frame, const Layout& layout);
inline constexpr DatasetId kPlannedDataset = 1;  // of these plans
// What lays them out: as long as `knowledge` lives, and the volume is in use.
struct LayoutKnowledge {
  VolumeInUse volume;
  std::shared_ptr<const OccupancyGrid> occupied;
  TransferFunction transfer;
  Policy policy;  // settled
  RendererKind renderer = RendererKind::kSplat;
};
Result<LayoutKnowledge> KnowLayout(ExperimentContext& context, const FrameCase& frame);
LayoutRequest LayoutRequestOf(const LayoutKnowledge& knowledge, int workers);

// The same frame by a policy that leaves nothing open: as a coordinator of so many workers, a host each, joined by `link`, would choose it
// before it has seen a frame. Errors as of KnowLayout and ChoosePolicy.
Result<FrameCase> WithChosenPolicy(ExperimentContext& context, FrameCase frame, const LinkModel& link);

// Trials without those whose key comes a second time.
std::vector<Trial> WithoutDoubles(std::vector<Trial> trials);

// A planned frame with what its boxes were measured to cost: medians over repeats.
struct MeasuredFrame {
  FramePlan plan;
  struct Cost {
    double seconds = 0, first_seconds = 0;
    std::array<double, kStageCount> stage_seconds{};
    double occupied_voxels = 0, drawn_voxels = 0, covered_pixels = 0, voxel_bytes = 0;
    WorkUnits work{};
    CoverageMap coverage;
  };
  std::vector<Cost> boxes;  // by BoxId; those without a placement cost nothing
  double finish_seconds = 0, receive_seconds = 0;

  FrameInput Input() const;                   // of SimulateFrames, as long as this lives
  std::vector<double> WorkerSeconds() const;  // render time of each worker, also of those without a box
  double RenderSeconds() const;               // of all
  double StageSeconds(Stage stage) const;     // of all
};
// Both trials must have been run.
Result<MeasuredFrame> Recall(ExperimentContext& context, const FrameCase& frame);
// The same of each repeat of the box costs by itself.
Result<std::vector<MeasuredFrame>> RecallRepeats(ExperimentContext& context, const FrameCase& frame);

// Numbers of a BoxCostTrial of a plan of the frame, and a plan with them.
Result<Json> MeasureBoxes(ExperimentContext& context, const FrameCase& frame, const FramePlan& plan);
MeasuredFrame WithBoxCosts(ExperimentContext& context, const FrameCase& frame, FramePlan plan, const std::vector<const Json*>& repeats);

// As if every image filled the whole frame, as the paper's did: no empty pixel is left out.
void FillImages(MeasuredFrame& frame);

// The same frame over and over: what a client sees who asks for `frames` frames, `in_flight` ahead. The first is cold in no sense: voxels
// are cached and normals made. The frame's workers are one of `teams` teams as large (common/planning/team.h).
Result<Timeline> Simulate(const MeasuredFrame& frame, const MachineModel& machine, int frames = 1, int in_flight = 1,
                          bool keep_spans = false, int teams = 1);

// From picture to picture, of as many frames asked for ahead as keep the service busy: a few more than it has under way.
Result<double> SteadySeconds(const MeasuredFrame& frame, const MachineModel& machine, int teams = 1);
inline int FramesAhead(int window) { return window + 2; }

}  // namespace slabstream
