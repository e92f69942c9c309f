// A polyhedral grid divided among workers, each of which renders the cells that touch its box (section 2, and Yagel's slicing).
#include <algorithm>
#include <memory>

#include "common/mesh/mesh_part.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/policies.h"

namespace slabstream {
namespace {

constexpr int kCounts[] = {1, 2, 4, 8, 16};
constexpr int kCellsASide = 32;

std::vector<FrameCase> GridFrames(const PaperSetup& setup) {
  std::vector<FrameCase> frames;
  for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
    for (const int p : kCounts) {
      FrameCase& frame = frames.emplace_back(setup.Frame(FindRenderer("slice"), setup.table_size(), p));
      frame.volume = GridCase({.size = setup.table_size(), .cells = std::min(kCellsASide, setup.table_size() / 2)});
      frame.policy.decomposition = named.policy.decomposition;
      frame.policy.balance_by = named.policy.balance_by;
      frame.policy.axis = AxisChoice::kAuto;
    }
  }
  return frames;
}

// Tetrahedra that all workers hold together: each holds those that touch its padded boxes.
double HeldCells(const MeshCutter& cells, const FramePlan& plan) {
  double held = 0;
  for (const Placement& placement : PlacementsOf(plan)) held += double(cells.Cut(PaddedBox(placement.box, plan.setup)).tetrahedra.size());
  return held;
}

}  // namespace

std::vector<Trial> GridTrials(const PaperSetup& setup) { return setup.TrialsOf(GridFrames(setup)); }

void AddGrids(const PaperSetup& setup, Results& results) {
  for (const FrameCase& frame : GridFrames(setup)) {
    const std::vector<MeasuredFrame> repeats = RecallRepeats(setup.context(), frame);
    Json of = ColumnsOf(frame, {{"part", "grids"}});
    results.Add(of, "render_time", EachOf(repeats, &MeasuredFrame::RenderSeconds), Origin::kMeasured);
    results.Add(of, "longest_render_time", EachOf(repeats, &MeasuredFrame::LongestSeconds), Origin::kMeasured);
    results.Add(of, "imbalance", EachOf(repeats, &MeasuredFrame::ImbalanceOfWorkers), Origin::kMeasured);
    const std::shared_ptr<const Mesh> mesh = setup.context().volumes().Get(frame.volume).volume->cells;
    of["variant"] = "cells";
    results.Add(of, "count", double(mesh->tetrahedra.size()), Origin::kMeasured);
    of["variant"] = "cells that workers hold";
    results.Add(of, "count", HeldCells(MeshCutter(mesh), repeats.front().plan), Origin::kMeasured);
  }
}

}  // namespace slabstream
