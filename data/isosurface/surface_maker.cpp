#include "data/isosurface/surface_maker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/base/check.h"
#include "common/parallel/parallel.h"
#include "data/isosurface/cell_cases.h"

namespace slabstream {
namespace {

constexpr std::int64_t kRowsOfATask = 8;

Index3 Back(Index3 voxel, Axis axis) {
  --voxel[axis];
  return voxel;
}

}  // namespace

SurfaceMaker::SurfaceMaker(const VolumeDescription& level, double isovalue, bool caps)
    : geometry_(level.geometry),
      bounds_(level.geometry.bounds()),
      domain_(caps ? Box{Uniform(-1), bounds_.end + Uniform(1)} : bounds_),
      isovalue_((isovalue - level.mapping.offset) / level.mapping.scale),
      falls_(level.mapping.scale < 0) {}

// A call of Add. T: the type of samples.
template <class T>
class SurfaceMaker::Block {
 public:
  Block(const SurfaceMaker& maker, const VoxelBlock& samples, const Box& block)
      : maker_(maker),
        samples_(samples),
        block_(block),
        looked_at_(Intersection({block.begin - Uniform(1), block.end}, maker.domain_)),
        row_voxels_(looked_at_.size().x),
        inside_(std::size_t(looked_at_.voxel_count())),
        kinds_(std::size_t(looked_at_.size().y) * std::size_t(looked_at_.size().z)) {
    ParallelForRanges(std::size_t{0}, kinds_.size(), kRowsOfATask, [this](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) kinds_[row] = FindInside(row);
    });
  }

  struct Counts {
    std::uint32_t x = 0, y = 0, z = 0, triangles = 0;
  };
  // What each row makes.
  std::vector<Counts> Count() const {
    const std::array<CellCase, 256>& cases = CellCases();
    std::vector<Counts> counts(rows_);
    VisitRows([&](std::size_t number, std::int32_t y, std::int32_t z, const std::uint8_t* before) {
      Counts& its = counts[number];
      const bool cells = HasCells(y, z);
      VisitCells(before, [&](std::int32_t x, unsigned low, unsigned high) {
        its.x += (low ^ high) >> 3;
        its.y += (high >> 2 ^ high >> 3) & 1;
        its.z += (high >> 1 ^ high >> 3) & 1;
        if (cells && x > maker_.domain_.begin.x) its.triangles += cases[low | high << 4].count;
      });
    });
    return counts;
  }

  // `rows`: of the block and the rows before it, as Add lays them out; `before`: the same of the block before it along x, or empty;
  // `first_triangles`: for each row of the block.
  void Make(const Rows& rows, const Rows& before, const std::vector<std::size_t>& first_triangles, SurfacePart& part) const {
    const std::array<CellCase, 256>& cases = CellCases();
    const std::int64_t first = maker_.vertices_;
    VisitRows([&](std::size_t number, std::int32_t y, std::int32_t z, const std::uint8_t* sides) {
      // The next vertex of each row around the cells: the number y + 2 z tells which.
      std::array<std::int64_t, 4> next_x{};
      std::array<std::int64_t, 2> next_y{}, next_z{};
      std::array<std::int64_t, 12> at{};  // vertices of the cell, by edge
      for (const int i : {0, 1, 2, 3}) next_x.at(std::size_t(i)) = rows[RowNumber(y - 1 + (i & 1), z - 1 + (i >> 1))].x;
      for (const std::size_t i : {0U, 1U}) {
        const std::size_t below = RowNumber(y, z - 1 + std::int32_t(i)), left = RowNumber(y - 1 + std::int32_t(i), z);
        next_y.at(i) = rows[below].y;
        next_z.at(i) = rows[left].z;
        if (before.empty()) continue;
        at.at(5 + 2 * i) = before[below].z - 1;  // the last one of its row, if there is one
        at.at(9 + 2 * i) = before[left].end - 1;
      }
      const bool cells = HasCells(y, z);
      std::size_t triangle = first_triangles[number];
      VisitCells(sides, [&](std::int32_t x, unsigned low, unsigned high) {
        const Index3 voxel = {x, y, z};
        const auto add = [&](Axis axis, std::int64_t vertex) {
          part.vertices[std::size_t(vertex - first)] = VertexBefore(voxel, axis, (high >> 3 & 1) != 0);
        };
        for (std::size_t i = 0; i < 4; ++i) {
          if (((low ^ high) >> i & 1) != 0) at[i] = next_x[i]++;
        }
        for (std::size_t i = 0; i < 2; ++i) {
          at[4 + 2 * i] = at[5 + 2 * i];
          at[8 + 2 * i] = at[9 + 2 * i];
          if (((high >> 2 * i ^ high >> (2 * i + 1)) & 1) != 0) at[5 + 2 * i] = next_y[i]++;
          if (((high >> i ^ high >> (i + 2)) & 1) != 0) at[9 + 2 * i] = next_z[i]++;
        }
        if (((low ^ high) >> 3) != 0) add(Axis::kX, at[3]);
        if (((high >> 2 ^ high >> 3) & 1) != 0) add(Axis::kY, at[7]);
        if (((high >> 1 ^ high >> 3) & 1) != 0) add(Axis::kZ, at[11]);
        if (!cells || x == maker_.domain_.begin.x) return;
        const CellCase& made = cases[low | high << 4];
        for (std::size_t i = 0; i < made.count; ++i) {
          for (std::size_t corner = 0; corner < 3; ++corner) part.triangles[triangle][corner] = std::int32_t(at[made.triangles[i][corner]]);
          ++triangle;
        }
      });
    });
  }

  // Of a row of the block, or of one just before it along y or z.
  std::size_t RowNumber(std::int32_t y, std::int32_t z) const {
    return std::size_t(y - block_.begin.y + 1) + std::size_t(z - block_.begin.z + 1) * std::size_t(block_.size().y + 1);
  }

 private:
  enum class Kind : std::uint8_t { kOutside, kInside, kMixed };

  // Whether each voxel of a row of looked_at_ lies inside, and what the row is as a whole.
  Kind FindInside(std::size_t row) {
    const Index3 size = looked_at_.size();
    const std::int32_t y = looked_at_.begin.y + std::int32_t(row % std::size_t(size.y));
    const std::int32_t z = looked_at_.begin.z + std::int32_t(row / std::size_t(size.y));
    const std::int32_t begin = std::max(looked_at_.begin.x, 0), end = std::min(looked_at_.end.x, maker_.bounds_.end.x);
    if (!maker_.bounds_.Contains(Index3{begin, y, z})) return Kind::kOutside;
    std::uint8_t* const out = &inside_[row * std::size_t(row_voxels_)] + (begin - looked_at_.begin.x);
    const T* const in = samples_.samples<T>() + samples_.Offset({begin, y, z});
    const std::int32_t count = end - begin;
    // Floats tell on which side a sample lies as well as the isovalue does, since samples are floats.
    float limit = float(maker_.isovalue_);
    if (maker_.falls_) {
      if (double(limit) > maker_.isovalue_) limit = std::nextafter(limit, -std::numeric_limits<float>::infinity());
      for (std::int32_t i = 0; i < count; ++i) out[i] = float(in[i]) <= limit ? 1 : 0;
    } else {
      if (double(limit) < maker_.isovalue_) limit = std::nextafter(limit, std::numeric_limits<float>::infinity());
      for (std::int32_t i = 0; i < count; ++i) out[i] = float(in[i]) >= limit ? 1 : 0;
    }
    std::int32_t sum = 0;
    for (std::int32_t i = 0; i < count; ++i) sum += out[i];
    return sum == 0 ? Kind::kOutside : sum == row_voxels_ ? Kind::kInside : Kind::kMixed;
  }

  std::size_t LookedAt(std::int32_t y, std::int32_t z) const {
    return std::size_t(y - looked_at_.begin.y) + std::size_t(z - looked_at_.begin.z) * std::size_t(looked_at_.size().y);
  }
  bool HasCells(std::int32_t y, std::int32_t z) const { return y > maker_.domain_.begin.y && z > maker_.domain_.begin.z; }

  // visit(number of the row, y, z, sides) for each row of the block that may make something. sides[i]: which of the voxels of the four rows
  // y - 1, z - 1; y, z - 1; y - 1, z; y, z lie inside, a bit each, at x = block_.begin.x - 1 + i. Where the domain begins, voxels stand for
  // those before them.
  template <class Visit>
  void VisitRows(Visit&& visit) const {
    ParallelForRanges(std::size_t{0}, rows_, kRowsOfATask, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint8_t> sides(std::size_t(block_.size().x) + 1);
      for (std::size_t number = begin; number < end; ++number) {
        const std::int32_t y = block_.begin.y + std::int32_t(number % std::size_t(block_.size().y));
        const std::int32_t z = block_.begin.z + std::int32_t(number / std::size_t(block_.size().y));
        const std::int32_t y_before = std::max(y - 1, maker_.domain_.begin.y), z_before = std::max(z - 1, maker_.domain_.begin.z);
        const std::array<std::size_t, 4> four = {LookedAt(y_before, z_before), LookedAt(y, z_before), LookedAt(y_before, z),
                                                 LookedAt(y, z)};
        const Kind kind = kinds_[four[0]];
        if (kind != Kind::kMixed && std::ranges::all_of(four, [&](std::size_t row) { return kinds_[row] == kind; })) continue;
        std::array<const std::uint8_t*, 4> in{};
        for (const std::size_t i : {0U, 1U, 2U, 3U}) in.at(i) = &inside_[four.at(i) * std::size_t(row_voxels_)];
        const bool repeats = looked_at_.begin.x == block_.begin.x;
        std::uint8_t* const out = sides.data() + (repeats ? 1 : 0);
        for (std::int32_t i = 0; i < row_voxels_; ++i) out[i] = std::uint8_t(in[0][i] | in[1][i] << 1 | in[2][i] << 2 | in[3][i] << 3);
        if (repeats) sides[0] = sides[1];
        visit(number, y, z, sides.data());
      }
    });
  }

  // visit(x, corners inside at x - 1, corners inside at x), but not where all eight voxels are on one side for some cells in a row.
  template <class Visit>
  void VisitCells(const std::uint8_t* sides, Visit&& visit) const {
    constexpr std::int32_t kAtOnce = 8;
    constexpr std::uint64_t kAllInside = 0x0f0f0f0f0f0f0f0f;
    const std::int32_t count = block_.size().x;
    for (std::int32_t i = 0; i < count;) {
      std::uint64_t low = 0, high = 0;
      if (i + kAtOnce <= count) {
        std::memcpy(&low, sides + i, sizeof low);
        std::memcpy(&high, sides + i + 1, sizeof high);
        if (low == high && (low == 0 || low == kAllInside)) {
          i += kAtOnce;
          continue;
        }
      }
      for (const std::int32_t end = std::min(i + kAtOnce, count); i < end; ++i) visit(block_.begin.x + i, sides[i], sides[i + 1]);
    }
  }

  // Stored; NaN outside the level.
  double Value(const Index3& voxel) const {
    return maker_.bounds_.Contains(voxel) ? double(samples_.samples<T>()[samples_.Offset(voxel)])
                                          : std::numeric_limits<double>::quiet_NaN();
  }

  // Of stored samples, along the voxels' axes, in lengths of the world. The voxel has a value; neighbours without one do not count.
  Vec3 Gradient(const Index3& voxel) const {
    const VolumeGeometry& geometry = maker_.geometry_;
    const T* const at = samples_.samples<T>() + samples_.Offset(voxel);
    std::int64_t step = 1;  // samples to the next voxel
    Vec3 gradient;
    for (const Axis axis : kAxes) {
      const int low = voxel[axis] > 0 && std::isfinite(double(at[-step])) ? 1 : 0;
      const int high = voxel[axis] + 1 < geometry.size[axis] && std::isfinite(double(at[step])) ? 1 : 0;
      const double voxels = geometry.rectilinear()
                                ? geometry.stretch.ToData(voxel[axis] + high, axis) - geometry.stretch.ToData(voxel[axis] - low, axis)
                                : high + low;
      if (voxels > 0) gradient[axis] = (double(at[high * step]) - double(at[-low * step])) / (voxels * geometry.spacing[axis]);
      step *= samples_.box.size()[axis];
    }
    return gradient;
  }

  // On the edge from the voxel before `voxel`; `inside`: `voxel` is.
  SurfaceVertex VertexBefore(const Index3& voxel, Axis axis, bool inside) const {
    const Index3 before = Back(voxel, axis);
    const double low = Value(before), high = Value(voxel);
    Vec3 normal;
    double share = 0.5;
    if (std::isfinite(low) && std::isfinite(high)) {
      share = std::clamp((maker_.isovalue_ - low) / (high - low), kLeastDistance, 1 - kLeastDistance);
      normal = (maker_.falls_ ? 1.0 : -1.0) * ((1 - share) * Gradient(before) + share * Gradient(voxel));
    }
    if (!(Length(normal) > 0)) {
      normal = {};
      normal[axis] = inside ? -1 : 1;
    }
    Vec3 place = ToVec3(voxel);
    place[axis] += share - 1;
    const VolumeGeometry& geometry = maker_.geometry_;
    const Vec3 position = geometry.ToWorld(geometry.stretch.ToData(place)), direction = geometry.orientation.ToWorld(Normalized(normal));
    return {{float(position.x), float(position.y), float(position.z)}, {float(direction.x), float(direction.y), float(direction.z)}};
  }

  const SurfaceMaker& maker_;
  const VoxelBlock& samples_;
  const Box block_, looked_at_;  // looked_at_: voxels at the ends of the edges that lead back from those of block_
  const std::size_t rows_ = std::size_t(block_.size().y) * std::size_t(block_.size().z);
  const std::int32_t row_voxels_;     // of a row of looked_at_
  std::vector<std::uint8_t> inside_;  // of looked_at_, 1 or 0
  std::vector<Kind> kinds_;           // of its rows
};

Status TooManyVertices() {
  return Status::ResourceExhausted(
      fmt::format("the surface has more than {} vertices, which files of it can number: a coarser --level has fewer", kMaxSurfaceVertices));
}

template <class T>
SurfaceMaker::Sides SurfaceMaker::TakeSides(const Block<T>& work, const Box& block) {
  const auto take = [&](std::map<Index3, Rows>& from) {
    auto node = from.extract(block.begin);
    return node.empty() ? Rows() : std::move(node.mapped());
  };
  const Index3 begin = block.begin;
  Sides sides{Rows(std::size_t(block.size().y + 1) * std::size_t(block.size().z + 1)), take(before_x_)};
  const Rows before_y = take(before_y_), before_z = take(before_z_);
  for (std::size_t i = 0; i < before_y.size(); ++i) sides.rows[work.RowNumber(begin.y - 1, begin.z - 1 + std::int32_t(i))] = before_y[i];
  for (std::size_t i = 0; i < before_z.size(); ++i) sides.rows[work.RowNumber(begin.y - 1 + std::int32_t(i), begin.z - 1)] = before_z[i];
  return sides;
}

template <class T>
void SurfaceMaker::KeepSides(const Block<T>& work, const Box& block, Rows rows) {
  const Index3 begin = block.begin, end = block.end;
  const auto is_last = [&](Axis axis) { return end[axis] == domain_.end[axis]; };
  if (!is_last(Axis::kY)) {
    Rows& kept = before_y_[{begin.x, end.y, begin.z}];
    for (std::int32_t z = begin.z - 1; z < end.z; ++z) kept.push_back(rows[work.RowNumber(end.y - 1, z)]);
  }
  if (!is_last(Axis::kZ)) {
    Rows& kept = before_z_[{begin.x, begin.y, end.z}];
    for (std::int32_t y = begin.y - 1; y < end.y; ++y) kept.push_back(rows[work.RowNumber(y, end.z - 1)]);
  }
  if (!is_last(Axis::kX)) before_x_[{end.x, begin.y, begin.z}] = std::move(rows);
}

Result<SurfacePart> SurfaceMaker::Add(const VoxelBlock& samples, const Box& block) {
  CHECK(!block.empty() && domain_.Contains(block) && samples.box.Contains(Grown(block, kSurfaceReach, bounds_)));
  return VisitScalarType(samples.type, [&]<class T>(const T* /*type*/) -> Result<SurfacePart> {
    const Block<T> work(*this, samples, block);
    const std::vector<typename Block<T>::Counts> counts = work.Count();
    Sides sides = TakeSides(work, block);
    SurfacePart part;
    std::vector<std::size_t> first_triangles(counts.size());
    std::size_t triangles = 0;
    std::int64_t vertex = vertices_;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      Row& row =
          sides.rows[work.RowNumber(block.begin.y + std::int32_t(i) % block.size().y, block.begin.z + std::int32_t(i) / block.size().y)];
      row.x = vertex;
      row.y = row.x + counts[i].x;
      row.z = row.y + counts[i].y;
      row.end = vertex = row.z + counts[i].z;
      first_triangles[i] = triangles;
      triangles += counts[i].triangles;
    }
    if (vertex > kMaxSurfaceVertices) return TooManyVertices();
    part.vertices.resize(std::size_t(vertex - vertices_));
    part.triangles.resize(triangles);
    work.Make(sides.rows, sides.before_x, first_triangles, part);
    vertices_ = vertex;
    KeepSides(work, block, std::move(sides.rows));
    return part;
  });
}

void SurfaceMaker::Follow(const VoxelBlock& samples, const Box& slice) {
  CHECK(slice.size().z == 1 && domain_.Contains(slice) && samples.box.Contains(Grown(slice, kSurfaceReach, bounds_)));
  VisitScalarType(samples.type, [&]<class T>(const T* /*type*/) {
    const Block<T> work(*this, samples, slice);
    Rows rows = TakeSides(work, slice).rows;
    const std::vector<typename Block<T>::Counts> counts = work.Count();
    for (std::size_t i = 0; i < counts.size(); ++i) {
      Row& row = rows[work.RowNumber(slice.begin.y + std::int32_t(i), slice.begin.z)];
      row.x = kOthersVertex + others_vertices_;
      row.y = row.x + counts[i].x;
      row.z = row.end = row.y + counts[i].y;
      others_vertices_ += std::int64_t{counts[i].x} + counts[i].y;
    }
    KeepSides(work, slice, std::move(rows));
  });
}

std::vector<std::int32_t> SurfaceMaker::LastSlice() const {
  std::vector<const std::pair<const Index3, Rows>*> columns;
  for (const auto& column : before_z_) columns.push_back(&column);
  std::ranges::sort(columns, {}, [](const auto* column) { return std::pair(column->first.y, column->first.x); });
  std::vector<std::int32_t> numbers;
  for (const auto* const column : columns) {
    for (std::size_t i = 1; i < column->second.size(); ++i) {  // the first row is the last one of the column before
      for (std::int64_t vertex = column->second[i].x; vertex < column->second[i].z; ++vertex) numbers.push_back(std::int32_t(vertex));
    }
  }
  return numbers;
}

}  // namespace slabstream
