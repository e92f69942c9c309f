// How even partitions are: every box of each is rendered alone on one thread (client/lab/box_costs.h), the boxes of a slot are added up,
// and the slot with most to do is compared with the mean. Then the same after some frames of dynamic balance of one view. For volumes given
// on the command line; "sphere1:300" is the paper's class-I sphere with N = 300.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "client/lab/box_costs.h"
#include "common/classification/count_occupied.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/balance.h"
#include "common/planning/learnt_cost.h"
#include "common/volume/sphere.h"
#include "common/volume_io/volume_reader.h"

namespace slabstream {
namespace {

struct Options {
  std::vector<std::string> volumes;
  Policy policy{.groups = 1};
  std::string preset = "auto", renderer = "splat";
  int slots = 16, repeats = 3, size = 512, frames = 5;
  double azimuth = 30, elevation = 20;
  bool verbose = false;
};

std::shared_ptr<const Volume> Load(const std::string& name) {
  if (name.rfind("sphere", 0) != 0) return ReadVolume(name).value().volume;
  const bool hollow = name[6] == '1';
  const SphereRequest request{hollow ? SphereClass::kHollow : SphereClass::kFilled, std::stoi(name.substr(8)), hollow ? 0.05 : 0.4};
  return std::make_shared<const Volume>(MakeSphere(request).value());
}

FrameSetup MakeSetup(const Options& options, const VolumeSummary& summary) {
  FrameRequest request;
  request.dataset = "volume";
  request.renderer = options.renderer == "zbuffer" ? RendererKind::kZBuffer : RendererKind::kSplat;
  request.size = {options.size, options.size};
  request.view = {.azimuth_degrees = options.azimuth, .elevation_degrees = options.elevation};
  request.transfer.choice = options.preset;
  return PlanFrame(request, 1, summary, Roster{{1}}, {}).value().setup;
}

struct Measured {
  std::vector<BoxSeconds> boxes;
  std::vector<double> by_box;         // of the layout; 0: nobody renders it
  double imbalance = 0, seconds = 0;  // of slots; of all boxes together
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
    measured.seconds += costs[i].seconds;
    measured.by_box[numbers[i]] = costs[i].seconds;
    slots[layout.owners[numbers[i]]] += costs[i].seconds;
  }
  measured.imbalance = Imbalance(slots);
  return measured;
}

void Compare(const Options& options, const std::string& name, const Volume& volume, const VolumeSummary& summary, const FrameSetup& setup,
             const OccupancyGrid& grid, const Policy& policy) {
  LayoutRequest request{.summary = &summary,
                        .transfer = &setup.transfer,
                        .policy = &policy,
                        .slots = std::uint32_t(options.slots),
                        .known = {.occupied = &grid}};
  Layout layout = MakeLayout(request);
  Measured measured = Measure(options, volume, setup, layout);
  fmt::print("{:24} {:8} {:9} {:10} {:4} boxes: {:6.3f} max/mean, {:7.2f} ms", name, policy.decomposition, SplitOf(policy),
             policy.assignment, measured.boxes.size(), measured.imbalance, 1e3 * measured.seconds);

  LearntCost learnt(grid);
  std::int64_t moved = 0;
  for (int frame = 0, seen = 1; frame < options.frames; ++frame, ++seen) {
    learnt.Learn(measured.boxes, std::max(0.2, 1.0 / seen));
    const WorkField cost = learnt.Field();
    request.known.cost = &cost;
    if (std::optional<Layout> better = Rebalance(layout, measured.by_box, request, seen)) {
      moved += MovedVoxels(layout, *better);
      layout = *std::move(better);
      seen = 0;
    }
    measured = Measure(options, volume, setup, layout);
    if (options.verbose) fmt::print(" {:.3f}{}", measured.imbalance, seen == 0 ? "*" : "");
  }
  fmt::print("; after {} frames {:6.3f}, {:7.2f} ms, {:6.1f} Mvoxels moved\n", options.frames, measured.imbalance, 1e3 * measured.seconds,
             1e-6 * double(moved));
}

void Run(const Options& options) {
  for (const std::string& name : options.volumes) {
    const std::shared_ptr<const Volume> volume = Load(name);
    const VolumeSummary summary = Summarize(*volume);
    const FrameSetup setup = MakeSetup(options, summary);
    const OccupancyGrid grid = CountOccupied(volume->block, Classify(setup.transfer, setup.description, setup.range));
    for (const DecompositionEntry& decomposition : Decompositions()) {
      Policy policy = options.policy;
      policy.decomposition = decomposition.name;
      for (const std::string split : {"voxels", "occupied"}) {
        policy.split = split;
        if (decomposition.name == "octree" && split != decomposition.split) continue;  // blind to work
        Compare(options, name.substr(name.rfind('/') + 1), *volume, summary, setup, grid, policy);
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
  app.add_option("--renderer", options.renderer)->check(CLI::IsMember({"splat", "zbuffer"}));
  app.add_option("--assignment", options.policy.assignment)->check(CLI::IsMember({"cyclic", "contiguous", "greedy"}));
  app.add_option("--slots", options.slots)->check(CLI::Range(1, 4096));
  app.add_option("--groups", options.policy.groups)->check(CLI::Range(1, slabstream::kMaxGroups));
  app.add_option("--frames", options.frames, "Of dynamic balance")->check(CLI::Range(0, 1000));
  app.add_option("--repeats", options.repeats)->check(CLI::Range(1, 1000));
  app.add_option("--size", options.size)->check(CLI::Range(1, 8192));
  app.add_option("--azimuth", options.azimuth);
  app.add_option("--elevation", options.elevation);
  app.add_flag("--verbose", options.verbose, "Imbalance frame by frame; * where boxes changed");
  CLI11_PARSE(app, argc, argv);
  slabstream::Run(options);
  return 0;
}
