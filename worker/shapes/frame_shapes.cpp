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

SceneShape PlaceShape(const FrameMap& map, const ShapeSetup& setup, const ShapeView& view, const Vec3& spacing) {
  SceneShape shape{.view = view, .look = setup.look};
  const ShapeLook& look = setup.look;
  shape.translucent = look.opacity < 1 || (look.coloring == ShapeColoring::kVertices && view.see_through);
  shape.x = Composed(map.x, setup.to_data, view.origin);
  shape.y = Composed(map.y, setup.to_data, view.origin);
  shape.w = Composed(map.w, setup.to_data, view.origin);
  shape.depth = Composed(map.depth, setup.to_data, view.origin);
  for (std::size_t i = 0; i < 3; ++i) shape.to_physical[i] = spacing * setup.to_data.steps[i];
  shape.offset = spacing * setup.to_data.To(view.origin);
  const auto& [a, b, c] = shape.to_physical;
  const double determinant = Dot(a, Cross(b, c));
  shape.turn_normal = {Cross(b, c), Cross(c, a), Cross(a, b)};
  for (Vec3& column : shape.turn_normal) column = (1 / determinant) * column;
  shape.physical_length = std::cbrt(std::abs(determinant));
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
  // Balls round lines and points are as large as those at the farthest corner may be.
  double radius = 0;
  if (shape.view.info.kind != ShapeKind::kMesh) {
    for (int i = 0; i < 8; ++i) radius = std::max(radius, scene.RadiusAt(shape, double(piece.radius), shape.ToPhysical(corner(i))));
  }
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

double ShapeScene::RadiusAt(const SceneShape& shape, double world_radius, const Vec3& physical) const {
  const ShapeLook& look = shape.look;
  if (look.width == 0 && shape.view.info.has_radii) return world_radius * shape.physical_length;
  if (look.width > 0 && !look.width_in_pixels) return 0.5 * look.width;
  const double standard = shape.view.info.kind == ShapeKind::kLines ? kStandardLineWidth : kStandardPointWidth;
  const double depth = Apply(camera.depth_row, physical / camera.spacing);
  return 0.5 * (look.width > 0 ? look.width : standard) * camera.PixelSizeAt(std::max(depth, 1e-6 * camera.target_depth));
}

std::array<std::uint32_t, 2> EndsOf(const ShapeView& view, const ShapePiece& piece, std::uint32_t part) {
  if (view.info.kind == ShapeKind::kPoints) return {piece.first_vertex + part, piece.first_vertex + part};
  const std::uint8_t* const local = view.corners.data() + 2 * (std::size_t{piece.first_part} + part);
  return {piece.first_vertex + local[0], piece.first_vertex + local[1]};
}

Capsule ShapeScene::CapsuleOf(const SceneShape& shape, const ShapePiece& piece, std::uint32_t part) const {
  const auto [first, last] = EndsOf(shape.view, piece, part);
  const auto radius = [&](std::uint32_t vertex, const Vec3& at) {
    return RadiusAt(shape, shape.view.radii.empty() ? 0 : double(shape.view.radii[vertex]), at);
  };
  const Vec3 a = shape.ToPhysical(shape.Position(first)), b = shape.ToPhysical(shape.Position(last));
  return {a, b, radius(first, a), radius(last, b)};
}

ShapeScene::CapsuleHit ShapeScene::HitOn(const Capsule& capsule, double column, double row) const {
  const FrameMap::Ray ray = map.RayAt(column, row);
  const Vec3 origin = camera.spacing * ray.origin, direction = camera.spacing * ray.direction;
  const auto [depth, s] = capsule.FirstOn(origin, direction);
  if (!(depth < HUGE_VAL && map.w_per_depth * depth + map.w_0 > map.least_w)) return {};
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
    SceneShape& shape = scene.shapes.emplace_back(PlaceShape(scene.map, setup.shapes[i], *view, setup.camera.spacing));
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
