#include "data/volume_io/mesh_builder.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <utility>

#include "common/volume/memory_budget.h"

namespace slabstream {

MeshBuilder::MeshBuilder(std::string path, std::string format) : path_(std::move(path)) { result_.info.format = std::move(format); }

void MeshBuilder::AddArray(const MeshArray& array, bool active) {
  result_.info.arrays.push_back(array);
  active_.push_back(active);
}

Result<std::size_t> MeshBuilder::ChooseArray(const MeshOptions& options) {
  MeshFileInfo& info = result_.info;
  std::string names;
  std::vector<std::size_t> scalars, active;
  for (std::size_t i = 0; i < info.arrays.size(); ++i) {
    const MeshArray& array = info.arrays[i];
    if (!options.array.empty() && array.name == options.array) {
      if (array.components == 1) return info.array = i;
      return Wrong(fmt::format("array {} has {} components, must have 1", array.name, array.components));
    }
    if (array.components != 1) continue;
    names.append(names.empty() ? "" : ", ").append(array.name);
    scalars.push_back(i);
    if (active_[i]) active.push_back(i);
  }
  if (scalars.empty()) return Wrong("has no array with one component, of points or cells");
  if (!options.array.empty()) return Wrong(fmt::format("has no array '{}'; it has {}", options.array, names));
  if (active.empty() && scalars.size() > 1) {
    return Wrong(fmt::format("has several arrays and none is the active scalars; choose one by its name: {}", names));
  }
  if (active.empty()) return info.array = scalars.front();
  const auto of_points = std::ranges::find_if(active, [&](std::size_t i) { return info.arrays[i].at == ValuesAt::kPoints; });
  return info.array = of_points == active.end() ? active.front() : *of_points;
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

Result<std::int64_t> MeshBuilder::SetCells(const AlignedVector<std::int64_t>& kinds, const AlignedVector<std::int64_t>& ends) {
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
  if (Status status = ReserveTetrahedra(); !status.ok()) return status;
  return end;
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

Status MeshBuilder::SetCorners(const AlignedVector<std::int64_t>& corners) {
  std::vector<Tetrahedron>& tetrahedra = result_.mesh.tetrahedra;
  std::vector<PointNumber> points;
  const std::int64_t* corner = corners.data();
  for (std::size_t cell = 0; cell < kinds_.size(); ++cell) {
    points.clear();
    for (const std::int64_t* const end = corner + kinds_[cell]->points; corner != end; ++corner) {
      if (*corner < 0 || *corner >= result_.info.points) {
        return Damaged(fmt::format("cell {} has point {}, must be in [0, {})", cell, *corner, result_.info.points));
      }
      points.push_back(PointNumber(*corner));
    }
    const std::size_t first = tetrahedra.size();
    SplitCell(*kinds_[cell], points, tetrahedra);
    // A cell with a point twice, as some grids have at their poles, makes parts without a volume.
    const auto flat = [](const Tetrahedron& t) {
      return t[0] == t[1] || t[0] == t[2] || t[0] == t[3] || t[1] == t[2] || t[1] == t[3] || t[2] == t[3];
    };
    tetrahedra.erase(std::remove_if(tetrahedra.begin() + std::ptrdiff_t(first), tetrahedra.end(), flat), tetrahedra.end());
    cells_.resize(tetrahedra.size(), std::uint32_t(cell));
  }
  return tetrahedra.empty() ? Wrong("has no cells with a volume") : Status::Ok();
}

void MeshBuilder::SetValues(AlignedVector<float> values) {
  Mesh& mesh = result_.mesh;
  mesh.at = result_.info.arrays[result_.info.array].at;
  if (mesh.at == ValuesAt::kPoints) {
    mesh.values = std::move(values);
    return;
  }
  mesh.values.resize(mesh.tetrahedra.size());
  std::ranges::transform(cells_, mesh.values.begin(), [&](std::uint32_t cell) { return values[cell]; });
}

}  // namespace slabstream
