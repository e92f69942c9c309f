// Shape: a mesh, lines or points that a picture shows beside its volume, as files and clients describe it.
//
// Coordinates are those of a world (common/volume/orientation.h): of a patient, mm to the right, to anterior and to superior (RAS). A shape
// lies beside every volume of the same world.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/math/row4.h"
#include "common/math/vec.h"

namespace slabstream {

enum class ShapeKind : std::uint8_t { kMesh = 1, kLines = 2, kPoints = 3 };
constexpr std::string_view NameOf(ShapeKind kind) {
  return kind == ShapeKind::kMesh ? "mesh" : kind == ShapeKind::kLines ? "lines" : "points";
}

// What a shape consists of.
constexpr std::string_view PartsOf(ShapeKind kind) {
  return kind == ShapeKind::kMesh ? "triangles" : kind == ShapeKind::kLines ? "pieces of lines" : "points";
}

inline constexpr std::uint32_t kMaxShapeVertices = 1U << 30;
inline constexpr std::uint32_t kMaxShapeParts = 1U << 30;  // triangles, or pieces of lines

// Values of a mesh that is a plane, by place and not by vertex: samples on a grid, which are interpolated bilinearly. Beyond the outermost
// ones the nearest sample counts.
struct PlaneValues {
  std::uint32_t columns = 0, rows = 0;  // 0, 0: there are none
  Row4 column{}, row{};                 // of a position (Apply); those of the first sample are 0
  std::vector<float> samples;           // row by row; NaN: none

  friend bool operator==(const PlaneValues&, const PlaneValues&) = default;
};
inline constexpr std::uint32_t kMaxPlaneSide = 1U << 12;  // samples

// Arrays by vertex have one element for each vertex, or none.
struct Shape {
  ShapeKind kind = ShapeKind::kMesh;
  std::vector<std::array<float, 3>> positions;          // from `origin`; finite
  Vec3 origin;                                          // so that positions keep their digits far away
  std::vector<std::array<float, 3>> normals;            // by vertex of a mesh, unit or 0; none: they are those of the triangles around it
  std::vector<std::array<std::uint8_t, 4>> colors;      // by vertex: straight RGBA, 255 is 1
  std::vector<float> values;                            // by vertex: a scalar that a colour map shows; NaN: none
  std::vector<float> radii;                             // by vertex of lines and points, in the world's unit, at least 0
  std::vector<std::array<std::uint32_t, 3>> triangles;  // of a mesh: numbers of vertices
  PlaneValues plane;                                    // of a mesh, instead of `values`
  std::vector<std::uint32_t> line_begins;               // of lines, and one more: line i has the vertices [i] ... [i + 1] - 1, at least 2

  friend bool operator==(const Shape&, const Shape&) = default;
};

}  // namespace slabstream
