// What bricks tell of what is hidden (OpaqueFront), held against what renderers draw.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/planning/least_extinction.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace testing;

constexpr double kTermination = 1.0 / 1024;

std::vector<const RendererKind*> ByValue() {
  std::vector<const RendererKind*> kinds;
  for (const RendererKind* kind : Renderers()) {
    if (kind->opacity_by_value()) kinds.push_back(kind);
  }
  return kinds;
}

OpaqueFront FrontOf(const Volume& volume, const FrameSetup& setup) {
  return FindOpaqueFront(FindLeastExtinction(Summarize(volume), {1, setup.transfer, setup.renderer, setup.clip}), setup);
}

// A ball with waves of values in it; outside it is empty.
Volume MakeWavyBall(const VolumeGeometry& geometry) {
  const Vec3 centre = geometry.centre();
  return MakeVolume(geometry, ScalarType::kUint8, [&](const Index3& v) {
    const Vec3 from_centre = {v.x - centre.x, v.y - centre.y, v.z - centre.z};
    return Length(from_centre) < 0.49 * geometry.size.x ? 150 + 50 * std::sin(0.2 * v.x) * std::cos(0.15 * v.y) : 0;
  });
}

FrameSetup SetupOf(const Volume& volume, const RendererKind* kind, Projection projection, double opacity, std::mt19937& random) {
  SetupOptions options;
  options.renderer = kind;
  options.view = RandomView(projection, random);
  options.transfer = Ramp(opacity);
  options.size = {190, 170};
  options.termination = kTermination;
  return MakeSetup(volume, options);
}

// Slices that lie before a depth are drawn alone: each pixel must be at least as opaque as the front says.
TEST(OpaqueFront, IsNeverMoreOpaqueThanThePicture) {
  const unsigned seed = 50;
  std::mt19937 random(seed);
  int tiles = 0;
  for (const Vec3& spacing : {Vec3{1, 1, 1}, Vec3{1, 1.4, 0.8}}) {
    const Volume volume = MakeWavyBall({{144, 144, 144}, spacing});
    for (const RendererKind* kind : ByValue()) {
      for (const Projection projection : kProjections) {
        for (int view = 0; view < 3; ++view) {
          FrameSetup setup = SetupOf(volume, kind, projection, 0.3, random);
          const OpaqueFront front = FrontOf(volume, setup);
          ASSERT_GE(front.tile, kOcclusionTile);
          SCOPED_TRACE(::testing::Message() << "seed " << seed << ' ' << kind->name() << " view " << view);
          const Axis c = setup.camera.traversal_axis;
          setup.termination = 0;  // all is drawn
          for (const std::int32_t depth : {40, 56, 72, 90}) {
            Box before = volume.description.geometry.bounds();
            (setup.camera.ascending ? before.end[c] : before.begin[c]) = setup.camera.ascending ? depth : before.end[c] - depth;
            const LocalImage image = RenderByBoxes(volume, setup, Partition(before, {Partition::Node{}}));
            for (std::int32_t y = 0; y < FrameBounds(setup).height(); ++y) {
              for (std::int32_t x = 0; x < FrameBounds(setup).width(); ++x) {
                const OpaqueFront::Depths& depths = front.tiles[std::size_t(y / front.tile * front.tiles_x + x / front.tile)];
                const auto steps =
                    std::ranges::count_if(depths, [&](int d) { return d != OpaqueFront::kNever && d * front.unit <= depth; });
                if (steps == 0) continue;
                ++tiles;
                const double most = std::pow(kTermination, double(steps) / kOcclusionSteps);
                ASSERT_LE(1 - PixelOf(image, x, y)[3], most + 1e-6) << "depth " << depth << " at " << x << ' ' << y;
              }
            }
          }
        }
      }
    }
  }
  EXPECT_GT(tiles, 10000);
}

TEST(OpaqueFront, BoxesBehindDrawLessOfTheSamePicture) {
  const unsigned seed = 51;
  std::mt19937 random(seed);
  const Volume volume = MakeWavyBall({{160, 160, 160}, {1, 1, 1}});
  for (const RendererKind* kind : ByValue()) {
    std::uint64_t with = 0, without = 0;
    for (const Projection projection : kProjections) {
      for (int view = 0; view < 3; ++view) {
        FrameSetup setup = SetupOf(volume, kind, projection, 0.9, random);
        const Partition partition = CutAtRandom(volume.block.box, 16, random);
        SCOPED_TRACE(::testing::Message() << "seed " << seed << ' ' << kind->name() << " view " << view);
        const LocalImage plain = RenderByBoxes(volume, setup, partition, &without);
        setup.front = FrontOf(volume, setup);
        const LocalImage fronted = RenderByBoxes(volume, setup, partition, &with);
        EXPECT_LE(LargestDifference(plain, fronted), 2e-5 + kTermination);
        EXPECT_LE(LargestDifference(RenderWhole(volume, setup), fronted), 2e-5 + kTermination);
      }
    }
    EXPECT_LT(double(with), 0.95 * double(without)) << kind->name();
  }
}

TEST(OpaqueFront, NothingIsKnownWhereOpacityIsNotOfValuesAlone) {
  const Volume volume = MakeWavyBall({{112, 112, 112}, {1, 1, 1}});
  const VolumeSummary summary = Summarize(volume);
  const auto known = [&](const RendererKind* kind, const TransferFunction& transfer, const ClipRegion& clip = {}) {
    return !FindLeastExtinction(summary, {1, transfer, kind, clip}).bricks.empty();
  };
  const RendererKind* const raycast = FindRenderer("raycast");
  EXPECT_TRUE(known(raycast, Ramp(0.3)));
  TransferFunction by_gradient = Ramp(0.3);
  by_gradient.gradient_opacities = {{3, 0}, {20, 1}};
  EXPECT_FALSE(known(raycast, by_gradient));
  EXPECT_FALSE(known(FindRenderer("shear"), Ramp(0.3))) << "its kernels overshoot";
  EXPECT_FALSE(known(FindRenderer("zbuffer"), Ramp(0.3)));
  Clipping half;
  half.planes = {{{1, 0, 0}, -20}};
  EXPECT_FALSE(known(raycast, Ramp(0.3), MakeClipRegion(half, volume.description.geometry).value()));
}

}  // namespace
}  // namespace slabstream
