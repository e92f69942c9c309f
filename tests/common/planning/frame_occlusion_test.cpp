#include "common/planning/frame_occlusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/random_box.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

FrameSetup RandomSetup(Random& random) {
  FrameSetup setup;
  VolumeGeometry& geometry = setup.description.geometry;
  geometry.size = {random.Integer(1, 90), random.Integer(1, 90), random.Integer(1, 90)};
  geometry.spacing = {random.Real(0.5, 2), random.Real(0.5, 2), random.Real(0.5, 2)};
  ViewParameters view;
  view.projection = random.Chance(0.5) ? Projection::kPerspective : Projection::kOrthographic;
  view.azimuth_degrees = random.Real(0, 360);
  view.elevation_degrees = random.Real(-90, 90);
  view.roll_degrees = random.Real(0, 360);
  view.zoom = random.Chance(0.5) ? 1 : random.Real(0.2, 20);
  view.fov_degrees = random.Real(1, 60);
  setup.camera = MakeCamera(view, {random.Integer(16, 200), random.Integer(16, 200)}, geometry);
  setup.sheets = MakeSheetGrid(setup.camera, geometry);
  return setup;
}

TEST(FrameOcclusion, ABoxReachesNoFurtherThanItsReach) {
  Random random(21);
  SCOPED_TRACE(random.trace());
  int inside = 0;
  for (int round = 0; round < 3000; ++round) {
    const FrameSetup setup = RandomSetup(random);
    const Box box = RandomBox(random, setup.description.geometry.bounds());
    const PixelBounds reach = ReachOf(box, setup), frame = FrameBounds(setup);
    EXPECT_TRUE(frame.Contains(reach));
    const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
    for (int i = 0; i < 100; ++i) {
      // A sample of one of the box's slices, as far outside the box as a footprint reaches.
      const SlicePlacement slice = PlaceSlice(setup.sheets, random.Integer(box.begin[c], box.end[c] - 1));
      const FootprintSigma sigma = FootprintIn(setup.sheets, slice);
      const double at_u = random.Real(box.begin[u] - kFootprintCut * sigma.u, box.end[u] - 1 + kFootprintCut * sigma.u);
      const double at_v = random.Real(box.begin[v] - kFootprintCut * sigma.v, box.end[v] - 1 + kFootprintCut * sigma.v);
      const auto x = std::int32_t(std::floor(slice.scale_u * at_u + slice.offset_u));
      const auto y = std::int32_t(std::floor(slice.scale_v * at_v + slice.offset_v));
      if (!frame.Contains({x, y, x + 1, y + 1})) continue;
      ASSERT_TRUE(reach.Contains({x, y, x + 1, y + 1})) << "pixel " << x << ", " << y << ", round " << round;
      ++inside;
    }
  }
  EXPECT_GT(inside, 50000);
}

TEST(FrameOcclusion, AMaskHidesABoxIfItHidesItsReach) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  int hidden = 0;
  for (int round = 0; round < 2000; ++round) {
    const FrameSetup setup = RandomSetup(random);
    const Box box = RandomBox(random, setup.description.geometry.bounds());
    const PixelBounds frame = FrameBounds(setup);
    OcclusionMask mask{OcclusionTiles(frame.width()), OcclusionTiles(frame.height()), {}};
    mask.steps.assign(std::size_t(mask.tiles_x) * std::size_t(mask.tiles_y), kOcclusionSteps);
    EXPECT_TRUE(CheckFits(mask, setup).ok());
    EXPECT_TRUE(HidesBox(mask, box, setup));
    EXPECT_FALSE(HidesBox({}, box, setup)) << "nothing is known";
    const std::int32_t x = random.Integer(0, frame.width() - 1), y = random.Integer(0, frame.height() - 1);
    mask.steps[std::size_t(y / kOcclusionTile) * std::size_t(mask.tiles_x) + std::size_t(x / kOcclusionTile)] = 0;
    const std::int32_t left = x / kOcclusionTile * kOcclusionTile, top = y / kOcclusionTile * kOcclusionTile;
    const PixelBounds reach = ReachOf(box, setup);
    const bool shows = !reach.empty() && !Intersection(reach, {left, top, left + kOcclusionTile, top + kOcclusionTile}).empty();
    EXPECT_EQ(HidesBox(mask, box, setup), !shows);
    hidden += shows ? 0 : 1;
  }
  EXPECT_GT(hidden, 100);
}

TEST(FrameOcclusion, MasksFitFramesThatUseThem) {
  Random random(1);
  FrameSetup setup = RandomSetup(random);
  OcclusionMask mask{OcclusionTiles(setup.sheets.width), OcclusionTiles(setup.sheets.height), {}};
  mask.steps.resize(std::size_t(mask.tiles_x) * std::size_t(mask.tiles_y));
  EXPECT_TRUE(CheckFits(mask, setup).ok());
  setup.termination = 0;
  EXPECT_FALSE(CheckFits(mask, setup).ok());
  EXPECT_TRUE(CheckFits(OcclusionMask{}, setup).ok());
  setup.termination = 0.1;
  SetRenderer(*ZBuffer(), setup);
  EXPECT_FALSE(CheckFits(mask, setup).ok());
  EXPECT_TRUE(CheckFits(OcclusionMask{}, setup).ok());
  SetRenderer(*Splatting(), setup);
  setup.sheets.width += kOcclusionTile;
  EXPECT_FALSE(CheckFits(mask, setup).ok());
}

}  // namespace
}  // namespace slabstream
