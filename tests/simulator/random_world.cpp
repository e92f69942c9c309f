#include "tests/simulator/random_world.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "common/base/find_named.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/policy_names.h"
#include "tests/common/decomposition/random_partition.h"
#include "tests/support/random_combining.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// 8 MiB: a padded box has 1 to 8 chunks. Voxels of four bytes, since plans cost time by voxel.
constexpr Index3 kVolumeSize{256, 64, 128}, kOwnedSize{64, 32, 32};

// Values up to 50 show nothing.
TransferFunction StepTransfer() {
  TransferFunction transfer;
  transfer.colors = {{0, {0, 0, 0}}, {255, {1, 1, 1}}};
  transfer.opacities = {{0, 0}, {50, 0}, {51, 0.5}, {255, 1}};
  return transfer;
}

// Whole layers of bricks across x are empty, so that some boxes show nothing, or visible in every voxel, so that they hide others
// before anything is drawn.
void MakeVolume(Random& random, const ModelCells& cells, SimulatedWorld& world) {
  auto summary = std::make_shared<VolumeSummary>();
  const Index3 size = world.owned ? kOwnedSize : kVolumeSize;  // voxels of owners are real
  summary->description.geometry.size = size;
  summary->description.type = kVoxelType;
  summary->range = {0, 255};
  summary->brick_counts = {size.x / kBrick, size.y / kBrick, size.z / kBrick};
  const double empty = random.Chance(0.05) ? 1 : random.Real(0, 0.8);
  std::vector<ValueRange> layers;
  const double solid = random.Chance(0.3) ? random.Real(0, 1) : 0;
  for (int x = 0; x < summary->brick_counts.x; ++x) {
    layers.push_back(random.Chance(empty) ? ValueRange{0, 10} : ValueRange{random.Chance(solid) ? 100.0F : 0.0F, 200});
  }
  for (int i = 0; i < summary->brick_counts.y * summary->brick_counts.z; ++i) {
    summary->bricks.insert(summary->bricks.end(), layers.begin(), layers.end());
  }
  if (cells.present()) summary->cells.assign(summary->bricks.size(), 1000);
  world.occupied = std::make_shared<const OccupancyGrid>(
      BrickVisibility(*summary, Classify(StepTransfer(), summary->description, summary->range)).VisibleCells());
  world.summary = std::move(summary);
}

}  // namespace

SimulatedWorld RandomWorld(Random& random, const Faults& faults, const ModelCells& cells, bool owned) {
  SimulatedWorld world{.owned = owned};
  MakeVolume(random, cells, world);
  world.speed.render = random.Chance(0.1) ? 0.3 : random.Real(0.001, 0.04);
  // A box takes less time than a frame may be without progress, also if all clients have one.
  if (random.Chance(0.3)) world.speed.large = std::max(1.0, std::min(random.Real(5, 20), 0.3 / world.speed.render));
  world.speed.combine = random.Real(10e-6, 5e-3);
  world.speed.store = random.Real(10e-6, 1e-3);
  world.speed.finish = random.Real(10e-6, 20e-3);
  world.worker_config.register_interval = milliseconds(500);
  world.worker_config.chunk_timeout = seconds(1);
  world.worker_config.chunk_attempts = 6;
  world.worker_config.credit_bytes = std::uint64_t{kChunkBytes} * random.Integer<std::uint64_t>(1, 4);
  if (!faults.none() && random.Chance(0.3)) world.worker_config.cache_bytes = std::uint64_t{4} << 20;
  world.in_parts = !cells.present() && !owned && random.Chance(faults.only_stores() ? 1 : 0.25);
  world.policy.groups = random.Integer(1, 6);
  world.policy.axis = AxisChoice(random.Integer(0, 4));
  const auto one_of = [&](const auto& entries) { return std::string(entries[random.Integer<std::size_t>(0, entries.size() - 1)].name); };
  if (random.Chance(0.7)) {
    world.policy.decomposition = one_of(Decompositions());
    world.policy.balance_by = one_of(BalanceByChoices());
    world.policy.assignment = one_of(Assignments());
    world.policy.balance = one_of(Balances());
  }
  if (FindNamed(Assignments(), world.policy.assignment)->by_owner) {
    auto summary = std::make_shared<VolumeSummary>(*world.summary);
    auto boxes = std::make_shared<OwnedBoxes>();
    const Partition partition = RandomPartition(random, summary->description.geometry.bounds(), random.Integer(1, 30));
    const std::uint32_t owners = random.Integer(1U, 8U);
    for (const Box& box : partition.boxes()) boxes->push_back({box, random.Integer(0U, owners - 1)});
    summary->owned = std::move(boxes);
    world.summary = std::move(summary);
    world.policy.balance = Policy().balance;  // boxes stay where they are
  }
  world.policy.combine = RandomCombining(random);
  if (random.Chance(0.1)) world.policy.combine.clear();
  if (random.Chance(0.3)) world.policy.teams = random.Integer(2, 4);
  world.shapes = !owned && random.Chance(0.2);
  return world;
}

SubmitFrame RandomRequest(Random& random, const Policy& policy, RequestId id, std::uint32_t deadline_ms) {
  SubmitFrame submit;
  submit.request = id;
  submit.deadline_ms = deadline_ms;
  submit.frame.dataset = "volume";
  submit.frame.size = {random.Integer(1, 3), random.Integer(1, 2)};
  submit.frame.view.zoom = random.Chance(0.2) ? 400 : 4000;  // few pixels, but not minified: no supersampling
  submit.frame.view.azimuth_degrees = random.Integer(0, 7) * 45 + 10;
  submit.frame.view.elevation_degrees = random.Integer(-80, 80);
  submit.frame.view.projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
  submit.frame.transfer.choice = StepTransfer();
  if (random.Chance(0.1)) submit.frame.renderer = ZBuffer()->name();
  if (random.Chance(0.1)) submit.frame.termination = 0;
  submit.frame.policy = policy;
  submit.frame.previews = random.Chance(0.3);
  if (random.Chance(0.9)) submit.pictures = PicturesDoor{4711, std::string(40, 'k')};  // nobody opens it
  return submit;
}

}  // namespace slabstream
