// Where a slice is sampled and who owns the samples: whatever boxes divide the volume, each sample of each sheet belongs to one of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/common/view/view_limits.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/splat/slice_samples.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

FrameSetup SetupOf(const VolumeGeometry& geometry, const ViewParameters& view) {
  FrameSetup setup;
  setup.description.geometry = geometry;
  setup.camera = MakeCamera(view, {50, 40}, geometry);
  setup.sheets = MakeSheetGrid(setup.camera, geometry);
  return setup;
}

TEST(SliceSamples, EverySampleHasOneOwner) {
  const unsigned seed = 14;
  std::mt19937 random(seed);
  const VolumeGeometry geometry = {{50, 40, 30}, {1, 1, 2}};
  const Box whole = geometry.bounds();
  for (Projection projection : kProjections) {
    for (int i = 0; i < 12; ++i) {
      ViewParameters view = RandomView(projection, random);
      view.zoom *= std::array{0.2, 1.0, 5.0}[std::size_t(i) % 3];
      const FrameSetup setup = SetupOf(geometry, view);
      const Partition partition = CutAtRandom(whole, 17, random);
      const Axis c = setup.camera.traversal_axis;
      Footprints footprints;
      for (std::int32_t k = 0; k < geometry.size[c]; ++k) {
        const PixelBounds seen = SampleSlice(setup, whole, whole, k, footprints).owned;
        EXPECT_TRUE(FrameBounds(setup).Contains(seen));
        std::vector<int> owners(std::size_t(setup.sheets.width) * std::size_t(setup.sheets.height));
        std::int64_t owned = 0;
        for (const Box& box : partition.boxes()) {
          if (k < box.begin[c] || k >= box.end[c]) continue;
          const PixelBounds part = SampleSlice(setup, box, whole, k, footprints).owned;
          if (part.empty()) continue;
          ASSERT_TRUE(seen.Contains(part));
          for (std::int32_t y = part.y_begin; y < part.y_end; ++y) {
            for (std::int32_t x = part.x_begin; x < part.x_end; ++x) {
              ++owners[std::size_t(y) * std::size_t(setup.sheets.width) + std::size_t(x)];
            }
          }
          owned += part.pixel_count();
        }
        ASSERT_TRUE(std::ranges::all_of(owners, [](int n) { return n <= 1; })) << "seed " << seed << " view " << i << " slice " << k;
        ASSERT_EQ(owned, seen.pixel_count()) << "seed " << seed << " view " << i << " slice " << k;
      }
    }
  }
}

// The owner is the box that the pixel's ray goes through in the slice.
TEST(SliceSamples, TheOwnerIsWhereTheRayMeetsTheSlice) {
  const unsigned seed = 15;
  std::mt19937 random(seed);
  const VolumeGeometry geometry = {{50, 40, 30}, {1, 1.3, 0.8}};
  for (Projection projection : kProjections) {
    for (int i = 0; i < 12; ++i) {
      const FrameSetup setup = SetupOf(geometry, RandomView(projection, random));
      const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
      const Partition partition = CutAtRandom(geometry.bounds(), 9, random);
      Footprints footprints;
      for (const Box& box : partition.boxes()) {
        const std::int32_t k = box.begin[c];
        const SlicePlacement place = PlaceSlice(setup.sheets, k);
        const PixelBounds owned = SampleSlice(setup, box, geometry.bounds(), k, footprints).owned;
        constexpr double kTolerance = 1e-5;  // voxels: planes are moved by 2^-20, places counted in 2^-32
        for (std::int32_t x = owned.x_begin; x < owned.x_end; ++x) {
          const double at = (x + 0.5 - place.offset_u) / place.scale_u;
          if (box.begin[u] > 0) {
            ASSERT_GE(at, box.begin[u] - 0.5 - kTolerance);
          }
          if (box.end[u] < geometry.size[u]) {
            ASSERT_LE(at, box.end[u] - 0.5 + kTolerance);
          }
        }
        for (std::int32_t y = owned.y_begin; y < owned.y_end; ++y) {
          const double at = (y + 0.5 - place.offset_v) / place.scale_v;
          if (box.begin[v] > 0) {
            ASSERT_GE(at, box.begin[v] - 0.5 - kTolerance);
          }
          if (box.end[v] < geometry.size[v]) {
            ASSERT_LE(at, box.end[v] - 0.5 + kTolerance);
          }
        }
      }
    }
  }
}

// All voxels that a box's samples take lie in the box and its halo, with one more for gradients.
TEST(SliceSamples, TapsOfOwnedSamplesLieInTheHalo) {
  const unsigned seed = 16;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (Projection projection : kProjections) {
    for (int i = 0; i < 200; ++i) {
      VolumeGeometry geometry = {{60, 60, 60}, {1, 1, 1}};
      for (Axis axis : kAxes) {
        geometry.size[axis] = 30 + std::int32_t(random() % 200);
        geometry.spacing[axis] = std::pow(5, uniform(random));
      }
      ViewParameters view = RandomView(projection, random);
      view.zoom = std::pow(10, 4 * uniform(random) - 2);
      view.fov_degrees = kMinFovDegrees + (kMaxFovDegrees - kMinFovDegrees) * uniform(random);
      const FrameSetup setup = SetupOf(geometry, view);
      const auto [c, u, v] = AxesOf(setup.camera.traversal_axis);
      Box box = geometry.bounds();
      for (Axis axis : kAxes) box.begin[axis] = geometry.size[axis] / 3, box.end[axis] = 2 * geometry.size[axis] / 3;
      Footprints footprints;
      for (std::int32_t k = box.begin[c]; k < box.end[c]; ++k) {
        const SliceSamples samples = SampleSlice(setup, box, geometry.bounds(), k, footprints);
        if (samples.owned.empty()) continue;
        const auto expect_inside = [&](const Lattice& lattice, std::int32_t taps, std::int32_t begin, std::int32_t end, Axis axis) {
          ASSERT_GE(Lattice::First(lattice.At(begin)), box.begin[axis] - (kHalo - 1)) << "seed " << seed << " view " << i;
          ASSERT_LE(Lattice::First(lattice.At(end - 1)) + taps, box.end[axis] + (kHalo - 1)) << "seed " << seed << " view " << i;
        };
        expect_inside(samples.columns, samples.along_u->taps, samples.owned.x_begin, samples.owned.x_end, u);
        expect_inside(samples.rows, samples.along_v->taps, samples.owned.y_begin, samples.owned.y_end, v);
      }
    }
  }
}

// The first pixel with a tap, against a search.
TEST(SliceSamples, FindsTheFirstPixelWithATap) {
  const unsigned seed = 17;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 2000; ++i) {
    const Lattice lattice = MakeLattice(0.2 + 3 * uniform(random), 200 * uniform(random) - 100, 1 + 4 * uniform(random));
    const std::int32_t begin = std::int32_t(random() % 50), end = begin + std::int32_t(random() % 100);
    const std::int32_t voxel = std::int32_t(random() % 400) - 200;
    std::int32_t expected = begin;
    while (expected < end && Lattice::First(lattice.At(expected)) < voxel) ++expected;
    ASSERT_EQ(FirstPixelWithTap(lattice, voxel, begin, end), expected) << "seed " << seed << " case " << i;
  }
}

}  // namespace
}  // namespace slabstream
