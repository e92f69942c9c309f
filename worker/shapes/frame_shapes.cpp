#include "worker/shapes/frame_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "common/parallel/parallel.h"
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

class Shapes final : public FrameShapes {
 public:
  Shapes(ShapeScene scene, std::vector<std::shared_ptr<const VoxelBlock>> kept, const PixelBounds& frame)
      : scene_(std::move(scene)),
        kept_(std::move(kept)),
        frame_(frame),
        columns_((frame.width() + kShapeTile - 1) / kShapeTile),
        tiles_(std::size_t(columns_) * std::size_t((frame.height() + kShapeTile - 1) / kShapeTile)) {
    PlacePieces();
  }

  const ShapeTile& TileAt(std::int32_t x, std::int32_t y) const override {
    const std::int32_t column = x / kShapeTile, row = y / kShapeTile;
    Tile& tile = tiles_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
    std::call_once(tile.once, [&] {
      const PixelBounds pixels =
          Intersection(frame_, {column * kShapeTile, row * kShapeTile, (column + 1) * kShapeTile, (row + 1) * kShapeTile});
      tile.drawn = DrawShapeTile(scene_, pixels, tile.opaque, tile.translucent);
      bytes_ += tile.drawn.begin.capacity() * sizeof(std::uint32_t) + tile.drawn.fragments.capacity() * sizeof(ShapeFragment) +
                tile.drawn.ends.capacity() * sizeof(float);
    });
    return tile.drawn;
  }
  PixelBounds bounds() const override { return bounds_; }
  bool translucent() const override { return scene_.translucent; }
  std::size_t bytes() const override { return bytes_; }

 private:
  struct Tile {
    std::once_flag once;
    std::vector<PlacedPiece> opaque, translucent;
    ShapeTile drawn;
  };

  void PlacePieces() {
    for (const SceneShape& shape : scene_.shapes) {
      std::vector<Placed> placed(shape.view.pieces.size());
      ParallelForRanges(std::size_t{0}, placed.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) placed[i] = Place(scene_, shape, shape.view.pieces[i], frame_);
      });
      for (std::size_t i = 0; i < placed.size(); ++i) {
        const PixelBounds& at = placed[i].pixels;
        if (at.empty()) continue;
        bounds_ = Union(bounds_, at);
        for (std::int32_t row = at.y_begin / kShapeTile; row <= (at.y_end - 1) / kShapeTile; ++row) {
          for (std::int32_t column = at.x_begin / kShapeTile; column <= (at.x_end - 1) / kShapeTile; ++column) {
            Tile& tile = tiles_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
            const auto in_tile = [](std::int32_t pixel, std::int32_t number) {
              return std::uint8_t(std::clamp(pixel - number * kShapeTile, 0, kShapeTile));
            };
            (shape.translucent ? tile.translucent : tile.opaque)
                .push_back({shape.first_piece + std::uint32_t(i), placed[i].nearest, in_tile(at.x_begin, column), in_tile(at.y_begin, row),
                            in_tile(at.x_end, column), in_tile(at.y_end, row)});
          }
        }
      }
    }
    ParallelFor(std::size_t{0}, tiles_.size(), [&](std::size_t i) {
      std::ranges::sort(tiles_[i].opaque, {}, [](const PlacedPiece& piece) { return std::pair(piece.nearest, piece.number); });
    });
    std::size_t bytes = tiles_.size() * sizeof(Tile);
    for (const Tile& tile : tiles_) bytes += (tile.opaque.capacity() + tile.translucent.capacity()) * sizeof(PlacedPiece);
    bytes_ = bytes;
  }

  const ShapeScene scene_;
  const std::vector<std::shared_ptr<const VoxelBlock>> kept_;
  const PixelBounds frame_;
  const std::int32_t columns_;
  mutable std::vector<Tile> tiles_;
  PixelBounds bounds_;
  mutable std::atomic<std::size_t> bytes_ = 0;
};

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
                                                           std::shared_ptr<const FrameLight> light) {
  CHECK_EQ(bytes.size(), setup.shapes.size());
  ShapeScene scene{.map = MakeFrameMap(setup), .camera = setup.camera, .shading = setup.shading, .light = std::move(light)};
  scene.samples = setup.sheets.empty() && setup.camera.supersample > 1 ? 1 : 4;
  for (std::size_t axis = 0; axis < 3 && scene.light; ++axis) {
    scene.light_way = std::max(scene.light_way, kLightWay * setup.camera.spacing[int(axis)] / double(scene.light->scale[axis]));
  }
  std::uint64_t pieces = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const Result<ShapeView> view = ViewShape(bytes[i]->bytes);
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
      std::make_shared<Shapes>(std::move(scene), std::vector(bytes.begin(), bytes.end()), FrameBounds(setup)));
}

}  // namespace slabstream
