// The bytes of a packed shape: this header, then pieces, x, y, z, normals, colours, values, radii, corners and samples of a plane, as far
// as the shape has them. Each array begins at a multiple of kArrayStep bytes, and at least as many are behind its last element.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "common/shapes/packed_shape.h"

namespace slabstream {

static_assert(std::endian::native == std::endian::little, "shapes are little endian and are read as they are");
static_assert(sizeof(ShapePiece) == 40 && std::is_trivially_copyable_v<ShapePiece>);

struct ShapeHeader {
  std::uint64_t mark = kMark;
  std::uint32_t kind = 0, has_colors = 0, has_values = 0, has_radii = 0, see_through = 0, piece_count = 0;
  std::uint64_t vertices = 0, parts = 0;  // as ShapeInfo
  std::uint64_t vertex_count = 0;         // in the arrays
  std::array<double, 3> low{}, high{}, origin{};
  float least = 0, largest = 0;
  std::uint32_t plane_columns = 0, plane_rows = 0;
  Row4 plane_column{}, plane_row{};

  static constexpr std::uint64_t kMark = 0x3265706168736c73;  // "slshape2"
};
static_assert(sizeof(ShapeHeader) == 208);

inline constexpr std::size_t kArrayStep = 64;

// Where the arrays begin, and how many bytes there are in all. No sum overflows: the counts are below 2^32.
struct ShapeLayout {
  explicit ShapeLayout(const ShapeHeader& header) {
    const auto take = [this](std::uint64_t count, std::size_t bytes) {
      const std::uint64_t begin = end;
      if (count > 0) end += (count * bytes + kArrayStep) / kArrayStep * kArrayStep + kArrayStep;
      return begin;
    };
    const std::uint64_t n = header.vertex_count;
    pieces = take(header.piece_count, sizeof(ShapePiece));
    for (std::uint64_t& axis : positions) axis = take(n, 4);
    normals = take(header.kind == std::uint32_t(ShapeKind::kMesh) ? n : 0, 4);
    colors = take(header.has_colors * n, 4);
    values = take(header.has_values * n, 4);
    radii = take(header.has_radii * n, 4);
    corners = take(header.parts * CornersOf(ShapeKind(header.kind)), 1);
    plane = take(std::uint64_t{header.plane_columns} * header.plane_rows, 4);
  }
  std::uint64_t end = (sizeof(ShapeHeader) + kArrayStep - 1) / kArrayStep * kArrayStep;
  std::uint64_t pieces, positions[3], normals, colors, values, radii, corners, plane;
};

}  // namespace slabstream
