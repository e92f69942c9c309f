// What renderers keep of the boxes of one padded box: all boxes of a partition, and little of partitions that are gone.
#include "worker/renderers/recent_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/splat/splat_cache.h"
#include "worker/renderers/zbuffer/surface_cache.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

Volume Blobs() { return MakeBlobs({{72, 64, 80}, {1, 1.5, 0.7}}, ScalarType::kUint8, 36); }

FrameSetup SetupFor(const Volume& volume, const RendererKind* renderer) {
  SetupOptions options;
  options.renderer = renderer;
  return MakeSetup(volume, options);
}

// Disjoint boxes that fill the volume. Neither their borders nor the volume's end lie at bricks.
std::vector<Box> FortyBoxes() {
  std::vector<Box> boxes;
  for (std::int32_t z = 0; z < 80; z += 8) {
    for (std::int32_t y = 0; y < 64; y += 32) {
      for (std::int32_t x = 0; x < 72; x += 36) boxes.push_back({{x, y, z}, {x + 36, y + 32, z + 8}});
    }
  }
  return boxes;
}

void ExpectEqual(const Surface& a, const Surface& b) {
  ASSERT_EQ(a.bricks.size(), b.bricks.size());
  for (std::size_t i = 0; i < a.bricks.size(); ++i) {
    EXPECT_EQ(a.bricks[i].origin, b.bricks[i].origin);
    EXPECT_EQ(a.bricks[i].voxels, b.bricks[i].voxels);
    EXPECT_EQ(a.bricks[i].side_begin, b.bricks[i].side_begin);
  }
  ASSERT_EQ(a.sites.size(), b.sites.size());
  EXPECT_TRUE(std::equal(a.normals.begin(), a.normals.end(), b.normals.begin(), b.normals.end()));
  const auto faces = std::ptrdiff_t(a.normals.size());  // what follows is read ahead, and is no face
  EXPECT_TRUE(std::equal(a.sites.begin(), a.sites.begin() + faces, b.sites.begin()));
}

TEST(RecentBoxes, KeepsDisjointBoxesHoweverMany) {
  RecentBoxes<int> boxes;
  for (std::int32_t i = 0; i < 1000; ++i) KeepBox(boxes, {{i, 0, 0}, {i + 1, 1, 1}}, i, 1000);
  for (std::int32_t i = 0; i < 1000; ++i) {
    const int* kept = boxes.Find({{i, 0, 0}, {i + 1, 1, 1}});
    ASSERT_NE(kept, nullptr);
    EXPECT_EQ(*kept, i);
  }
}

TEST(RecentBoxes, DropsOfOverlappingBoxesTheLeastRecentlyUsed) {
  const auto box = [](std::int32_t end) { return Box{{0, 0, 0}, {end, 1, 1}}; };
  RecentBoxes<int> boxes;
  for (std::int32_t end = 97; end <= 100; ++end) KeepBox(boxes, box(end), end, 100);
  EXPECT_NE(boxes.Find(box(97)), nullptr);
  KeepBox(boxes, box(96), 96, 100);
  EXPECT_EQ(boxes.Find(box(98)), nullptr);
  for (std::int32_t end : {96, 97, 99, 100}) EXPECT_NE(boxes.Find(box(end)), nullptr) << end;
}

TEST(SurfaceCache, FindsNothingAnewForFortyBoxesInTurn) {
  const Volume volume = Blobs();
  const FrameSetup setup = SetupFor(volume, ZBuffer());
  const auto data = CutBox(volume, volume.block.box);
  auto& cache = data->CacheOf<SurfaceCache>();
  std::vector<const FaceSite*> sites;
  for (const Box& box : FortyBoxes()) sites.push_back(cache.Of(*data, setup, box).value()->sites.data());
  std::vector<const FaceSite*> again;
  for (const Box& box : FortyBoxes()) again.push_back(cache.Of(*data, setup, box).value()->sites.data());
  EXPECT_EQ(sites, again);
  EXPECT_EQ(std::set(sites.begin(), sites.end()).size(), sites.size()) << "memory of a dropped surface was used again";
}

TEST(SplatCache, FindsNothingAnewForFortyBoxesAlongThreeAxes) {
  const Volume volume = Blobs();
  FrameSetup setup = SetupFor(volume, Splatting());
  const auto data = CutBox(volume, volume.block.box);
  auto& cache = data->CacheOf<SplatCache>();
  std::vector<const OccupiedVoxels*> first, again;
  for (std::vector<const OccupiedVoxels*>* round : {&first, &again}) {
    for (const Axis axis : kAxes) {
      setup.camera.traversal_axis = axis;
      for (const Box& box : FortyBoxes()) round->push_back(&cache.Occupied(*data, setup, box));
    }
  }
  EXPECT_EQ(first, again);
  EXPECT_EQ(std::set(first.begin(), first.end()).size(), first.size()) << "memory of dropped cells was used again";
}

// A surface joined from what is known of other boxes has the bits of a fresh one, along every axis and at every place in a brick.
TEST(SurfaceCache, FollowsAMovingBorder) {
  const Volume volume = Blobs();
  const FrameSetup setup = SetupFor(volume, ZBuffer());
  const auto whole = CutBox(volume, volume.block.box);
  const std::size_t empty = whole->derived_bytes();
  const std::size_t of_whole = whole->CacheOf<SurfaceCache>().Of(*whole, setup, volume.block.box).value()->bytes();
  for (int axis = 0; axis < 3; ++axis) {
    const auto data = CutBox(volume, volume.block.box);
    for (std::int32_t step = 0; step < 50; ++step) {
      const std::int32_t border = step % 2 == 0 ? 12 + step : 61 - step;
      for (const bool lower : {true, false}) {
        Box box = volume.block.box;
        (lower ? box.end : box.begin)[axis] = border;
        const auto fresh = CutBox(volume, volume.block.box);
        ExpectEqual(*data->CacheOf<SurfaceCache>().Of(*data, setup, box).value(),
                    *fresh->CacheOf<SurfaceCache>().Of(*fresh, setup, box).value());
        EXPECT_LT(data->derived_bytes(), empty + 5 * of_whole) << step;
      }
    }
  }
}

// Other opaque voxels: nothing of what was found before is joined.
TEST(SurfaceCache, ForgetsSurfacesOfOtherVoxels) {
  const Volume volume = Blobs();
  FrameSetup setup = SetupFor(volume, ZBuffer());
  const auto data = CutBox(volume, volume.block.box);
  const std::size_t faces = data->CacheOf<SurfaceCache>().Of(*data, setup, volume.block.box).value()->normals.size();
  setup.transfer.opacities = {{150, 0, 0.5, 0}, {200, 1, 0.5, 0}};
  const auto fresh = CutBox(volume, volume.block.box);
  const Surface& surface = *data->CacheOf<SurfaceCache>().Of(*data, setup, volume.block.box).value();
  ExpectEqual(surface, *fresh->CacheOf<SurfaceCache>().Of(*fresh, setup, volume.block.box).value());
  EXPECT_NE(surface.normals.size(), faces);
}

}  // namespace
}  // namespace slabstream
