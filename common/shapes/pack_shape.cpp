#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "common/parallel/parallel.h"
#include "common/shapes/shape_bytes.h"

namespace slabstream {
namespace {

using Position = std::array<float, 3>;
using Part = std::array<std::uint32_t, 3>;  // numbers of its vertices; those that its kind does not have repeat the first one

Status CheckLength(const char* field, std::size_t length, std::size_t vertices) {
  if (length == 0 || length == vertices) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("shape.{} has {} elements, must have 0 or {}, as many as shape.positions", field, length, vertices));
}

Status CheckMost(const char* field, std::size_t count, std::uint32_t most) {
  if (count <= most) return Status::Ok();
  return Status::InvalidArgument(fmt::format("shape.{} has {} elements, must have at most {}", field, count, most));
}

Status CheckLines(const std::vector<std::uint32_t>& begins, std::size_t vertices) {
  for (std::size_t i = 0; i + 1 < begins.size(); ++i) {
    if (begins[i + 1] < begins[i] + std::size_t{2}) {
      return Status::InvalidArgument(
          fmt::format("shape.line_begins[{}] is {}, must be at least 2 before where the line ends, {}", i, begins[i], begins[i + 1]));
    }
  }
  if (!begins.empty() && begins.back() > vertices) {
    return Status::InvalidArgument(fmt::format("shape.line_begins ends with {}, must be at most {}", begins.back(), vertices));
  }
  return Status::Ok();
}

Status CheckPlane(const Shape& shape) {
  const PlaneValues& plane = shape.plane;
  if (std::max(plane.columns, plane.rows) > kMaxPlaneSide || plane.samples.size() != std::size_t{plane.columns} * plane.rows) {
    return Status::InvalidArgument(fmt::format("shape.plane has {} samples, must have {} x {}, at most {} a side", plane.samples.size(),
                                               plane.columns, plane.rows, kMaxPlaneSide));
  }
  if (!plane.samples.empty() && (shape.kind != ShapeKind::kMesh || !shape.values.empty()))
    return Status::InvalidArgument("shape.plane: only a mesh without values of vertices has one");
  return Status::Ok();
}

Status Check(const Shape& shape) {
  const std::size_t n = shape.positions.size();
  if (Status status = CheckMost("positions", n, kMaxShapeVertices); !status.ok()) return status;
  if (Status status = CheckMost("triangles", shape.triangles.size(), kMaxShapeParts); !status.ok()) return status;
  if (Status status = CheckLength("normals", shape.normals.size(), n); !status.ok()) return status;
  if (Status status = CheckLength("colors", shape.colors.size(), n); !status.ok()) return status;
  if (Status status = CheckLength("values", shape.values.size(), n); !status.ok()) return status;
  if (Status status = CheckLength("radii", shape.radii.size(), n); !status.ok()) return status;
  if (!shape.triangles.empty() && shape.kind != ShapeKind::kMesh)
    return Status::InvalidArgument(fmt::format("shape.triangles: {} have none", NameOf(shape.kind)));
  if (!shape.line_begins.empty() && shape.kind != ShapeKind::kLines)
    return Status::InvalidArgument(fmt::format("shape.line_begins: a shape of kind {} has none", NameOf(shape.kind)));
  for (const int axis : {0, 1, 2}) {
    if (!std::isfinite(shape.origin[axis]))
      return Status::InvalidArgument(fmt::format("shape.origin has {}, must be finite", shape.origin[axis]));
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (const float x : shape.positions[i]) {
      if (!std::isfinite(x)) return Status::InvalidArgument(fmt::format("shape.positions[{}] has {}, must be finite", i, x));
    }
  }
  for (std::size_t i = 0; i < shape.radii.size(); ++i) {
    if (!(shape.radii[i] >= 0 && std::isfinite(shape.radii[i]))) {
      return Status::InvalidArgument(fmt::format("shape.radii[{}] is {}, must be at least 0 and finite", i, shape.radii[i]));
    }
  }
  for (std::size_t i = 0; i < shape.triangles.size(); ++i) {
    const auto& [a, b, c] = shape.triangles[i];
    if (const std::uint32_t most = std::max({a, b, c}); most >= n) {
      return Status::InvalidArgument(fmt::format("shape.triangles[{}] has vertex {}, must be below {}", i, most, n));
    }
  }
  if (Status status = CheckPlane(shape); !status.ok()) return status;
  return CheckLines(shape.line_begins, n);
}

Vec3 ToVec3(const Position& p) { return {double(p[0]), double(p[1]), double(p[2])}; }

// Perpendicular to a triangle; twice its area long.
Vec3 AreaOf(const Shape& shape, const Part& part) {
  const Vec3 a = ToVec3(shape.positions[part[0]]);
  return Cross(ToVec3(shape.positions[part[1]]) - a, ToVec3(shape.positions[part[2]]) - a);
}

// Triangles begin with their least number, so that it does not matter how a file turns them.
std::vector<Part> PartsOf(const Shape& shape) {
  std::vector<Part> parts;
  if (shape.kind == ShapeKind::kMesh) {
    parts.reserve(shape.triangles.size());
    for (Part part : shape.triangles) {
      std::ranges::rotate(part, std::ranges::min_element(part));
      if (AreaOf(shape, part) != Vec3{}) parts.push_back(part);
    }
  } else if (shape.kind == ShapeKind::kLines) {
    for (std::size_t i = 0; i + 1 < shape.line_begins.size(); ++i) {
      for (std::size_t v = shape.line_begins[i]; v + 1 < shape.line_begins[i + 1]; ++v)
        parts.push_back({std::uint32_t(v), std::uint32_t(v + 1), std::uint32_t(v)});
    }
  } else {
    for (std::size_t v = 0; v < shape.positions.size(); ++v) parts.push_back({std::uint32_t(v), std::uint32_t(v), std::uint32_t(v)});
  }
  return parts;
}

struct Bounds {
  Vec3 low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void Add(const Vec3& p, double radius = 0) {
    for (const Axis axis : kAxes) {
      low[axis] = std::min(low[axis], p[axis] - radius);
      high[axis] = std::max(high[axis], p[axis] + radius);
    }
  }
};

constexpr int kMortonBits = 11;  // of each axis
constexpr int kNumberBits = 30;  // of parts
static_assert(kMaxShapeParts <= 1U << kNumberBits && 3 * kMortonBits + kNumberBits <= 64);

// `x` with two zeroes behind each bit.
std::uint64_t Spread(std::uint32_t x) {
  std::uint64_t spread = 0;
  for (int bit = 0; bit < kMortonBits; ++bit) spread |= std::uint64_t(x >> bit & 1) << 3 * bit;
  return spread;
}

// Parts along a Morton curve through their middles; parts of one cell in the order of their vertices. `codes`: becomes their places on the
// curve.
std::vector<Part> Sorted(const Shape& shape, const std::vector<Part>& parts, std::vector<std::uint64_t>& codes) {
  Bounds bounds;
  for (const Part& part : parts) {
    for (const std::uint32_t v : part) bounds.Add(ToVec3(shape.positions[v]));
  }
  const Vec3 sides = bounds.high - bounds.low;
  const double longest = std::max({sides.x, sides.y, sides.z});
  const double cells = longest > 0 ? ((1 << kMortonBits) - 1) / longest : 0;
  std::vector<std::uint64_t>& keys = codes;
  keys.resize(parts.size());
  ParallelForRanges(std::size_t{0}, parts.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& [a, b, c] = parts[i];
      const Vec3 middle = (1.0 / 3) * (ToVec3(shape.positions[a]) + ToVec3(shape.positions[b]) + ToVec3(shape.positions[c]));
      const auto cell = [&](Axis axis) { return Spread(std::uint32_t(std::max((middle[axis] - bounds.low[axis]) * cells, 0.0))); };
      keys[i] = (cell(Axis::kX) | cell(Axis::kY) << 1 | cell(Axis::kZ) << 2) << kNumberBits | i;
    }
  });
  ParallelSort(keys);
  std::vector<Part> sorted(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    sorted[i] = parts[keys[i] & ((1U << kNumberBits) - 1)];
    keys[i] >>= kNumberBits;
  }
  for (std::size_t begin = 0, end = 0; begin < parts.size(); begin = end) {
    while (end < parts.size() && keys[end] == keys[begin]) ++end;
    std::sort(sorted.begin() + std::ptrdiff_t(begin), sorted.begin() + std::ptrdiff_t(end));
  }
  return sorted;
}

// Cuts sorted parts into pieces: where the curve leaves the largest of its cells, until each run of parts is small enough. So pieces are
// about as long as they are wide.
class Cut {
 public:
  Cut(const Shape& shape, const std::vector<Part>& parts, const std::vector<std::uint64_t>& codes)
      : shape_(shape),
        parts_(parts),
        codes_(codes),
        corners_(std::max(CornersOf(shape.kind), std::size_t{1})),
        run_of_(shape.positions.size()),
        number_of_(shape.positions.size()) {
    if (!parts.empty()) CutRun(0, parts.size());
    ParallelFor(std::size_t{0}, pieces.size(), [&](std::size_t i) { FindBounds(pieces[i]); });
  }

  std::vector<ShapePiece> pieces;
  std::vector<std::uint32_t> vertices;  // of the shape, piece by piece
  std::vector<std::uint8_t> corners;

 private:
  void CutRun(std::size_t begin, std::size_t end) {
    if (end - begin <= kMostOfPiece && FitsAPiece(begin, end)) return AddPiece(begin, end);
    std::size_t middle = begin + (end - begin) / 2;
    if (const std::uint64_t differ = codes_[begin] ^ codes_[end - 1]; differ != 0) {
      const std::uint64_t cell = codes_[end - 1] & ~(std::bit_floor(differ) - 1);
      middle = std::size_t(std::lower_bound(codes_.begin() + std::ptrdiff_t(begin), codes_.begin() + std::ptrdiff_t(end), cell) -
                           codes_.begin());
    }
    CutRun(begin, middle);
    CutRun(middle, end);
  }

  // visit(vertex): each vertex of these parts, the first time that it is met.
  template <class Visit>
  void ForNewVertices(std::size_t begin, std::size_t end, Visit&& visit) {
    ++run_;
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t c = 0; c < corners_; ++c) {
        const std::uint32_t v = parts_[i][c];
        if (std::exchange(run_of_[v], run_) != run_) visit(v);
      }
    }
  }
  bool FitsAPiece(std::size_t begin, std::size_t end) {
    std::size_t count = 0;
    ForNewVertices(begin, end, [&](std::uint32_t) { ++count; });
    return count <= kMostOfPiece;
  }
  void AddPiece(std::size_t begin, std::size_t end) {
    ShapePiece piece = {
        .first_vertex = std::uint32_t(vertices.size()), .first_part = std::uint32_t(begin), .parts = std::uint16_t(end - begin)};
    ForNewVertices(begin, end, [&](std::uint32_t v) {
      number_of_[v] = std::uint8_t(piece.vertices++);
      vertices.push_back(v);
    });
    pieces.push_back(piece);
    for (std::size_t i = begin; i < end && shape_.kind != ShapeKind::kPoints; ++i) {
      for (std::size_t c = 0; c < corners_; ++c) corners.push_back(number_of_[parts_[i][c]]);
    }
  }
  void FindBounds(ShapePiece& piece) const {
    piece.low = piece.high = shape_.positions[vertices[piece.first_vertex]];
    for (std::size_t i = 0; i < piece.vertices; ++i) {
      const std::uint32_t v = vertices[piece.first_vertex + i];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        piece.low[axis] = std::min(piece.low[axis], shape_.positions[v][axis]);
        piece.high[axis] = std::max(piece.high[axis], shape_.positions[v][axis]);
      }
      if (!shape_.radii.empty()) piece.radius = std::max(piece.radius, shape_.radii[v]);
    }
  }

  const Shape& shape_;
  const std::vector<Part>& parts_;
  const std::vector<std::uint64_t>& codes_;
  const std::size_t corners_;  // of a part
  std::uint32_t run_ = 0;
  std::vector<std::uint32_t> run_of_;    // by vertex: the last run that met it
  std::vector<std::uint8_t> number_of_;  // by vertex: its number in the last piece that has it
};

std::vector<std::uint32_t> NormalsOf(const Shape& shape, const std::vector<Part>& parts) {
  std::vector<std::uint32_t> packed(shape.positions.size());
  if (!shape.normals.empty()) {
    std::ranges::transform(shape.normals, packed.begin(), [](const Position& n) { return PackShapeNormal(ToVec3(n)); });
    return packed;
  }
  std::vector<Vec3> sums(shape.positions.size());
  for (const Part& part : parts) {
    const Vec3 area = AreaOf(shape, part);
    for (const std::uint32_t v : part) sums[v] = sums[v] + area;
  }
  std::ranges::transform(sums, packed.begin(), PackShapeNormal);
  return packed;
}

ShapeHeader HeaderOf(const Shape& shape, const Cut& cut, std::size_t parts) {
  ShapeHeader header;
  header.kind = std::uint32_t(shape.kind);
  header.has_colors = shape.colors.empty() ? 0 : 1;
  header.has_values = shape.values.empty() ? 0 : 1;
  header.has_radii = shape.radii.empty() ? 0 : 1;
  const bool has_holes = std::ranges::any_of(shape.plane.samples, [](float sample) { return std::isnan(sample); });
  header.see_through = has_holes || std::ranges::any_of(shape.colors, [](const auto& color) { return color[3] < 255; }) ? 1 : 0;
  header.piece_count = std::uint32_t(cut.pieces.size());
  header.vertices = shape.positions.size();
  header.parts = parts;
  header.vertex_count = cut.vertices.size();
  header.origin = {shape.origin.x, shape.origin.y, shape.origin.z};
  Bounds bounds;
  for (const std::uint32_t v : cut.vertices) {
    bounds.Add(shape.origin + ToVec3(shape.positions[v]), shape.radii.empty() ? 0 : double(shape.radii[v]));
  }
  for (std::size_t axis = 0; axis < 3 && !cut.vertices.empty(); ++axis) {
    header.low[axis] = bounds.low[int(axis)];
    header.high[axis] = bounds.high[int(axis)];
  }
  header.plane_columns = shape.plane.columns;
  header.plane_rows = shape.plane.rows;
  header.plane_column = shape.plane.column;
  header.plane_row = shape.plane.row;
  bool any = false;
  for (const float value : shape.plane.samples.empty() ? shape.values : shape.plane.samples) {
    if (!std::isfinite(value)) continue;
    header.least = any ? std::min(header.least, value) : value;
    header.largest = any ? std::max(header.largest, value) : value;
    any = true;
  }
  return header;
}

}  // namespace

Result<AlignedVector<std::byte>> PackShape(const Shape& shape) {
  if (Status status = Check(shape); !status.ok()) return status;
  std::vector<Part> parts = PartsOf(shape);
  if (Status status = CheckMost("lines", parts.size(), kMaxShapeParts); !status.ok()) return status;
  std::vector<std::uint64_t> codes;
  parts = Sorted(shape, parts, codes);
  const Cut cut(shape, parts, codes);
  const ShapeHeader header = HeaderOf(shape, cut, parts.size());
  const ShapeLayout layout(header);

  AlignedVector<std::byte> bytes(layout.end);
  const auto put = [&](std::uint64_t at, const auto& elements) {
    if (!elements.empty()) std::memcpy(bytes.data() + at, elements.data(), std::span(elements).size_bytes());
  };
  // By vertex of the pieces.
  const auto gather = [&](std::uint64_t at, const auto& of) {
    std::vector<std::decay_t<decltype(of(0U))>> gathered(cut.vertices.size());
    std::ranges::transform(cut.vertices, gathered.begin(), of);
    put(at, gathered);
  };
  const auto gather_array = [&](std::uint64_t at, const auto& array) {
    if (!array.empty()) gather(at, [&](std::uint32_t v) { return array[v]; });
  };
  std::memcpy(bytes.data(), &header, sizeof header);
  put(layout.pieces, cut.pieces);
  for (std::size_t axis = 0; axis < 3; ++axis) gather(layout.positions[axis], [&](std::uint32_t v) { return shape.positions[v][axis]; });
  if (shape.kind == ShapeKind::kMesh) gather_array(layout.normals, NormalsOf(shape, parts));
  gather_array(layout.colors, shape.colors);
  gather_array(layout.values, shape.values);
  gather_array(layout.radii, shape.radii);
  put(layout.corners, cut.corners);
  put(layout.plane, shape.plane.samples);
  return bytes;
}

}  // namespace slabstream
