// Tiles of shapes between workers: what a worker sends, and what becomes of tiles that it gets.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/service/worker_and_peer.h"
#include "tests/worker/shapes/shape_pictures.h"
#include "worker/service/shared_shapes.h"
#include "worker/shapes/tile_coding.h"

namespace slabstream {
namespace {

using testing::Scene;
using testing::SphereMesh;

constexpr std::array<float, 4> kSentColor = {0.25, 0.5, 0.75, 1};

// A tile that is covered by a colour of its own, in front of everything.
ShapeTile Painted(const PixelBounds& pixels) {
  ShapeTile tile{.pixels = pixels, .begin = {0}};
  for (std::int64_t i = 0; i < pixels.pixel_count(); ++i) {
    tile.fragments.push_back({-1e6F, kSentColor});
    tile.begin.push_back(std::uint32_t(i + 1));
    tile.ends.push_back(-1e6F);
  }
  return tile;
}

struct Message {
  ShapeTiles header;
  PooledVector<std::byte> payload;

  void Add(std::uint32_t number, const ShapeTile& tile, bool colors = true) {
    header.tiles.push_back(number);
    header.bytes.push_back(std::uint32_t(BytesOf(tile, colors)));
    AppendTile(tile, colors, payload);
  }
};

Scene SceneOf(const FrameSetup& setup) {
  Scene scene = {setup};
  scene.Add(SphereMesh({4, 4, 16}, 14, 12));
  return scene;
}

// But for colours of opaque fragments.
bool SameForBoxes(const ShapeTile& a, const ShapeTile& b) {
  const auto same = [](const ShapeFragment& x, const ShapeFragment& y) {
    return x.depth == y.depth && x.rgba[3] == y.rgba[3] && (x.rgba[3] == 1 || x.rgba == y.rgba);
  };
  return a.begin == b.begin && a.ends == b.ends && std::ranges::equal(a.fragments, b.fragments, same);
}

class DrawnTilesTest : public WorkerAndPeer {
 protected:
  DrawnTilesTest() : WorkerAndPeer({}, "tcp://127.0.0.1:*") {}

  // One box, the worker's, and a shape: the worker draws all tiles for the peer, but the one in the middle, which the peer draws.
  GroupAssignment WithShape() {
    GroupAssignment assignment = Assignment(1, kWorker);
    assignment.key.attempt = assignment.group_count = 1;
    assignment.setup.sheets = {};
    SetRenderer(*FindRenderer("raycast"), assignment.setup);
    assignment.group.placements.resize(1);
    assignment.group.schedule = {"fan-in", 1, {0}};
    scene_ = SceneOf(assignment.setup);
    const auto& bytes = scene_->bytes[0]->bytes;
    ShapeSetup shape = scene_->setup.shapes[0];
    shape.bytes = {9, {.geometry = {{std::int32_t(bytes.size()), 1, 1}}, .type = ScalarType::kUint8}};
    assignment.setup.shapes = {shape};
    voxels_of_[9] = {bytes.begin(), bytes.end()};
    TileOrder order = {kWorker, kPeer, {}};
    for (std::uint32_t tile = 0; tile < grid().count(); ++tile) {
      if (tile != middle()) order.tiles.push_back(tile);
    }
    assignment.tiles = {order, {kPeer, kWorker, {middle()}}};
    return assignment;
  }
  ShapeGrid grid() const { return ShapeGrid(FrameBounds(scene_->setup)); }
  std::uint32_t middle() const { return grid().NumberOf(kSide / 2, kSide / 2); }
  // The pixels of the worker's picture.
  LocalImage AwaitPicture() {
    const auto frame = Await<FrameImage>();
    const Bytes runs = UnpackRuns(frame.picture.runs, payload_).value();
    return ReadRuns(frame.picture.runs.image, runs.span(), {0, 0, kSide, kSide}).value();
  }

  std::optional<Scene> scene_;
};

TEST_F(DrawnTilesTest, AWorkerSendsWhatItDraws) {
  SendControl(WithShape());
  const auto sent = Await<ShapeTiles>();
  EXPECT_EQ(sent.from_worker, kWorker);
  EXPECT_EQ(sent.tiles.size(), grid().count() - 1);
  const auto expected = scene_->Draw();
  std::size_t begin = 0, seen = 0;
  for (std::size_t i = 0; i < sent.tiles.size(); ++i) {
    const PixelBounds pixels = grid().PixelsOf(sent.tiles[i]);
    const ShapeTile tile = ReadTile(payload_.span().subspan(begin, sent.bytes[i]), pixels).value();
    EXPECT_TRUE(SameForBoxes(tile, expected->TileAt(pixels.x_begin, pixels.y_begin))) << "tile " << sent.tiles[i];
    begin += sent.bytes[i];
    seen += tile.fragments.size();
  }
  EXPECT_GT(seen, 100U);
}

TEST_F(DrawnTilesTest, AWorkerShowsWhatAnotherHasDrawn) {
  const GroupAssignment assignment = WithShape();
  SendControl(assignment);
  Message message = {{.epoch = kEpoch, .from_worker = kPeer, .key = assignment.key}};
  message.Add(middle(), Painted(grid().PixelsOf(middle())));
  SendToWorker(message.header, Bytes(std::move(message.payload)));
  const LocalImage picture = AwaitPicture();
  const PixelBounds& bounds = picture.bounds;
  const PixelBounds shown = Intersection(grid().PixelsOf(middle()), scene_->Draw()->bounds());
  ASSERT_FALSE(shown.empty());
  // What the boxes gathered lies over an opaque fragment: their rays have ended there.
  const LocalImage volume = Picture(1);
  for (std::int32_t y = shown.y_begin; y < shown.y_end; ++y) {
    for (std::int32_t x = shown.x_begin; x < shown.x_end; ++x) {
      const float* const over = &volume.rgba[4 * (std::size_t(y) * kSide + std::size_t(x))];
      const float* const at =
          &picture.rgba[4 * (std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()) + std::size_t(x - bounds.x_begin))];
      for (std::size_t c = 0; c < 4; ++c) ASSERT_NEAR(at[c], over[c] + (1 - over[3]) * kSentColor[c], 1e-6F) << x << ", " << y;
    }
  }
}

// ---- the shapes of a process

class SharedShapesTest : public ::testing::Test {
 protected:
  SharedShapesTest() : scene_(SceneOf(testing::EmptyFrame({{8, 8, 32}}, {}, {200, 130}))), grid_(FrameBounds(scene_.setup)) {}

  const ShapeTile& TileOf(std::uint32_t number) {
    const PixelBounds pixels = grid_.PixelsOf(number);
    return shared_.Make(scene_.bytes, nullptr).value()->TileAt(pixels.x_begin, pixels.y_begin);
  }
  // As if it had been drawn here.
  void ExpectDrawn(std::uint32_t number) {
    const PixelBounds pixels = grid_.PixelsOf(number);
    EXPECT_TRUE(TileOf(number).fragments == scene_.Draw()->TileAt(pixels.x_begin, pixels.y_begin).fragments) << "tile " << number;
  }
  void ExpectPainted(std::uint32_t number) {
    EXPECT_TRUE(TileOf(number).fragments == Painted(grid_.PixelsOf(number)).fragments) << "tile " << number;
  }

  const Scene scene_;
  const ShapeGrid grid_;
  SharedShapes shared_{scene_.setup};
};

TEST_F(SharedShapesTest, TilesOfOthersAreUsedOnce) {
  Message message;
  message.Add(1, Painted(grid_.PixelsOf(1)));
  message.Add(3, {.pixels = grid_.PixelsOf(3)});
  message.Add(5, Painted(grid_.PixelsOf(5)));
  const Bytes payload(std::move(message.payload));
  shared_.Add(message.header, payload);
  ExpectPainted(1);
  EXPECT_TRUE(TileOf(3).empty());
  ExpectPainted(5);
  ExpectDrawn(2);
  shared_.Add({.tiles = {2}, .bytes = {message.header.bytes[0]}}, payload.Part(0, message.header.bytes[0]));
  ExpectDrawn(2);  // it was there already
}

// As after an attempt that another worker displayed.
TEST_F(SharedShapesTest, APictureHasTheColorsThatBoxesDidNotNeed) {
  Message message, later;
  for (const std::uint32_t tile : {1, 2}) message.Add(tile, Painted(grid_.PixelsOf(tile)), false);
  shared_.Add(message.header, Bytes(std::move(message.payload)));
  const auto shapes = shared_.Make(scene_.bytes, nullptr).value();
  const auto ends = [](const ShapeTile& tile) { return std::pair(tile.colors, tile.ends); };
  for (const std::uint32_t tile : {1, 2}) {
    const PixelBounds pixels = grid_.PixelsOf(tile);
    EXPECT_TRUE(ends(shapes->TileForBoxes(pixels.x_begin, pixels.y_begin)) == std::pair(false, Painted(pixels).ends));
  }
  ExpectDrawn(1);
  later.Add(2, Painted(grid_.PixelsOf(2)));
  shared_.Add(later.header, Bytes(std::move(later.payload)));
  ExpectPainted(2);
}

TEST_F(SharedShapesTest, WhatCannotBeReadIsDrawn) {
  Message message;
  for (const std::uint32_t tile : {1, 2, 3}) message.Add(tile, Painted(grid_.PixelsOf(tile)));
  message.payload[message.header.bytes[0]] = std::byte(200);  // fragments of a pixel of the second tile
  shared_.Add(message.header, Bytes(std::move(message.payload)));
  ExpectPainted(1);
  ExpectDrawn(2);
  ExpectPainted(3);
}

TEST_F(SharedShapesTest, FramesOfEqualSetupsShareThem) {
  auto first = SharedShapes::Of(scene_.setup);
  FrameSetup other = scene_.setup;
  other.camera.width += 1;
  EXPECT_NE(SharedShapes::Of(other), first);
  EXPECT_EQ(SharedShapes::Of(scene_.setup), first);
  const std::weak_ptr<SharedShapes> held = first;
  first.reset();
  EXPECT_TRUE(held.expired()) << "nobody holds it";
}

}  // namespace
}  // namespace slabstream
