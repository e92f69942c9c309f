#include "common/planning/shown_zones.h"

#include <gtest/gtest.h>

#include "common/renderers/registry.h"
#include "common/renderers/renderer_kind.h"
#include "tests/common/planning/plan_support.h"

namespace slabstream {
namespace {

VolumeSummary UnreadLevel(const Index3& size, const Index3& block) {
  VolumeSummary summary = UnreadSummary({.geometry = {.size = size}}, FullSummary({16, 16, 16}));
  summary.stored = StoredAt{.source = "/data/scan.ome.zarr", .block = {{0, 0, 0}, block}};
  return summary;
}

bool IsInPicture(const Vec3& p, const Camera& camera) {
  const Camera::ImagePoint at = camera.Project(p);
  return at.depth > 0 && at.x >= 0 && at.y >= 0 && at.x <= camera.width && at.y <= camera.height;
}

TEST(ShownZones, EveryVoxelThatThePictureShowsLiesInOne) {
  Random random(83);
  SCOPED_TRACE(random.trace());
  int maps = 0;
  std::int64_t zones = 0, shown = 0;
  for (int round = 0; round < 300; ++round) {
    const Index3 size = {random.Integer(100, 3000), random.Integer(100, 3000), random.Integer(100, 3000)};
    const Index3 block = {random.Integer(1, 100), random.Integer(1, 100), random.Integer(1, 100)};
    FrameRequest request = SomeRequest();
    request.renderer = std::array{"splat", "raycast", "zbuffer", "mip"}.at(random.Integer<std::size_t>(0, 3));
    request.view = RandomView(random);
    request.view.zoom = random.Real(1, 12);
    if (random.Chance(0.3))
      request.clipping.box = ClipBox{{0.1 * size.x, 0, 0}, {0.3 * size.x, 0.5 * size.y, 0.9 * size.z}, ClipUnit::kVoxels};
    const FrameSetup setup = SetupOf(request, UnreadLevel(size, block));
    const std::shared_ptr<const LevelMap> map = ShownZones(setup);
    if (map == nullptr) continue;
    ++maps;
    ASSERT_EQ(map->levels, std::vector<int>{0});
    ASSERT_EQ(map->of_zone.size(), CountIn(map->counts));
    for (const Axis axis : kAxes) {
      EXPECT_EQ(map->side[axis] % block[axis], 0) << "zones are of whole blocks";
      EXPECT_LE(map->counts[axis], 64);
    }
    zones += std::ssize(map->of_zone);
    shown += std::ranges::count(map->of_zone, 0);
    for (int i = 0; i < 2000; ++i) {
      const Index3 voxel = {random.Integer(0, size.x - 1), random.Integer(0, size.y - 1), random.Integer(0, size.z - 1)};
      const Vec3 p = {double(voxel.x), double(voxel.y), double(voxel.z)};
      if (!std::ranges::all_of(setup.clip.sides, [&](const HalfSpace& side) { return side.Distance(p) >= 0; })) continue;
      if (!IsInPicture(p, setup.camera)) continue;
      EXPECT_EQ(map->Of({voxel.x / map->side.x, voxel.y / map->side.y, voxel.z / map->side.z}), 0)
          << "round " << round << ", voxel " << voxel.x << ", " << voxel.y << ", " << voxel.z;
    }
  }
  EXPECT_GT(maps, 100);
  EXPECT_LT(shown, zones / 2);
}

TEST(ShownZones, OfWhatIsHeldOrShownAsAWholeThereIsNone) {
  FrameRequest request = SomeRequest();
  EXPECT_EQ(ShownZones(SetupOf(request, UnreadLevel({512, 512, 512}, Uniform(64)))), nullptr);
  request.view.zoom = 8;
  EXPECT_NE(ShownZones(SetupOf(request, UnreadLevel({512, 512, 512}, Uniform(64)))), nullptr);
  EXPECT_EQ(ShownZones(SetupOf(request, FullSummary({512, 512, 512}))), nullptr);
}

// Of 8192 voxels a side the picture shows a beam through the middle, 512 wide.
TEST(ShownZones, BoxesOfATerabyteAreThoseOfThePicture) {
  constexpr std::int64_t kTarget = std::int64_t{64} << 20;
  const VolumeSummary summary = UnreadLevel(Uniform(8192), Uniform(64));
  FrameRequest request = SomeRequest();
  request.view.zoom = 16 * std::sqrt(3.0);
  request.view.azimuth_degrees = 0;
  request.view.elevation_degrees = 0;
  for (const double azimuth : {0.0, 33.0}) {
    request.view.azimuth_degrees = azimuth;
    const ResolvedRequest resolved = Resolved(request, summary);
    const FrameSetup setup = MakeFrameSetup(resolved).value();
    const std::shared_ptr<const LevelMap> map = ShownZones(setup);
    ASSERT_NE(map, nullptr);
    const Roster roster = FullRoster(2);
    const auto layout = std::make_shared<const Layout>(MakeLayout({.summary = &summary,
                                                                   .volume = &resolved.volume,
                                                                   .policy = &resolved.policy,
                                                                   .slots = 2,
                                                                   .box_bytes_target = kTarget,
                                                                   .map = map.get()}));
    const FramePlan plan = PlanFrame(setup, resolved.policy, roster, layout).value();
    ExpectSound(plan, roster);
    std::int64_t voxels = 0;
    for (const Placement& placement : PlacementsOf(plan)) {
      const Box padded = PaddedBox(placement.at(), plan.setup);
      EXPECT_LE(padded.voxel_count(), kTarget);
      voxels += padded.voxel_count();
    }
    const std::int64_t beam = std::int64_t{512} * 512 * 8192;
    EXPECT_GT(voxels, beam);
    EXPECT_LT(voxels, 4 * beam) << "azimuth " << azimuth;
  }
}

}  // namespace
}  // namespace slabstream
