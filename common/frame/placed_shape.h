// PlacedShape: a packed shape in the physical space of a frame's camera (common/view/camera.h). Lines are tubes with round ends and joints,
// and points are balls; they are round there. A width in pixels becomes a radius by the camera, at the depth of each vertex.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/frame/frame_setup.h"
#include "common/shapes/capsule.h"
#include "common/shapes/packed_shape.h"

namespace slabstream {

struct PlacedShape {
  ShapeView view;
  ShapeLook look;
  bool translucent = false;         // some of it may be
  std::array<Vec3, 3> to_physical;  // of positions: offset + p.x * to_physical[0] + ...
  Vec3 offset;
  // n.x * turn_normal[0] + ...: in physical space, not of unit length. As rows they are the inverse of to_physical.
  std::array<Vec3, 3> turn_normal;
  double physical_length = 1;  // of the world's unit

  Vec3 Position(std::size_t vertex) const {
    return {double(view.positions[0][vertex]), double(view.positions[1][vertex]), double(view.positions[2][vertex])};
  }
  Vec3 ToPhysical(const Vec3& p) const { return offset + p.x * to_physical[0] + p.y * to_physical[1] + p.z * to_physical[2]; }
  // The difference of two positions, of their physical one.
  Vec3 FromPhysical(const Vec3& v) const { return {Dot(turn_normal[0], v), Dot(turn_normal[1], v), Dot(turn_normal[2], v)}; }

  // The vertices at the ends of a piece of a line; a point's twice.
  std::array<std::uint32_t, 2> EndsOf(const ShapePiece& piece, std::uint32_t part) const;
  // A piece of a line, or a point, in physical space.
  Capsule CapsuleOf(const Camera& camera, const ShapePiece& piece, std::uint32_t part) const;
  // Physical: at least that of all its capsules; 0: of a mesh.
  double LargestRadius(const Camera& camera, const ShapePiece& piece) const;
};

PlacedShape MakePlacedShape(const Camera& camera, const ShapeSetup& setup, const ShapeView& view);

}  // namespace slabstream
