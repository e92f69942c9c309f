// A tile is drawn in three steps: opaque pieces into the nearest key and element of each sample; translucent ones into a list of hits; both
// into fragments (resolve_tile.cpp).
//
// Whether a triangle covers a sample depends on its edge functions (Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988) in
// homogeneous coordinates (Olano and Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997), so triangles need not be
// clipped. Vertices are rounded to 1/256 pixel, the same in all triangles and tiles. An edge function of two triangles has the same value
// but for its sign in both, bit by bit; where it is 0, the sample belongs to the triangle below the edge, or to its right.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "worker/shapes/draw_cells.h"
#include "worker/shapes/draw_mesh.h"
#include "worker/shapes/key_plane.h"
#include "worker/shapes/resolve_tile.h"
#include "worker/shapes/shape_scene.h"
#include "worker/shapes/tile_samples.h"

namespace slabstream {
namespace {

class TileDrawing {
 public:
  TileDrawing(const ShapeScene& scene, const PixelBounds& pixels) : scene_(scene), pixels_(pixels), samples_(pixels, scene.samples) {}

  ShapeTile Draw(std::span<const PlacedPiece> opaque, std::span<const PlacedPiece> translucent) {
    for (const PlacedPiece& piece : opaque) {
      if (samples_.Hides(piece.area(), piece.nearest)) continue;
      DrawPiece(piece.number, false);
      samples_.Changed(piece.area());
    }
    for (const PlacedPiece& piece : translucent) {
      if (samples_.Hides(piece.area(), piece.nearest)) continue;
      DrawPiece(piece.number, true);
      if (hits_.size() > kMostHits) KeepNearest(hits_);
    }
    if (!hits_.empty()) KeepNearest(hits_);
    return ResolveTile(scene_, samples_, hits_);
  }

 private:
  // Of a tile, before the farthest ones are left out: memory for 16 bytes each.
  static constexpr std::size_t kMostHits = 2 * std::size_t{kShapeTile} * kShapeTile * kMostShapeHits;

  void DrawPiece(std::uint32_t number, bool translucent) {
    const SceneShape& shape = scene_.ShapeOf(number);
    const ShapePiece& piece = shape.view.pieces[number - shape.first_piece];
    if (shape.view.info.kind != ShapeKind::kMesh) {
      for (std::uint32_t part = 0; part < piece.parts; ++part) {
        const Capsule capsule = shape.CapsuleOf(scene_.camera, piece, part);
        const PixelBounds range = RangeOf(capsule);
        if (!range.empty()) DrawCapsule({scene_, samples_, translucent ? &hits_ : nullptr}, range, capsule, number << 8 | part);
      }
      return;
    }
    PartList large;
    DrawMeshPiece(scene_, shape, number, samples_, translucent ? &hits_ : nullptr, large);
    for (std::uint32_t i = 0; i < large.count; ++i) {
      std::array<Corner, 3> corners;
      const std::uint8_t* const local = shape.view.corners.data() + 3 * (std::size_t{piece.first_part} + large.part[i]);
      for (std::size_t c = 0; c < 3; ++c) {
        corners[c] = CornerOf(scene_, shape, std::size_t{piece.first_vertex} + local[c], pixels_.x_begin, pixels_.y_begin);
      }
      DrawTriangle(corners[0], corners[1], corners[2], number << 8 | large.part[i], translucent);
    }
  }

  void DrawTriangle(const Corner& a, const Corner& b, const Corner& c, Element element, bool translucent) {
    if (!a.in_front && !b.in_front && !c.in_front) return;
    const auto edge = [](const Corner& from, const Corner& to) {
      return Through(from.edge_x, from.edge_y, from.w, to.edge_x, to.edge_y, to.w);
    };
    std::array<Line3, 3> edges = {edge(b, c), edge(c, a), edge(a, b)};
    const double determinant = a.edge_x * edges[0].x + a.edge_y * edges[0].y + a.w * edges[0].c;
    if (!(std::abs(determinant) > 0)) return;
    for (Line3& e : edges) {
      if (determinant < 0) e = {-e.x, -e.y, -e.c};
    }
    PixelBounds range = {0, 0, pixels_.width(), pixels_.height()};
    if (a.in_front && b.in_front && c.in_front) {
      const auto cut = [](double steps, std::int32_t most) {
        return std::int32_t(std::clamp(std::floor(steps / kSteps), 0.0, double(most)));
      };
      range = {cut(std::min({a.edge_x, b.edge_x, c.edge_x}), range.x_end), cut(std::min({a.edge_y, b.edge_y, c.edge_y}), range.y_end),
               cut(std::max({a.edge_x, b.edge_x, c.edge_x}) + kSteps, range.x_end),
               cut(std::max({a.edge_y, b.edge_y, c.edge_y}) + kSteps, range.y_end)};
    }
    if (range.empty()) return;
    DrawLargeTriangle({scene_, samples_, translucent ? &hits_ : nullptr}, range, edges, PlaneOf(scene_, a, b, c), element);
  }

  // Pixels that a capsule can lie in: the balls at its ends are in the cubes round them.
  PixelBounds RangeOf(const Capsule& capsule) const {
    const FrameMap& map = scene_.map;
    const PixelBounds range = {0, 0, pixels_.width(), pixels_.height()};
    double x_begin = HUGE_VAL, x_end = -HUGE_VAL, y_begin = HUGE_VAL, y_end = -HUGE_VAL;
    for (int i = 0; i < 16; ++i) {
      const double radius = i < 8 ? capsule.radius_a : capsule.radius_b;
      const Vec3 corner = Vec3{(i & 1) != 0 ? radius : -radius, (i & 2) != 0 ? radius : -radius, (i & 4) != 0 ? radius : -radius};
      const Vec3 p = ((i < 8 ? capsule.a : capsule.b) + corner) / scene_.camera.spacing;
      const double w = Apply(map.w, p);
      if (!(w > map.least_w)) return range;
      const double x = Apply(map.x, p) / w, y = Apply(map.y, p) / w;
      x_begin = std::min(x_begin, x);
      x_end = std::max(x_end, x);
      y_begin = std::min(y_begin, y);
      y_end = std::max(y_end, y);
    }
    const auto cut = [](double at, std::int32_t most) { return std::int32_t(std::clamp(at, 0.0, double(most))); };
    return {cut(std::floor(x_begin - pixels_.x_begin), range.x_end), cut(std::floor(y_begin - pixels_.y_begin), range.y_end),
            cut(std::ceil(x_end - pixels_.x_begin), range.x_end), cut(std::ceil(y_end - pixels_.y_begin), range.y_end)};
  }

  const ShapeScene& scene_;
  const PixelBounds pixels_;
  TileSamples samples_;
  std::vector<ShapeHit> hits_;
};

}  // namespace

ShapeTile DrawShapeTile(const ShapeScene& scene, const PixelBounds& pixels, std::span<const PlacedPiece> opaque,
                        std::span<const PlacedPiece> translucent) {
  if (opaque.empty() && translucent.empty()) return {.pixels = pixels};
  return TileDrawing(scene, pixels).Draw(opaque, translucent);
}

}  // namespace slabstream
