#include <algorithm>
#include <iterator>
#include <set>

#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/splat_loops.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

constexpr int kWidths[] = {3, 5, 9, 13, 17, 25};  // k, unless the user names others
constexpr int kPaperWidth = 5;
constexpr double kSliceOccupancies[] = {0.05, 0.1, 0.2, 0.5, 1};

struct Loop {
  const char* name;
  void (DenseSlice::*splat)();
};
constexpr Loop kLoops[] = {
    {"plain, no vectors", &DenseSlice::SplatPlainly}, {"phases", &DenseSlice::SplatInPhases}, {"kernels", &DenseSlice::SplatByKernels}};

struct SliceCase {
  const char* part;
  int side, k;
  double occupancy;
  Json Key() const { return {{"what", "footprint"}, {"N", side}, {"k", k}, {"occupancy", occupancy}}; }
};

Trial Measure(const SliceCase& of) {
  const auto run = [of]() -> Json {
    DenseSlice slice(of.side, SigmaOf(of.k), of.occupancy);
    Json numbers;
    for (const Loop& loop : kLoops) numbers[loop.name] = MedianSecondsOf(kRunsOfALoop, [&] { (slice.*loop.splat)(); });
    return numbers;
  };
  return {of.Key(), run, 0.05 + double(of.side) * of.side * of.k * of.k * 2e-8};
}

std::vector<SliceCase> SlicesOf(const PaperSetup& setup) {
  const std::vector<int>& named = setup.context().options().own.footprints;
  std::vector<SliceCase> slices;
  for (const int k : named.empty() ? std::set(std::begin(kWidths), std::end(kWidths)) : std::set(named.begin(), named.end())) {
    slices.push_back({"slice over k", setup.large_size(), k, 1});
  }
  for (const double occupancy : kSliceOccupancies) slices.push_back({"slice over occupancy", setup.large_size(), kPaperWidth, occupancy});
  return slices;
}

std::vector<FrameCase> WorkerFrames(const PaperSetup& setup) {
  std::vector<FrameCase> frames;
  for (const int size : setup.sizes()) {
    for (const int p : setup.workers()) frames.push_back(setup.Frame(Splatting(), size, p));
  }
  return frames;
}

// Of the slab that takes longest. The paper's splatting stage turns voxels into pixels of sheets; ours also finds where these pixels are.
std::vector<double> SlowestSplat(const PaperSetup& setup, const FrameCase& frame) {
  const auto splat = [](const MeasuredFrame::Cost& box) {
    return box.stage_seconds[std::size_t(Stage::kTransform)] + box.stage_seconds[std::size_t(Stage::kSplat)];
  };
  return EachOf(RecallRepeats(setup.context(), frame),
                [&](const MeasuredFrame& repeat) { return std::ranges::max(EachOf(repeat.boxes, splat)); });
}

}  // namespace

std::vector<Trial> FootprintTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  for (const SliceCase& slice : SlicesOf(setup)) trials.push_back(Measure(slice));
  std::ranges::move(setup.TrialsOf(WorkerFrames(setup)), std::back_inserter(trials));
  return trials;
}

void AddFootprint(const PaperSetup& setup, Results& results) {
  for (const FrameCase& frame : WorkerFrames(setup)) {
    Json of = ColumnsOf(frame, {{"part", "splat over workers"}});
    of["stage"] = "transform and splat";
    results.Add(of, "run_time", SlowestSplat(setup, frame), Origin::kMeasured);
  }
  for (const SliceCase& slice : SlicesOf(setup)) {
    for (const Loop& loop : kLoops) {
      const Json of = {{"part", slice.part}, {"n", slice.side}, {"occupancy", slice.occupancy}, {"variant", loop.name}, {"k", slice.k}};
      results.Add(of, "run_time", ValuesOf(setup.context().log(), slice.Key(), loop.name), Origin::kMeasured);
    }
  }
}

}  // namespace slabstream
