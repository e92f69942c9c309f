// Figure 8c: splatting against occupancy, with the volumes of the paper: each worker's slab holds a ball of C N^3/p voxels. All slabs are
// alike, so one is rendered.
#include <algorithm>
#include <array>
#include <cmath>

#include "common/planning/placement.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/box_costs.h"

namespace slabstream {
namespace {

constexpr std::array<double, 7> kOccupancies = {0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1};
constexpr int kWorkers = 10, kRenderings = 2;

// At most occupancy * size voxels: whole shells of equal distance from the slab's centre.
Volume MakeClippedBall(const Index3& size, double occupancy) {
  Volume volume;
  volume.description.geometry.size = size;
  volume.description.type = ScalarType::kUint8;
  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), ScalarType::kUint8);
  std::vector<std::int64_t> distances;  // squared, in half voxels
  distances.reserve(volume.block.bytes.size());
  const auto half_voxels = [](int index, int side) { return 2 * std::int64_t{index} - (side - 1); };
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      const std::int64_t dy = half_voxels(y, size.y), dz = half_voxels(z, size.z);
      for (int x = 0; x < size.x; ++x) {
        const std::int64_t dx = half_voxels(x, size.x);
        distances.push_back(dx * dx + dy * dy + dz * dz);
      }
    }
  }
  auto* samples = volume.block.samples<std::uint8_t>();
  const auto wanted = std::size_t(std::llround(occupancy * double(distances.size())));
  std::vector<std::int64_t> sorted = distances;
  const auto next = sorted.begin() + std::ptrdiff_t(std::min(wanted, sorted.size() - 1));
  std::ranges::nth_element(sorted, next);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (wanted == distances.size() || distances[i] < *next) samples[i] = std::uint8_t(128 + i % 128);
  }
  return volume;
}

// One worker's slab as a volume of its own: N x N voxels and N/p along the axis on which slices are traversed, at a pixel a voxel.
FrameCase SlabFrame(const PaperSetup& setup) { return setup.Frame(Splatting(), setup.large_size(), kWorkers); }

Json KeyOf(const PaperSetup& setup, double occupancy) {
  return {{"what", "occupied slab"}, {"N", setup.large_size()}, {"p", kWorkers}, {"C", occupancy}};
}

Json MeasureSlab(const PaperSetup& setup, double occupancy) {
  FrameCase frame = SlabFrame(setup);
  const FramePlan whole = PlanOf(setup.context(), frame);
  const int side = setup.large_size();
  Index3 size = {side, side, side};
  size[whole.setup.camera.traversal_axis] = std::max(1, side / kWorkers);
  const Volume volume = MakeClippedBall(size, occupancy);

  const double diagonal = std::sqrt(double(size.x) * size.x + double(size.y) * size.y + double(size.z) * size.z);
  frame.view.zoom = diagonal / side;
  frame.volume = SphereCase({SphereClass::kFilled, side, 0.5}, kTranslucentSphere);
  const FramePlan plan = OrThrow(PlanFrame(RequestOf(frame), 1, Summarize(volume), RosterOf(1)));
  const std::vector<BoxCost> boxes = MeasureBoxCosts(volume, plan, kRenderings);
  double seconds = 0;
  for (const BoxCost& box : boxes) {
    seconds += double(box.stage_ns[std::size_t(Stage::kTransform)] + box.stage_ns[std::size_t(Stage::kSplat)]) * 1e-9;
  }
  return Json{{"seconds", seconds}};
}

}  // namespace

std::vector<Trial> OccupancyTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  for (const double occupancy : kOccupancies) {
    const double voxels = std::pow(setup.large_size(), 3) / kWorkers;
    trials.push_back(
        {KeyOf(setup, occupancy), [setup, occupancy] { return MeasureSlab(setup, occupancy); }, voxels * 1e-6 * (0.1 + occupancy)});
  }
  return trials;
}

void AddOccupancy(const PaperSetup& setup, Results& results) {
  for (const double occupancy : kOccupancies) {
    Json of = ColumnsOf(SlabFrame(setup));
    of.update(Json{{"part", "figure-8c"}, {"occupancy", occupancy}, {"volume", "class2-in-each-slab"}, {"stage", "places and splat"}});
    results.Add(of, "stage_time", ValuesOf(setup.context().log(), KeyOf(setup, occupancy), "seconds"), Origin::kMeasured);
  }
}

}  // namespace slabstream
