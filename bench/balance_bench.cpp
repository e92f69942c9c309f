// How even partitions are, and what they cost: every box of each is rendered alone on one thread (laboratory/measure/box_costs.h), in views
// from all sides; the same again in each view after some frames of dynamic balance. A line a partition, medians over views:
//
//   max/mean   render time of the worker that has most, over the mean of all workers (least ... most)
//   work       render time of all boxes, over that of the whole volume as one box
//   at most    the efficiency that no schedule exceeds: one over the product of both
//   predicted  root mean square of (measured - predicted) / predicted over boxes, by AnalyticCost, both relative to their means
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/program.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/balance.h"
#include "common/planning/placement.h"
#include "common/planning/policy_names.h"
#include "laboratory/measure/box_costs.h"
#include "laboratory/measure/measured_layouts.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {
namespace {

struct Options {
  SubjectOptions subject;
  std::vector<std::string> decompositions, splits = {"voxels", "occupied"};
  Policy policy{.groups = 1, .balance = std::string(kDynamicBalance)};
  int workers = 16, repeats = 3, frames = 5, views = 4;
  bool verbose = false;
};

struct Measured {
  FramePlan plan;
  std::vector<std::int64_t> nanoseconds;  // of its boxes
  double imbalance = 1, slowest = 0;      // of workers
  double sum = 0;                         // seconds of all boxes
};

Measured Measure(const Subject& subject, FramePlan plan, int workers, int repeats) {
  Measured measured{.plan = std::move(plan)};
  const std::vector<Placement> placements = PlacementsOf(measured.plan);
  std::vector<double> seconds(static_cast<std::size_t>(workers));
  for (const BoxCost& cost : MeasureBoxCosts(*subject.volume, measured.plan, repeats)) {
    seconds[placements[measured.nanoseconds.size()].worker - 1] += cost.seconds;
    measured.nanoseconds.push_back(std::int64_t(cost.seconds * 1e9));
    measured.sum += cost.seconds;
  }
  measured.imbalance = Imbalance(seconds);
  measured.slowest = *std::ranges::max_element(seconds);
  return measured;
}

double PredictionError(const AnalyticCost& cost, const Measured& measured) {
  // For views along z there is no prediction.
  const Axis along = measured.plan.setup.camera.traversal_axis == Axis::kX ? Axis::kX : Axis::kY;
  const std::vector<Placement> placements = PlacementsOf(measured.plan);
  double predicted = 0, squares = 0;
  for (const Placement& placement : placements) predicted += cost(placement.box, {.along = along});
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const double seconds = cost(placements[i].box, {.along = along});
    if (seconds == 0) continue;  // all its cost is in the halo
    const double ratio = 1e-9 * double(measured.nanoseconds[i]) / measured.sum / (seconds / predicted);
    squares += (ratio - 1) * (ratio - 1);
  }
  return std::sqrt(squares / double(placements.size()));
}

// By view.
struct Outcome {
  std::vector<double> imbalance, slowest, sum, work, bound, error, moved;

  void Add(const Measured& measured, double whole, double prediction_error, double moved_voxels) {
    imbalance.push_back(measured.imbalance);
    slowest.push_back(measured.slowest * 1e3);
    sum.push_back(measured.sum * 1e3);
    work.push_back(measured.sum / whole);
    bound.push_back(100 / measured.imbalance / work.back());
    error.push_back(prediction_error);
    moved.push_back(moved_voxels * 1e-6);
  }
  std::string Text() const {
    const auto median = [](const std::vector<double>& values) { return MedianOf(values).median; };
    const auto [least, most] = std::ranges::minmax(imbalance);
    return fmt::format(
        "max/mean {:5.3f} ({:5.3f} ... {:5.3f}), slowest {:6.2f} ms, all {:7.2f} ms, work {:4.2f}, at most {:5.1f} %, predicted to "
        "{:4.2f}, "
        "{:.1f} Mvoxels moved",
        median(imbalance), least, most, median(slowest), median(sum), median(work), median(bound), median(error), median(moved));
  }
};

// The views of a subject, and the render time of the whole volume in each.
struct View {
  FrameRequest request;
  double whole = 0;
};

std::vector<View> ViewsOf(const Subject& subject, const Options& options) {
  std::vector<View> views;
  for (int i = 0; i < options.views; ++i) {
    View& view = views.emplace_back(View{.request = subject.request});
    *view.request.view.azimuth_degrees += 360.0 * i / options.views;
    view.request.policy = {.groups = 1};
    view.whole = Measure(subject, PlanFrame(view.request, 1, *subject.summary, RosterOf(1)).value(), 1, options.repeats).sum;
  }
  return views;
}

void Compare(const Subject& subject, const std::vector<View>& views, const Policy& policy, const Options& options) {
  const FrameSetup& setup = subject.setup;
  const AnalyticCost cost = setup.renderer->MakeCost({subject.occupied.get(), subject.summary.get(), &setup.transfer});
  Outcome fixed, balanced;
  std::size_t boxes = 0;
  for (View view : views) {
    view.request.policy = policy;
    const ResolvedRequest resolved = ResolveRequest(view.request, 1, subject.summary).value();
    const FrameSetup of_view = MakeFrameSetup(resolved).value();
    const auto measure = [&](std::shared_ptr<const Layout> layout) {
      FramePlan plan = PlanFrame(of_view, resolved.policy, RosterOf(std::uint32_t(options.workers)), std::move(layout)).value();
      return Measure(subject, std::move(plan), options.workers, options.repeats);
    };
    MeasuredLayouts layouts(options.workers);
    std::shared_ptr<const Layout> layout = layouts.Next(resolved, subject.occupied);
    Measured measured = measure(layout);
    fixed.Add(measured, view.whole, PredictionError(cost, measured), 0);
    boxes = measured.nanoseconds.size();
    double moved = 0;
    for (int frame = 0; frame < options.frames; ++frame) {
      layouts.Learn(measured.plan, measured.nanoseconds);
      const std::shared_ptr<const Layout> next = layouts.Next(resolved, subject.occupied);
      moved += double(MovedVoxels(*layout, *next));
      measured = measure(next);
      if (options.verbose) fmt::print(" {:.3f}{}", measured.imbalance, next != layout ? "*" : "");
      layout = next;
    }
    if (options.verbose && options.frames > 0) fmt::print("\n");
    balanced.Add(measured, view.whole, PredictionError(cost, measured), moved);
  }
  fmt::print("{:22} {:8} {:9} {:10} {:4} boxes, {}\n", subject.name, policy.decomposition, BalanceByOf(policy), policy.assignment, boxes,
             fixed.Text());
  if (options.frames > 0) fmt::print("{:46} after {} frames, {}\n", "", options.frames, balanced.Text());
  (void)std::fflush(stdout);
}

Status Run(const Options& options) {
  for (const std::string& text : options.subject.volumes) {
    const Result<Subject> subject = LoadSubject(options.subject, text);
    if (!subject.ok()) return subject.status();
    const std::vector<View> views = ViewsOf(*subject, options);
    for (const std::string& decomposition : options.decompositions) {
      Policy policy = options.policy;
      policy.decomposition = decomposition;
      for (const std::string& split : options.splits) {
        policy.balance_by = split;
        if (decomposition == "octree" && split != "voxels") continue;  // blind to work
        Compare(*subject, views, policy, options);
      }
    }
  }
  return Status::Ok();
}

void AddOptions(const Command& app, Options& options) {
  AddSubjectOptions(app, options.subject);
  const std::vector<std::string_view> decompositions = NameList(Decompositions());
  options.decompositions.assign(decompositions.begin(), decompositions.end());
  AddList(app, "--decomposition", options.decompositions, OneOf(decompositions), "Partitions to compare");
  AddList(app, "--balance-by", options.splits, OneOf({"voxels", "occupied"}), "What boxes have equal shares of");
  AddParsed(app, "--assignment", options.policy.assignment, OneOf(NameList(Assignments())), "Which worker owns which box").TypeName("NAME");
  app.AddFlag(
      "--along-view", [&options] { options.policy.axis = AxisChoice::kView; },
      "Cut along the axis on which the view's slices are traversed");
  AddInteger(app, "--workers", options.workers, 1, 4096, "Workers that share a frame");
  AddInteger(app, "--groups", options.policy.groups, 1, kMaxGroups, "Groups of boxes");
  AddInteger(app, "--frames", options.frames, 0, 1000, "Of dynamic balance");
  AddInteger(app, "--views", options.views, 1, 1000, "Azimuths, all round");
  AddInteger(app, "--repeats", options.repeats, 1, 1000, "Renderings of each box");
  app.AddFlag("--verbose", options.verbose, "Print the imbalance frame by frame; * where boxes changed");
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  return slabstream::BenchMain(argc, argv, "balance_bench",
                               "How even partitions are, and how much more work they are than the whole volume", slabstream::AddOptions,
                               slabstream::Run);
}
