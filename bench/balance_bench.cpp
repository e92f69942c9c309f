// How even partitions are: every box of each is rendered alone on one thread (laboratory/measure/box_costs.h), the boxes of a slot are
// added up, and the slot with the most is compared with the mean, in views from all sides. Then the same in each view after some frames of
// dynamic balance. For volumes given on the command line; "sphere1:300" is the paper's class-I sphere with N = 300.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/classification/count_occupied.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/balance.h"
#include "common/planning/measured_cost.h"
#include "common/planning/placement.h"
#include "common/renderers/registry.h"
#include "common/volume/sphere.h"
#include "common/volume_io/volume_reader.h"
#include "laboratory/measure/box_costs.h"
#include "laboratory/measure/statistics.h"
#include "simulator/simulate_frames.h"

namespace slabstream {
namespace {

struct Options {
  std::vector<std::string> volumes, decompositions, splits = {"voxels", "occupied"};
  Policy policy{.groups = 1};
  std::string preset = "auto", renderer = "splat";
  int slots = 16, repeats = 3, size = 512, frames = 5, views = 4;
  double azimuth = 30, elevation = 20;
  bool verbose = false;
};

std::shared_ptr<const Volume> Load(const std::string& name) {
  if (name.rfind("sphere", 0) != 0) return ReadVolume(name).value().volume;
  const bool hollow = name[6] == '1';
  const SphereRequest request{hollow ? SphereClass::kHollow : SphereClass::kFilled, std::stoi(name.substr(8)), hollow ? 0.05 : 0.4};
  return std::make_shared<const Volume>(MakeSphere(request).value());
}

const RendererKind* RendererOf(const Options& options) { return RequireRenderer(options.renderer).value(); }

FrameRequest MakeRequest(const Options& options, int view) {
  FrameRequest request;
  request.dataset = "volume";
  request.renderer = options.renderer;
  request.size = {options.size, options.size};
  request.view = {.azimuth_degrees = options.azimuth + 360.0 * view / options.views, .elevation_degrees = options.elevation};
  request.transfer.choice = options.preset;
  request.policy = options.policy;
  return request;
}

FrameSetup MakeSetup(const Options& options, const VolumeSummary& summary, int view) {
  return MakeFrameSetup(MakeRequest(options, view), 1, summary).value();
}

struct Measured {
  std::vector<BoxSeconds> boxes;
  std::vector<double> by_box;  // of the layout; 0: nobody renders it
  double imbalance = 0;        // of slots
  double slowest = 0;          // slot, seconds
  double sum = 0;              // of all boxes
};

Measured Measure(const Options& options, const Volume& volume, const FrameSetup& setup, const Layout& layout) {
  std::vector<Box> boxes;
  std::vector<std::size_t> numbers;
  for (std::size_t box = 0; box < layout.owners.size(); ++box) {
    if (layout.owners[box] == kNoSlot) continue;
    boxes.push_back(layout.partition.boxes()[box]);
    numbers.push_back(box);
  }
  Measured measured;
  measured.by_box.resize(layout.owners.size());
  std::vector<double> slots(std::size_t(options.slots));
  const std::vector<BoxCost> costs = MeasureBoxCosts(volume, setup, boxes, options.repeats);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    measured.boxes.push_back({costs[i].box, costs[i].seconds});
    measured.sum += costs[i].seconds;
    measured.by_box[numbers[i]] = costs[i].seconds;
    slots[layout.owners[numbers[i]]] += costs[i].seconds;
  }
  measured.imbalance = Imbalance(slots);
  measured.slowest = *std::ranges::max_element(slots);
  return measured;
}

// Over views: median, least and largest.
struct Spread {
  std::vector<double> values;
  double median() const { return MedianOf(values).median; }
};

struct Outcome {
  Spread imbalance, slowest, sum, moved;
  Spread residual;  // root mean square of (measured - predicted) / predicted, over the boxes of a view, both relative to their means

  void Add(const Measured& measured, std::int64_t moved_voxels) {
    imbalance.values.push_back(measured.imbalance);
    slowest.values.push_back(1e3 * measured.slowest);
    sum.values.push_back(1e3 * measured.sum);
    moved.values.push_back(1e-6 * double(moved_voxels));
  }
  std::string Text() const {
    const auto [least, most] = std::ranges::minmax(imbalance.values);
    return fmt::format("{:5.3f} ({:5.3f} ... {:5.3f}), slowest {:6.2f} ms, all {:7.2f} ms, predicted to {:4.2f}", imbalance.median(), least,
                       most, slowest.median(), sum.median(), residual.median());
  }
};

class Comparison {
 public:
  Comparison(const Options& options, const std::string& name)
      : options_(options),
        name_(name.substr(name.rfind('/') + 1)),
        volume_(Load(name)),
        summary_(Summarize(*volume_)),
        transfer_(MakeSetup(options, summary_, 0).transfer),
        grid_(CountOccupied(volume_->block, RendererOf(options)->DrawnTable(transfer_, summary_))),
        cost_(RendererOf(options)->MakeCost({&grid_, &summary_, &transfer_})) {}

  void Run(const Policy& policy) const {
    FrameRequest frame = MakeRequest(options_, 0);
    frame.policy = policy;
    const ResolvedPolicy resolved = ResolvePolicy(frame, summary_.description.geometry).value();
    const LayoutRequest request{.summary = &summary_,
                                .transfer = &transfer_,
                                .policy = &resolved,
                                .renderer = RendererOf(options_),
                                .slots = std::uint32_t(options_.slots),
                                .known = {.occupied = &grid_}};
    const Layout layout = MakeLayout(request);
    const auto boxes = std::ranges::count_if(layout.owners, [](std::uint32_t owner) { return owner != kNoSlot; });
    Outcome fixed, balanced;
    for (int view = 0; view < options_.views; ++view) {
      const FrameSetup setup = MakeSetup(options_, summary_, view);
      Measured measured = Measure(options_, *volume_, setup, layout);
      fixed.Add(measured, 0);
      AddResidual(setup, measured, fixed);
      if (options_.frames > 0) Balance(setup, request, layout, std::move(measured), balanced);
    }
    fmt::print("{:22} {:8} {:9} {:10} {:4} boxes, max/mean {}\n", name_, policy.decomposition, LoadMetricOf(policy), policy.assignment,
               boxes, fixed.Text());
    if (options_.frames == 0) return;
    fmt::print("{:48} after {} frames, max/mean {}, {:.1f} Mvoxels moved\n", "", options_.frames, balanced.Text(), balanced.moved.median());
    std::fflush(stdout);
  }

 private:
  void AddResidual(const FrameSetup& setup, const Measured& measured, Outcome& outcome) const {
    const auto axis = std::size_t(std::min(Number(setup.camera.traversal_axis), 1));  // for views along z there is no prediction
    double predicted = 0, squares = 0;
    for (const BoxSeconds& box : measured.boxes) predicted += cost_->Seconds(box.box, {.along = Axis(axis)});
    for (const BoxSeconds& box : measured.boxes) {
      if (cost_->Seconds(box.box, {.along = Axis(axis)}) == 0) continue;  // all its cost is in the halo
      const double ratio = box.seconds / measured.sum / (cost_->Seconds(box.box, {.along = Axis(axis)}) / predicted);
      squares += (ratio - 1) * (ratio - 1);
    }
    outcome.residual.values.push_back(std::sqrt(squares / double(measured.boxes.size())));
  }

  // Same as the coordinator's LayoutTable.
  void Balance(const FrameSetup& setup, LayoutRequest request, Layout layout, Measured measured, Outcome& outcome) const {
    MeasuredCost learnt(grid_);
    std::int64_t moved = 0;
    std::vector<double> seconds = measured.by_box;  // of this layout, over its frames
    for (int frame = 0, seen = 1; frame < options_.frames; ++frame, ++seen) {
      const double weight = std::max(0.2, 1.0 / seen);
      learnt.Learn(measured.boxes, weight);
      if (seen == 1) seconds = measured.by_box;
      for (std::size_t box = 0; box < seconds.size(); ++box) seconds[box] += weight * (measured.by_box[box] - seconds[box]);
      const WorkField cost = learnt.Field();
      request.known.cost = &cost;
      if (std::optional<Layout> better = Rebalance(layout, seconds, request, seen)) {
        moved += MovedVoxels(layout, *better);
        layout = *std::move(better);
        seen = 0;
      }
      measured = Measure(options_, *volume_, setup, layout);
      if (options_.verbose) fmt::print(" {:.3f}{}", measured.imbalance, seen == 0 ? "*" : "");
    }
    if (options_.verbose) fmt::print("\n");
    outcome.Add(measured, moved);
    AddResidual(setup, measured, outcome);
  }

  const Options& options_;
  const std::string name_;
  const std::shared_ptr<const Volume> volume_;
  const VolumeSummary summary_;
  const TransferFunction transfer_;
  const OccupancyGrid grid_;
  const std::unique_ptr<AnalyticCost> cost_;
};

void Run(const Options& options) {
  for (const std::string& name : options.volumes) {
    const Comparison comparison(options, name);
    for (const DecompositionEntry& decomposition : Decompositions()) {
      const std::vector<std::string>& wanted = options.decompositions;
      if (!wanted.empty() && std::ranges::find(wanted, decomposition.name) == wanted.end()) continue;
      Policy policy = options.policy;
      policy.decomposition = decomposition.name;
      for (const std::string& split : options.splits) {
        policy.load_metric = split;
        if (decomposition.name == "octree" && split != decomposition.load_metric) continue;  // blind to work
        comparison.Run(policy);
      }
    }
  }
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::Options options;
  CLI::App app("Imbalance of partitions");
  app.add_option("VOLUME", options.volumes, "Files, or sphere1:N and sphere2:N")->required();
  app.add_option("--transfer", options.preset, "A preset");
  app.add_option("--renderer", options.renderer)->check(CLI::IsMember(slabstream::RendererNames()));
  app.add_option("--decomposition", options.decompositions, "Only these");
  app.add_option("--split", options.splits)->check(CLI::IsMember({"voxels", "occupied"}));
  std::vector<std::string> assignments;
  for (const slabstream::AssignmentEntry& assignment : slabstream::Assignments()) assignments.emplace_back(assignment.name);
  app.add_option("--assignment", options.policy.assignment)->check(CLI::IsMember(assignments));
  app.add_option("--slots", options.slots)->check(CLI::Range(1, 4096));
  app.add_option("--groups", options.policy.groups)->check(CLI::Range(1, slabstream::kMaxGroups));
  app.add_option("--frames", options.frames, "Of dynamic balance")->check(CLI::Range(0, 1000));
  app.add_option("--views", options.views, "Azimuths, all round")->check(CLI::Range(1, 1000));
  app.add_option("--repeats", options.repeats)->check(CLI::Range(1, 1000));
  app.add_option("--size", options.size)->check(CLI::Range(1, 8192));
  app.add_option("--azimuth", options.azimuth, "Of the first view");
  app.add_option("--elevation", options.elevation);
  app.add_flag("--verbose", options.verbose, "Imbalance frame by frame; * where boxes changed");
  CLI11_PARSE(app, argc, argv);
  slabstream::Run(options);
  return 0;
}
