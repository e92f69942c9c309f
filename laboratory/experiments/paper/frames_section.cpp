// The frames of tables 2, 5 and 6 and figures 9, 10 and 11.
#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/policies.h"

namespace slabstream {
namespace {

constexpr std::array<Stage, 5> kStages = {Stage::kTransform, Stage::kShade, Stage::kSplat, Stage::kComposite, Stage::kZBuffer};

struct Asked {
  FrameCase frame;
  Images images = Images::kWhole;
};

std::vector<Asked> Frames(const PaperSetup& setup) {
  std::vector<Asked> frames;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const int p : setup.workers()) {
      for (const int size : setup.sizes()) frames.push_back({setup.Frame(renderer, size, p)});
      if (p == 1) continue;
      FrameCase frame = setup.Frame(renderer, setup.table_size(), p);
      frames.push_back({frame, Images::kWithoutEmpty});
      frame.policy.combine = "centralized";
      frames.push_back({frame});
      frames.push_back({frame, Images::kWithoutEmpty});
      // Our own default, which moves no voxels when the view turns.
      frame = setup.Frame(renderer, setup.table_size(), p);
      frame.policy.axis = AxisChoice::kAuto;
      frames.push_back({frame});
    }
  }
  return frames;
}

// The box of the worker that renders longest; each worker has one.
const MeasuredFrame::Cost& Longest(const MeasuredFrame& frame) {
  return *std::ranges::max_element(frame.boxes, {}, &MeasuredFrame::Cost::seconds);
}

// `machines`: of its renderer, one a repeat.
void Add(const PaperSetup& setup, const Asked& asked, const std::vector<MachineModel>& machines, Results& results) {
  const auto& [frame, images] = asked;
  const std::vector<MeasuredFrame> repeats = RecallRepeats(setup.context(), frame);
  std::map<std::string, std::vector<double>> figures, stages, counts;
  for (std::size_t i = 0; i < std::min(repeats.size(), machines.size()); ++i) {
    const MeasuredFrame::Cost& longest = Longest(repeats[i]);
    double seconds = longest.seconds;
    if (frame.workers > 1) seconds = std::max(seconds, Simulate(setup.AsPaper(repeats[i], images), machines[i]).frames.front().latency());
    figures["frame_time"].push_back(seconds);
    if (frame.workers > 1) figures["combine_time"].push_back(seconds - longest.seconds);
    double sum = 0;
    for (const Stage stage : kStages) sum += longest.stage_seconds[std::size_t(stage)];
    // The time between the stages is shared out among them.
    const double scale = sum > 0 ? longest.seconds / sum : 0;
    for (const Stage stage : kStages) {
      const double stage_seconds = longest.stage_seconds[std::size_t(stage)] * scale;
      if (stage_seconds > 0) stages[std::string(ToString(stage))].push_back(stage_seconds);
    }
    counts["drawn voxels of the worker that renders longest"].push_back(longest.drawn_voxels);
    counts["covered pixels of the worker that renders longest"].push_back(longest.covered_pixels);
  }

  Json of = ColumnsOf(frame, {{"part", "frames"}, {"variant", NameOf(images)}, {"link", "paper"}});
  const Origin origin = frame.workers > 1 ? Origin::kSimulated : Origin::kMeasured;
  for (const auto& [metric, values] : figures) results.Add(of, metric, values, origin);
  if (images != Images::kWhole || frame.policy.combine != EqualSlabs().policy.combine) return;  // the rest is that of any images and scheme
  for (const auto& [stage, values] : stages) {
    of["stage"] = stage;
    results.Add(of, "stage_time", values, Origin::kMeasured);
  }
  of.erase("stage");
  const auto voxels = double(repeats.front().plan.setup.description.geometry.bounds().voxel_count());
  const auto pixels = double(FrameBounds(repeats.front().plan.setup).pixel_count());
  results.Add(of, "grain", voxels / frame.workers / pixels, Origin::kMeasured);
  for (auto& [what, values] : counts) {
    of["variant"] = what;
    results.Add(of, "count", MedianOf(std::move(values)).median, Origin::kMeasured);
  }
}

}  // namespace

std::vector<Trial> FrameTrials(const PaperSetup& setup) {
  std::vector<FrameCase> frames;
  for (const Asked& asked : Frames(setup)) frames.push_back(asked.frame);
  return setup.TrialsOf(frames);
}

void AddFrames(const PaperSetup& setup, Results& results) {
  const std::vector<MachineModel> splatting = setup.Machines(Splatting()), zbuffer = setup.Machines(ZBuffer());
  for (const Asked& asked : Frames(setup)) Add(setup, asked, asked.frame.volume.renderer == Splatting() ? splatting : zbuffer, results);
}

}  // namespace slabstream
