#include "common/frame/placed_shape.h"

#include <algorithm>
#include <cmath>

#include "common/math/row4.h"

namespace slabstream {
namespace {

// Physical, of a vertex with this radius in the world, if its shape has radii.
double RadiusAt(const PlacedShape& shape, const Camera& camera, double world_radius, const Vec3& physical) {
  const ShapeLook& look = shape.look;
  if (look.width == 0 && shape.view.info.has_radii) return world_radius * shape.physical_length;
  if (look.width > 0 && !look.width_in_pixels) return 0.5 * look.width;
  const double standard = shape.view.info.kind == ShapeKind::kLines ? kStandardLineWidth : kStandardPointWidth;
  const double depth = Apply(camera.depth_row, physical / camera.spacing);
  return 0.5 * (look.width > 0 ? look.width : standard) * camera.PixelSizeAt(std::max(depth, 1e-6 * camera.target_depth));
}

}  // namespace

PlacedShape MakePlacedShape(const Camera& camera, const ShapeSetup& setup, const ShapeView& view) {
  PlacedShape shape{.view = view, .look = setup.look};
  const ShapeLook& look = setup.look;
  shape.translucent = look.opacity < 1 || (look.coloring != ShapeColoring::kOne && view.see_through);
  for (std::size_t i = 0; i < 3; ++i) shape.to_physical[i] = camera.spacing * setup.to_data.steps[i];
  shape.offset = camera.spacing * setup.to_data.To(view.origin);
  const auto& [a, b, c] = shape.to_physical;
  const double determinant = Dot(a, Cross(b, c));
  shape.turn_normal = {Cross(b, c), Cross(c, a), Cross(a, b)};
  for (Vec3& column : shape.turn_normal) column = (1 / determinant) * column;
  shape.physical_length = std::cbrt(std::abs(determinant));
  return shape;
}

std::array<std::uint32_t, 2> PlacedShape::EndsOf(const ShapePiece& piece, std::uint32_t part) const {
  if (view.info.kind == ShapeKind::kPoints) return {piece.first_vertex + part, piece.first_vertex + part};
  const std::uint8_t* const local = view.corners.data() + 2 * (std::size_t{piece.first_part} + part);
  return {piece.first_vertex + local[0], piece.first_vertex + local[1]};
}

Capsule PlacedShape::CapsuleOf(const Camera& camera, const ShapePiece& piece, std::uint32_t part) const {
  const auto [first, last] = EndsOf(piece, part);
  const auto radius = [&](std::uint32_t vertex, const Vec3& at) {
    return RadiusAt(*this, camera, view.radii.empty() ? 0 : double(view.radii[vertex]), at);
  };
  const Vec3 a = ToPhysical(Position(first)), b = ToPhysical(Position(last));
  return {a, b, radius(first, a), radius(last, b)};
}

double PlacedShape::LargestRadius(const Camera& camera, const ShapePiece& piece) const {
  if (view.info.kind == ShapeKind::kMesh) return 0;
  // Balls are as large as those at the farthest corner may be.
  double radius = 0;
  for (int i = 0; i < 8; ++i) {
    const auto& [x, y, z] = std::array{(i & 1) != 0 ? piece.high[0] : piece.low[0], (i & 2) != 0 ? piece.high[1] : piece.low[1],
                                       (i & 4) != 0 ? piece.high[2] : piece.low[2]};
    radius = std::max(radius, RadiusAt(*this, camera, double(piece.radius), ToPhysical({double(x), double(y), double(z)})));
  }
  return radius;
}

}  // namespace slabstream
