#include "worker/shapes/frame_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "common/parallel/parallel.h"
#include "worker/shapes/drawn_tiles.h"
#include "worker/shapes/shape_scene.h"

namespace slabstream {
namespace {

constexpr double kLightWay = 2.5;  // voxels of the light volume; shapes spread over about as many there (worker/light/shape_extinction.h)

Row4 Composed(const Row4& row, const AffineMap& map, const Vec3& origin) {
  const Vec3 linear = {row[0], row[1], row[2]};
  return {Dot(linear, map.steps[0]), Dot(linear, map.steps[1]), Dot(linear, map.steps[2]), Apply(row, map.To(origin))};
}

SceneShape PlaceShape(const ShapeScene& scene, const ShapeSetup& setup, const ShapeView& view) {
  SceneShape shape{MakePlacedShape(scene.camera, setup, view)};
  shape.x = Composed(scene.map.x, setup.to_data, view.origin);
  shape.y = Composed(scene.map.y, setup.to_data, view.origin);
  shape.w = Composed(scene.map.w, setup.to_data, view.origin);
  shape.depth = Composed(scene.map.depth, setup.to_data, view.origin);
  return shape;
}

// Where a piece may be seen.
struct Placed {
  PixelBounds pixels;  // cut to the frame; empty: nowhere
  float nearest = 0;   // key
};

Placed Place(const ShapeScene& scene, const SceneShape& shape, const ShapePiece& piece, const PixelBounds& frame) {
  const auto corner = [&](int i) {
    return Vec3{double((i & 1) != 0 ? piece.high[0] : piece.low[0]), double((i & 2) != 0 ? piece.high[1] : piece.low[1]),
                double((i & 4) != 0 ? piece.high[2] : piece.low[2])};
  };
  const double radius = shape.LargestRadius(scene.camera, piece);
  // What a ball of this radius adds to each row of the map.
  const auto reach = [&](const Row4& row) { return radius * Length(Vec3{row[0], row[1], row[2]} / scene.camera.spacing); };
  const double more_x = reach(scene.map.x), more_y = reach(scene.map.y), more_w = reach(scene.map.w), more_depth = reach(scene.map.depth);
  double x_begin = HUGE_VAL, x_end = -HUGE_VAL, y_begin = HUGE_VAL, y_end = -HUGE_VAL, nearest = HUGE_VAL, least = HUGE_VAL,
         most = -HUGE_VAL;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = corner(i);
    const double w = Apply(shape.w, p), x = Apply(shape.x, p), y = Apply(shape.y, p), w_low = w - more_w, w_high = w + more_w;
    least = std::min(least, w_low);
    most = std::max(most, w_high);
    nearest = std::min(nearest, Apply(shape.depth, p) - more_depth);
    const auto lowest = [&](double v) { return v / (v < 0 ? w_low : w_high); };
    const auto highest = [&](double v) { return v / (v < 0 ? w_high : w_low); };
    x_begin = std::min(x_begin, lowest(x - more_x));
    x_end = std::max(x_end, highest(x + more_x));
    y_begin = std::min(y_begin, lowest(y - more_y));
    y_end = std::max(y_end, highest(y + more_y));
  }
  if (!(most > scene.map.least_w)) return {};
  // It crosses the eye's plane, and may be seen anywhere.
  if (!(least > scene.map.least_w)) return {frame, -std::numeric_limits<float>::infinity()};
  constexpr double kMore = 1.0 / 64;  // pixels: vertices are rounded
  const auto pixel = [](double x, std::int32_t end) { return std::int32_t(x > 0 ? std::min(x, double(end)) : 0); };
  const PixelBounds pixels = {pixel(std::floor(x_begin - kMore), frame.x_end), pixel(std::floor(y_begin - kMore), frame.y_end),
                              pixel(std::ceil(x_end + kMore), frame.x_end), pixel(std::ceil(y_end + kMore), frame.y_end)};
  return {pixels, std::nextafter(float(scene.map.KeyOf(nearest)), -std::numeric_limits<float>::infinity())};
}

// Neighbouring pieces of a shape. They are placed when a tile that some of them may be seen in is drawn.
struct PieceGroup {
  static constexpr std::size_t kPieces = 16;

  PieceGroup(const SceneShape& of, std::size_t first_piece) : shape(of), first(first_piece) {}
  std::span<const ShapePiece> pieces() const {
    return shape.view.pieces.subspan(first, std::min(kPieces, shape.view.pieces.size() - first));
  }
  // What holds all of them.
  ShapePiece Whole() const {
    ShapePiece whole = pieces().front();
    for (const ShapePiece& piece : pieces()) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        whole.low[axis] = std::min(whole.low[axis], piece.low[axis]);
        whole.high[axis] = std::max(whole.high[axis], piece.high[axis]);
      }
      whole.radius = std::max(whole.radius, piece.radius);
    }
    return whole;
  }

  const SceneShape& shape;
  const std::size_t first;
  std::once_flag once;
  std::array<Placed, kPieces> placed;
};

class Shapes final : public FrameShapes {
 public:
  Shapes(ShapeScene scene, std::vector<std::shared_ptr<const VoxelBlock>> kept, const PixelBounds& frame, std::shared_ptr<DrawnTiles> drawn)
      : scene_(std::move(scene)), kept_(std::move(kept)), drawn_(std::move(drawn)), grid_(frame), tiles_(grid_.count()) {
    PlaceGroups();
  }

  const ShapeTile& TileAt(std::int32_t x, std::int32_t y) const override {
    const ShapeTile& for_boxes = TileForBoxes(x, y);
    if (for_boxes.colors) return for_boxes;
    const std::uint32_t number = grid_.NumberOf(x, y);
    Tile& tile = tiles_[number];
    std::call_once(tile.once_colored, [&] { tile.colored = Make(number, tile.groups, true); });
    return tile.colored;
  }
  const ShapeTile& TileForBoxes(std::int32_t x, std::int32_t y) const override {
    const std::uint32_t number = grid_.NumberOf(x, y);
    Tile& tile = tiles_[number];
    std::call_once(tile.once, [&] { tile.for_boxes = Make(number, tile.groups, false); });
    return tile.for_boxes;
  }
  PixelBounds bounds() const override { return bounds_; }
  bool translucent() const override { return scene_.translucent; }
  std::size_t bytes() const override { return bytes_; }

 private:
  struct Tile {
    std::once_flag once, once_colored;
    std::vector<std::uint32_t> groups;  // ascending
    ShapeTile for_boxes;
    ShapeTile colored;  // if that has no colours
  };

  void PlaceGroups() {
    for (const SceneShape& shape : scene_.shapes) {
      for (std::size_t first = 0; first < shape.view.pieces.size(); first += PieceGroup::kPieces) groups_.emplace_back(shape, first);
    }
    std::vector<PixelBounds> seen(groups_.size());
    ParallelForRanges(std::size_t{0}, groups_.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) seen[i] = Place(scene_, groups_[i].shape, groups_[i].Whole(), grid_.frame).pixels;
    });
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      if (seen[i].empty()) continue;
      bounds_ = Union(bounds_, seen[i]);
      grid_.ForEach(seen[i], [&](std::uint32_t number) { tiles_[number].groups.push_back(std::uint32_t(i)); });
    }
    std::size_t bytes = tiles_.size() * sizeof(Tile) + groups_.size() * sizeof(PieceGroup);
    for (const Tile& tile : tiles_) bytes += tile.groups.capacity() * sizeof(std::uint32_t);
    bytes_ = bytes;
  }

  ShapeTile Make(std::uint32_t number, const std::vector<std::uint32_t>& groups, bool colors) const {
    const PixelBounds pixels = grid_.PixelsOf(number);
    std::optional<ShapeTile> tile = drawn_ == nullptr ? std::nullopt : drawn_->Take(number, pixels);
    if (!tile || (colors && !tile->colors)) tile = Draw(pixels, groups);
    bytes_ += tile->begin.capacity() * sizeof(std::uint32_t) + tile->fragments.capacity() * sizeof(ShapeFragment) +
              tile->ends.capacity() * sizeof(float);
    return *std::move(tile);
  }

  ShapeTile Draw(const PixelBounds& pixels, const std::vector<std::uint32_t>& groups) const {
    std::vector<PlacedPiece> opaque, translucent;
    for (const std::uint32_t number : groups) {
      PieceGroup& group = groups_[number];
      const std::span<const ShapePiece> pieces = group.pieces();
      std::call_once(group.once, [&] {
        for (std::size_t i = 0; i < pieces.size(); ++i) group.placed[i] = Place(scene_, group.shape, pieces[i], grid_.frame);
      });
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const PixelBounds at = Intersection(group.placed[i].pixels, pixels);
        if (at.empty()) continue;
        (group.shape.translucent ? translucent : opaque)
            .push_back({group.shape.first_piece + std::uint32_t(group.first + i), group.placed[i].nearest,
                        std::uint8_t(at.x_begin - pixels.x_begin), std::uint8_t(at.y_begin - pixels.y_begin),
                        std::uint8_t(at.x_end - pixels.x_begin), std::uint8_t(at.y_end - pixels.y_begin)});
      }
    }
    std::ranges::sort(opaque, {}, [](const PlacedPiece& piece) { return std::pair(piece.nearest, piece.number); });
    return DrawShapeTile(scene_, pixels, opaque, translucent);
  }

  const ShapeScene scene_;
  const std::vector<std::shared_ptr<const VoxelBlock>> kept_;
  const std::shared_ptr<DrawnTiles> drawn_;
  const ShapeGrid grid_;
  mutable std::deque<PieceGroup> groups_;
  mutable std::vector<Tile> tiles_;
  PixelBounds bounds_;
  mutable std::atomic<std::size_t> bytes_ = 0;
};

// ViewShape, which reads all of the bytes, once as long as they live.
Result<ShapeView> ViewOnce(const std::shared_ptr<const VoxelBlock>& block) {
  struct Viewed {
    std::weak_ptr<const VoxelBlock> block;
    ShapeView view;
  };
  static std::mutex mutex;
  static std::vector<Viewed> viewed;
  const auto same = [&](const Viewed& each) { return !each.block.owner_before(block) && !block.owner_before(each.block); };
  {
    const std::lock_guard lock(mutex);
    std::erase_if(viewed, [](const Viewed& each) { return each.block.expired(); });
    const auto found = std::ranges::find_if(viewed, same);
    if (found != viewed.end()) return found->view;
  }
  Result<ShapeView> view = ViewShape(block->bytes);
  if (!view.ok()) return view;
  const std::lock_guard lock(mutex);
  if (std::ranges::none_of(viewed, same)) viewed.push_back({block, *view});
  return view;
}

}  // namespace

const SceneShape& ShapeScene::ShapeOf(std::uint32_t piece) const {
  return *std::prev(std::ranges::upper_bound(shapes, piece, {}, &SceneShape::first_piece));
}

ShapeScene::CapsuleHit ShapeScene::HitOn(const Capsule& capsule, double column, double row) const {
  const FrameMap::Ray ray = map.RayAt(column, row);
  const Vec3 origin = camera.spacing * ray.origin, direction = camera.spacing * ray.direction;
  const auto [depth, s] = capsule.FirstOn(origin, direction);
  if (!(depth < HUGE_VAL && map.Sees(depth))) return {};
  return {true, map.KeyOf(depth), s, capsule.NormalAt(origin + depth * direction, s)};
}

Result<std::shared_ptr<const FrameShapes>> MakeFrameShapes(const FrameSetup& setup,
                                                           std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                           std::shared_ptr<const FrameLight> light, std::shared_ptr<DrawnTiles> drawn) {
  CHECK_EQ(bytes.size(), setup.shapes.size());
  ShapeScene scene{.map = MakeFrameMap(setup), .camera = setup.camera, .shading = setup.shading, .light = std::move(light)};
  scene.samples = setup.sheets.empty() && setup.camera.supersample > 1 ? 1 : 4;
  for (std::size_t axis = 0; axis < 3 && scene.light; ++axis) {
    scene.light_way = std::max(scene.light_way, kLightWay * setup.camera.spacing[int(axis)] / double(scene.light->scale[axis]));
  }
  std::uint64_t pieces = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const Result<ShapeView> view = ViewOnce(bytes[i]);
    if (!view.ok()) return view.status();
    SceneShape& shape = scene.shapes.emplace_back(PlaceShape(scene, setup.shapes[i], *view));
    shape.first_piece = std::uint32_t(pieces);
    scene.translucent |= shape.translucent && !view->pieces.empty();
    pieces += view->pieces.size();
    if (pieces > kMostPieces) {
      return Status::ResourceExhausted(
          fmt::format("shapes: have {} pieces up to the one with number {}, must have at most {} in all", pieces, i, kMostPieces));
    }
  }
  return std::shared_ptr<const FrameShapes>(
      std::make_shared<Shapes>(std::move(scene), std::vector(bytes.begin(), bytes.end()), FrameBounds(setup), std::move(drawn)));
}

}  // namespace slabstream
