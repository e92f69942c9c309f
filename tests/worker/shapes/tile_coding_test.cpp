// Tiles on their way between workers.
#include "worker/shapes/tile_coding.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "tests/support/random.h"
#include "tests/worker/shapes/shape_pictures.h"
#include "worker/shapes/drawn_tiles.h"

namespace slabstream {
namespace {

using testing::EmptyFrame;
using testing::Scene;
using testing::SphereMesh;

// An opaque ball in a translucent one, which end in the last tiles of a frame that is no multiple of them.
Scene Balls() {
  Scene scene = {EmptyFrame({{100, 100, 100}}, {.projection = Projection::kPerspective}, {150, 90})};
  scene.Add(SphereMesh({50, 50, 50}, 30, 20));
  scene.Add(SphereMesh({50, 50, 50}, 48, 20), {.opacity = 0.4});
  return scene;
}

PooledVector<std::byte> Coded(const ShapeTile& tile, bool colors = true) {
  PooledVector<std::byte> bytes;
  AppendTile(tile, colors, bytes);
  EXPECT_EQ(bytes.size(), BytesOf(tile, colors));
  return bytes;
}

TEST(TileCoding, ATileComesBackAsItWas) {
  const Scene scene = Balls();
  const auto shapes = scene.Draw();
  const ShapeGrid grid(FrameBounds(scene.setup));
  std::size_t empty = 0;
  for (std::uint32_t number = 0; number < grid.count(); ++number) {
    const PixelBounds pixels = grid.PixelsOf(number);
    const ShapeTile& tile = shapes->TileAt(pixels.x_begin, pixels.y_begin);
    const ShapeTile read = ReadTile(Coded(tile), pixels).value();
    EXPECT_EQ(read.pixels, tile.pixels);
    EXPECT_EQ(read.fragments, tile.fragments);
    if (tile.fragments.empty()) {
      EXPECT_TRUE(read.empty());
      ++empty;
    } else {
      EXPECT_EQ(read.begin, tile.begin);
      EXPECT_EQ(read.ends, tile.ends);
    }
  }
  EXPECT_GT(grid.count(), empty) << "nothing was seen";
}

TEST(TileCoding, BoxesGetNoColorsOfOpaqueFragments) {
  const Scene scene = Balls();
  const auto shapes = scene.Draw();
  const ShapeTile& tile = shapes->TileAt(70, 40);
  const PooledVector<std::byte> bytes = Coded(tile, false);
  EXPECT_LT(bytes.size(), Coded(tile).size());
  const ShapeTile read = ReadTile(bytes, tile.pixels).value();
  EXPECT_FALSE(read.colors);
  EXPECT_EQ(read.begin, tile.begin);
  EXPECT_EQ(read.ends, tile.ends);
  for (std::size_t i = 0; i < tile.fragments.size(); ++i) {
    ShapeFragment expected = tile.fragments[i];
    if (expected.rgba[3] == 1) expected.rgba = {0, 0, 0, 1};
    ASSERT_EQ(read.fragments[i], expected);
  }
  for (std::size_t size = 1; size < bytes.size(); size += 97)
    EXPECT_FALSE(ReadTile(std::span(bytes).first(size), tile.pixels).ok()) << size;
}

TEST(TileCoding, OtherBytesAreDataLoss) {
  const Scene scene = Balls();
  const auto shapes = scene.Draw();
  const ShapeTile& tile = shapes->TileAt(70, 40);
  const PooledVector<std::byte> good = Coded(tile);
  const std::size_t pixels = tile.ends.size();
  for (std::size_t size = 1; size < good.size(); size += 97) EXPECT_FALSE(ReadTile(std::span(good).first(size), tile.pixels).ok()) << size;
  const auto damaged = [&](std::size_t fragment, std::size_t channel, float value) {
    PooledVector<std::byte> bytes = good;
    std::memcpy(&bytes[pixels + (5 * fragment + channel) * sizeof(float)], &value, sizeof value);
    return ReadTile(bytes, tile.pixels).status().code();
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(damaged(3, 0, 5), StatusCode::kOk);
  for (const float value : {kNan, kInfinity, -kInfinity}) {
    for (std::size_t channel = 0; channel < 5; ++channel) EXPECT_EQ(damaged(3, channel, value), StatusCode::kDataLoss) << channel;
  }
  for (const float alpha : {0.0F, -0.5F, 1.5F}) EXPECT_EQ(damaged(0, 4, alpha), StatusCode::kDataLoss) << alpha;
  std::size_t in_front = 0;  // the first of two
  while (in_front < tile.ends.size() && tile.begin[in_front + 1] - tile.begin[in_front] < 2) ++in_front;
  ASSERT_LT(in_front, tile.ends.size());
  EXPECT_EQ(damaged(tile.begin[in_front], 4, 1), StatusCode::kDataLoss) << "an opaque one in front";
  PooledVector<std::byte> too_many = good;
  too_many[0] = std::byte(kMostShapeFragments + 1);
  EXPECT_EQ(ReadTile(too_many, tile.pixels).status().code(), StatusCode::kDataLoss);
}

TEST(TileCoding, AnyBytesAreReadWithoutACrash) {
  Random random(9);
  SCOPED_TRACE(random.trace());
  const Scene scene = Balls();
  const auto shapes = scene.Draw();
  const ShapeTile& tile = shapes->TileAt(70, 40);
  for (int i = 0; i < 2000; ++i) {
    PooledVector<std::byte> bytes = Coded(tile, random.Chance(0.5));
    bytes.resize(random.Integer<std::size_t>(0, bytes.size()));
    for (int n = 0; n < 5 && !bytes.empty(); ++n)
      bytes[random.Integer<std::size_t>(0, bytes.size() - 1)] = std::byte(random.Integer(0, 255));
    (void)ReadTile(bytes, tile.pixels);
  }
}

// Those that others have drawn are taken as they are; the rest is drawn.
TEST(TileCoding, DrawnTilesAreTaken) {
  const Scene scene = Balls();
  const auto alone = scene.Draw();
  const auto tiles = std::make_shared<DrawnTiles>();
  tiles->Add(1, {});  // nothing shows there
  const auto shared = MakeFrameShapes(scene.setup, scene.bytes, nullptr, tiles).value();
  EXPECT_EQ(shared->TileAt(0, 0).fragments, alone->TileAt(0, 0).fragments);
  EXPECT_FALSE(alone->TileAt(64, 0).fragments.empty());
  EXPECT_TRUE(shared->TileAt(64, 0).fragments.empty());
}

}  // namespace
}  // namespace slabstream
