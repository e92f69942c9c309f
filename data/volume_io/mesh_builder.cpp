#include "data/volume_io/mesh_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/volume/memory_budget.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

MeshBuilder::MeshBuilder(std::string path, std::string format) : path_(std::move(path)) { result_.info.format = std::move(format); }

Result<std::size_t> MeshBuilder::SetArrays(std::vector<GridArray> arrays, const MeshOptions& options) {
  MeshFileInfo& info = result_.info;
  info.arrays = std::move(arrays);
  const Result<std::size_t> chosen = ChooseArray(path_, info.arrays, options.array);
  if (!chosen.ok()) return chosen.status();
  info.array = *chosen;
  info.channel = options.channel;
  if (Status status = CheckChannel(path_, RawHeader{.components = info.arrays[*chosen].components}, {.channel = options.channel});
      !status.ok())
    return status;
  return *chosen;
}

Status MeshBuilder::SetPoints(const AlignedVector<double>& places) {
  AlignedVector<Vector3<float>>& points = result_.mesh.points;
  const auto place = [&](std::size_t i) { return Vec3{places[3 * i], places[3 * i + 1], places[3 * i + 2]}; };
  points.resize(places.size() / 3);
  result_.info.points = std::int64_t(points.size());
  auto& [low, high] = result_.bounds;
  low = high = place(0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = place(i);
    if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))) return Wrong(fmt::format("point {} is not finite", i));
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  const Vec3 extent = high - low;
  for (const Axis axis : kAxes) {
    if (extent[axis] >= kLeastExtent && extent[axis] <= kMostExtent) continue;
    return Wrong(
        fmt::format("its points reach over {} along {}, must be in [{}, {}]", extent[axis], Letter(axis), kLeastExtent, kMostExtent));
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = place(i) - low;
    points[i] = {float(p.x), float(p.y), float(p.z)};
  }
  return Status::Ok();
}

Status MeshBuilder::SetCells(const AlignedVector<std::int64_t>& kinds, const AlignedVector<std::int64_t>& ends) {
  std::vector<std::int64_t> counts(CellKinds().size());
  std::int64_t end = 0;
  for (std::size_t cell = 0; cell < kinds.size(); ++cell) {
    const std::int64_t type = kinds[cell];
    const CellKind* const kind = type >= 0 && type < 256 ? FindCellKind(int(type)) : nullptr;
    if (kind == nullptr) {
      return Wrong(fmt::format(
          "cell {} has VTK's type {}; supported: tetrahedra (10), voxels (11), hexahedra (12), wedges (13) and pyramids (14). ParaView's "
          "filter Tetrahedralize makes tetrahedra of others",
          cell, type));
    }
    end += kind->points;
    if (ends[cell] != end) {
      return Damaged(fmt::format("the points of cell {}, a {}, end at {}, must end at {}", cell, kind->name, ends[cell], end));
    }
    ++counts[std::size_t(kind - CellKinds().data())];
    kinds_.push_back(kind);
  }
  MeshFileInfo& info = result_.info;
  info.cells = std::int64_t(kinds.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) info.kinds.push_back({&CellKinds()[i], counts[i]});
  }
  return ReserveTetrahedra();
}

Status MeshBuilder::ReserveTetrahedra() {
  std::int64_t count = 0;
  for (const MeshFileInfo::CellCount& cells : result_.info.kinds) {
    std::vector<PointNumber> points(std::size_t(cells.kind->points));
    std::iota(points.begin(), points.end(), 0U);
    std::vector<Tetrahedron> parts;
    SplitCell(*cells.kind, points, parts);
    count += cells.count * std::int64_t(parts.size());
  }
  if (count > kMaxTetrahedra) {
    return Status::ResourceExhausted(fmt::format("{}: its cells make {} tetrahedra, must be at most {}", path_, count, kMaxTetrahedra));
  }
  const auto bytes = std::int64_t(sizeof(Tetrahedron) + sizeof(std::uint32_t) + sizeof(float));
  if (Status status = CheckFitsMemory(count * bytes, path_ + ": tetrahedra of its cells"); !status.ok()) return status;
  result_.mesh.tetrahedra.reserve(std::size_t(count));
  cells_.reserve(std::size_t(count));
  return Status::Ok();
}

Status MeshBuilder::AddCorners(const AlignedVector<std::int64_t>& corners, std::int64_t first, std::int64_t points) {
  std::vector<Tetrahedron>& tetrahedra = result_.mesh.tetrahedra;
  std::vector<PointNumber> of_cell;
  for (const std::int64_t* corner = corners.data(); corner != corners.data() + corners.size(); ++next_) {
    of_cell.clear();
    for (const std::int64_t* const end = corner + kinds_[next_]->points; corner != end; ++corner) {
      if (*corner < 0 || *corner >= points) {
        return Damaged(fmt::format("cell {} has point {}, must be in [0, {})", next_, *corner, points));
      }
      of_cell.push_back(PointNumber(first + *corner));
    }
    const std::size_t begin = tetrahedra.size();
    SplitCell(*kinds_[next_], of_cell, tetrahedra);
    // A cell with a point twice, as some grids have at their poles, makes parts without a volume.
    const auto flat = [](const Tetrahedron& t) {
      return t[0] == t[1] || t[0] == t[2] || t[0] == t[3] || t[1] == t[2] || t[1] == t[3] || t[2] == t[3];
    };
    tetrahedra.erase(std::remove_if(tetrahedra.begin() + std::ptrdiff_t(begin), tetrahedra.end(), flat), tetrahedra.end());
    cells_.resize(tetrahedra.size(), std::uint32_t(next_));
  }
  return Status::Ok();
}

Status MeshBuilder::SetValues(const AlignedVector<float>& values) {
  Mesh& mesh = result_.mesh;
  if (mesh.tetrahedra.empty()) return Wrong("has no cells with a volume");
  const GridArray& array = result_.info.arrays[result_.info.array];
  const auto value = [&](std::size_t element) {
    return TakenComponent(values.data() + element * std::size_t(array.components), result_.info.channel);
  };
  mesh.at = array.at;
  if (mesh.at == ValuesAt::kPoints) {
    mesh.values.resize(mesh.points.size());
    for (std::size_t i = 0; i < mesh.points.size(); ++i) mesh.values[i] = value(i);
  } else {
    mesh.values.resize(mesh.tetrahedra.size());
    std::ranges::transform(cells_, mesh.values.begin(), value);
  }
  return Status::Ok();
}

}  // namespace slabstream
