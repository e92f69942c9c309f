// PackedShape: a shape as workers get it and draw from it: one block of bytes, in which neighbours lie together in pieces with bounds, so
// that what a tile of the picture does not see is left out piece by piece.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/status.h"
#include "common/math/row4.h"
#include "common/memory/aligned_buffer.h"
#include "common/shapes/shape.h"

namespace slabstream {

// What is known of a shape without its vertices.
struct ShapeInfo {
  ShapeKind kind = ShapeKind::kMesh;
  std::uint64_t vertices = 0, parts = 0;  // parts: triangles, pieces of lines, or points
  Vec3 low, high;                         // the world: all vertices lie between, with their radii; 0, 0: there is none
  bool has_colors = false, has_values = false, has_radii = false;
  float least = 0, largest = 0;  // of finite values; 0, 0: there is none
  friend bool operator==(const ShapeInfo&, const ShapeInfo&) = default;
};

// Neighbouring parts, and the vertices that they have.
inline constexpr std::uint32_t kMostOfPiece = 256;  // parts, and vertices
struct ShapePiece {
  std::array<float, 3> low{}, high{};              // its vertices lie between, from the origin, without their radii
  float radius = 0;                                // the largest of its vertices
  std::uint32_t first_vertex = 0, first_part = 0;  // in the arrays of ShapeView
  std::uint16_t vertices = 0, parts = 0;           // [1, kMostOfPiece]
};

// A packed shape, read in place. A vertex on the border of pieces is in the arrays once for each of them.
struct ShapeView {
  ShapeInfo info;
  Vec3 origin;
  bool see_through = false;  // some vertex has a colour with an alpha below 255, or the plane has samples that are none
  std::span<const ShapePiece> pieces;
  std::array<std::span<const float>, 3> positions;      // x, y, z from the origin; 16 more can be read behind each
  std::span<const std::uint32_t> normals;               // of a mesh: PackShapeNormal
  std::span<const std::array<std::uint8_t, 4>> colors;  // empty: it has none; so are the two below
  std::span<const float> values, radii;
  struct Plane {  // PlaneValues; 0, 0: it has none
    std::int32_t columns = 0, rows = 0;
    Row4 column{}, row{};
    std::span<const float> samples;  // more can be read behind them
  } plane;
  std::span<const std::uint8_t> corners;  // of each part: CornersOf(kind) numbers of vertices, counted from the piece's first one
};

// Vertices of a triangle, or of a piece of a line. Points are the vertices themselves, and have no corners.
constexpr std::size_t CornersOf(ShapeKind kind) { return kind == ShapeKind::kMesh ? 3 : kind == ShapeKind::kLines ? 2 : 0; }

// A direction in 32 bits, to 7e-5 (Meyer et al., "On Floating-Point Normal Vectors", 2010: the octahedron). A normal of 0 stays 0.
std::uint32_t PackShapeNormal(const Vec3& normal);
Vec3 ShapeNormalOf(std::uint32_t packed);  // unit, or 0

// Bytes that ViewShape reads, the same for the same shape on every machine, and for any order of its triangles. InvalidArgument: a number
// of a vertex that is not there, a position that is not finite, arrays of other lengths than that of positions, too many vertices or parts
// (kMaxShapeVertices, kMaxShapeParts), planes of other sizes than their samples; the message names the field, the value and the limit.
// Triangles without an area are left out. Uses the threads of the caller's task arena.
Result<AlignedVector<std::byte>> PackShape(const Shape& shape);
// Of bytes that PackShape made, perhaps with others behind them. DataLoss: they are not.
Result<ShapeInfo> InfoOf(std::span<const std::byte> bytes);

// `bytes` begin at a multiple of 8, stay as long as the view, and may be followed by others. DataLoss: sizes that do not fit, or a corner
// that its piece does not have. Positions may be any floats.
Result<ShapeView> ViewShape(std::span<const std::byte> bytes);

}  // namespace slabstream
