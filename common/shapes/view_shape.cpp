#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "common/parallel/parallel.h"
#include "common/shapes/shape_bytes.h"

namespace slabstream {

std::uint32_t PackShapeNormal(const Vec3& normal) {
  const double sum = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
  if (!(sum > 0 && sum < HUGE_VAL)) return 0x80008000;
  double u = normal.x / sum, v = normal.y / sum;
  if (normal.z < 0) {
    const double folded = (1 - std::abs(v)) * (u < 0 ? -1 : 1);
    v = (1 - std::abs(u)) * (v < 0 ? -1 : 1);
    u = folded;
  }
  const auto bits = [](double x) { return std::uint32_t(std::uint16_t(std::int16_t(std::floor(x * 32767 + 0.5)))); };
  return bits(u) | bits(v) << 16;
}

Vec3 ShapeNormalOf(std::uint32_t packed) {
  if (packed == 0x80008000) return {};
  const auto number = [](std::uint32_t bits) { return double(std::int16_t(std::uint16_t(bits))) / 32767; };
  const double u = number(packed & 0xFFFF), v = number(packed >> 16), z = 1 - std::abs(u) - std::abs(v);
  const double below = std::max(-z, 0.0);
  return Normalized({u < 0 ? u + below : u - below, v < 0 ? v + below : v - below, z});
}

Result<ShapeView> ViewShape(std::span<const std::byte> bytes) {
  ShapeHeader header;
  if (bytes.size() < sizeof header) {
    return Status::DataLoss(fmt::format("shape: has {} bytes, must have at least {}", bytes.size(), sizeof header));
  }
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.mark != ShapeHeader::kMark) return Status::DataLoss("shape: the bytes are not those of a packed shape");
  if (header.kind < 1 || header.kind > 3) return Status::DataLoss(fmt::format("shape: kind is {}, must be 1, 2 or 3", header.kind));
  if (std::max({header.has_colors, header.has_values, header.has_radii, header.see_through}) > 1) {
    return Status::DataLoss("shape: a flag is neither 0 nor 1");
  }
  const auto kind = ShapeKind(header.kind);
  if (header.parts > kMaxShapeParts || header.vertex_count > 3 * std::uint64_t{kMaxShapeParts}) {
    return Status::DataLoss(fmt::format("shape: has {} parts and {} vertices, must have at most {} and {}", header.parts,
                                        header.vertex_count, kMaxShapeParts, 3 * std::uint64_t{kMaxShapeParts}));
  }
  if (std::max(header.plane_columns, header.plane_rows) > kMaxPlaneSide) {
    return Status::DataLoss(fmt::format("shape: its plane has {} x {} samples, must have at most {} a side", header.plane_columns,
                                        header.plane_rows, kMaxPlaneSide));
  }
  const ShapeLayout layout(header);
  if (bytes.size() < layout.end) {
    return Status::DataLoss(fmt::format("shape: has {} bytes, must have at least {} for {} parts, {} vertices and {} pieces", bytes.size(),
                                        layout.end, header.parts, header.vertex_count, header.piece_count));
  }

  ShapeView view;
  view.info = {kind,
               header.vertices,
               header.parts,
               {header.low[0], header.low[1], header.low[2]},
               {header.high[0], header.high[1], header.high[2]},
               header.has_colors == 1,
               header.has_values == 1 || header.plane_columns * header.plane_rows > 0,
               header.has_radii == 1,
               header.least,
               header.largest};
  view.origin = {header.origin[0], header.origin[1], header.origin[2]};
  view.see_through = header.see_through == 1;
  const auto array = [&]<class T>(std::span<const T>& to, std::uint64_t begin, std::uint64_t count) {
    if (count > 0) to = {reinterpret_cast<const T*>(bytes.data() + begin), std::size_t(count)};
  };
  const std::uint64_t n = header.vertex_count;
  array(view.pieces, layout.pieces, header.piece_count);
  for (std::size_t axis = 0; axis < 3; ++axis) array(view.positions[axis], layout.positions[axis], n);
  array(view.normals, layout.normals, kind == ShapeKind::kMesh ? n : 0);
  array(view.colors, layout.colors, header.has_colors * n);
  array(view.values, layout.values, header.has_values * n);
  array(view.radii, layout.radii, header.has_radii * n);
  array(view.corners, layout.corners, header.parts * CornersOf(kind));
  const std::uint64_t samples = std::uint64_t{header.plane_columns} * header.plane_rows;
  array(view.plane.samples, layout.plane, samples);
  if (samples > 0) {
    view.plane.columns = std::int32_t(header.plane_columns);
    view.plane.rows = std::int32_t(header.plane_rows);
    view.plane.column = header.plane_column;
    view.plane.row = header.plane_row;
  }

  std::uint64_t vertices = 0, parts = 0;
  for (std::size_t i = 0; i < view.pieces.size(); ++i) {
    const ShapePiece& piece = view.pieces[i];
    if (piece.first_vertex != vertices || piece.first_part != parts || std::min(piece.vertices, piece.parts) < 1 ||
        std::max(piece.vertices, piece.parts) > kMostOfPiece || (kind == ShapeKind::kPoints && piece.vertices != piece.parts)) {
      return Status::DataLoss(fmt::format("shape: piece {} has {} vertices from {} and {} parts from {}, must have 1 to {} from {} and {}",
                                          i, piece.vertices, piece.first_vertex, piece.parts, piece.first_part, kMostOfPiece, vertices,
                                          parts));
    }
    vertices += piece.vertices;
    parts += piece.parts;
  }
  if (vertices != n || parts != header.parts) {
    return Status::DataLoss(
        fmt::format("shape: its pieces have {} vertices and {} parts, must have {} and {}", vertices, parts, n, header.parts));
  }
  std::atomic<bool> fits = true;
  const std::size_t corners = CornersOf(kind);
  ParallelForRanges(std::size_t{0}, corners == 0 ? 0 : view.pieces.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ShapePiece& piece = view.pieces[i];
      const std::uint8_t* const first = view.corners.data() + corners * piece.first_part;
      std::uint8_t most = 0;
      for (std::size_t c = 0; c < corners * piece.parts; ++c) most = std::max(most, first[c]);
      if (most >= piece.vertices) fits = false;
    }
  });
  if (!fits) return Status::DataLoss("shape: a part has a corner that its piece does not have");
  return view;
}

Result<ShapeInfo> InfoOf(std::span<const std::byte> bytes) {
  const Result<ShapeView> view = ViewShape(bytes);
  return view.ok() ? Result<ShapeInfo>(view->info) : view.status();
}

}  // namespace slabstream
