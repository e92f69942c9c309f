#include "data/volume_io/mesh_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <span>

#include "common/volume/memory_budget.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

void MeshPiece::Mark(const GhostMark& mark, const WholeNumbers& numbers) {
  std::vector<bool>& out = mark.at == ValuesAt::kPoints ? points_out : cells_out;
  out.resize(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) out[i] = out[i] || (numbers[i] & mark.bits) != 0;
}

Result<std::size_t> MeshBuilder::SetArrays(const std::string& path, std::vector<GridArray> arrays, const MeshOptions& options) {
  MeshFileInfo& info = result_.info;
  info.arrays = std::move(arrays);
  const Result<std::size_t> chosen = ChooseArray(path, info.arrays, options.array);
  if (!chosen.ok()) return chosen.status();
  info.array = *chosen;
  info.channel = options.channel;
  spill_ = options.spill;
  result_.mesh.at = info.arrays[*chosen].at;
  if (const int components = info.arrays[*chosen].components;
      options.channel == kMagnitude && (components == 2 || components == kMostVectorComponents)) {
    return *chosen;
  }
  if (Status status = CheckChannel(path, RawHeader{.components = info.arrays[*chosen].components}, {.channel = options.channel});
      !status.ok())
    return status;
  return *chosen;
}

float MeshBuilder::ValueOf(std::size_t element) const {
  const MeshFileInfo& info = result_.info;
  const auto components = std::size_t(info.arrays[info.array].components);
  const float* const values = piece_.values.data() + element * components;
  if (info.channel != kMagnitude) return TakenComponent(values, info.channel);
  double squares = 0;
  for (const float value : std::span(values, components)) squares += double(value) * value;
  return float(std::sqrt(squares));
}

Status MeshBuilder::BeginPiece(const std::string& where, MeshPiece piece) {
  if (Status status = EndPiece(); !status.ok()) return status;
  where_ = where;
  piece_ = std::move(piece);
  next_ = 0;
  const std::size_t count = piece_.places.size() / 3;
  if (const auto all = std::int64_t(points_.size() + count); all > kMaxMeshPoints) {
    return Status::ResourceExhausted(fmt::format("{}: with it the grid has {} points, must be at most {}", where, all, kMaxMeshPoints));
  }
  const auto bytes = std::int64_t(count * (kBytesPerMeshPoint + sizeof(PointNumber)));
  if (Status status = CheckFitsMemory(bytes, where + ": its points"); !status.ok()) return status;
  if (Status status = points_.BeginPiece(count); !status.ok()) return status;
  numbers_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double* const place = piece_.places.data() + 3 * i;
    if (!(std::isfinite(place[0]) && std::isfinite(place[1]) && std::isfinite(place[2]))) {
      return Status::InvalidArgument(fmt::format("{}: point {} is not finite", where, i));
    }
    const Result<PointNumber> number =
        points_.Add({place[0], place[1], place[2], result_.mesh.at == ValuesAt::kPoints ? double(ValueOf(i)) : 0});
    if (!number.ok()) return number.status();
    numbers_[i] = *number;
  }
  piece_.places = {};
  return Status::Ok();
}

Result<std::int64_t> MeshBuilder::CheckCells(const WholeNumbers& kinds, const WholeNumbers& ends) {
  std::vector<std::int64_t> counts(CellKinds().size());
  std::int64_t end = 0;
  for (std::size_t cell = 0; cell < kinds.size(); ++cell) {
    const std::int64_t type = kinds[cell];
    const CellKind* const kind = type >= 0 && type < 256 ? FindCellKind(int(type)) : nullptr;
    if (kind == nullptr) {
      return Status::InvalidArgument(
          fmt::format("{}: cell {} has VTK's type {}; supported: tetrahedra (10), voxels (11), hexahedra (12), wedges (13) and pyramids "
                      "(14). ParaView's "
                      "filter Tetrahedralize makes tetrahedra of others",
                      where_, cell, type));
    }
    end += kind->points;
    if (ends[cell] != end) {
      return Damaged(fmt::format("the points of cell {}, a {}, end at {}, must end at {}", cell, kind->name, ends[cell], end));
    }
    ++counts[std::size_t(kind - CellKinds().data())];
  }
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (Status status = Reserve(CellKinds()[i], counts[i]); !status.ok()) return status;
  }
  return end;
}

Status MeshBuilder::Reserve(const CellKind& kind, std::int64_t cells) {
  std::vector<PointNumber> points(std::size_t(kind.points));
  std::iota(points.begin(), points.end(), 0U);
  std::vector<Tetrahedron> parts;
  SplitCell(kind, points, parts);
  Mesh& mesh = result_.mesh;
  reserved_ += cells * std::int64_t(parts.size());
  if (reserved_ > kMaxTetrahedra) {
    return Status::ResourceExhausted(
        fmt::format("{}: with its cells the grid has {} tetrahedra, must be at most {}", where_, reserved_, kMaxTetrahedra));
  }
  const std::size_t needed = std::size_t(reserved_) - (result_.spool ? std::size_t(result_.spool->cells.size()) : 0);
  if (needed <= mesh.tetrahedra.capacity()) return Status::Ok();
  // More than is needed, if pieces follow each other.
  const std::size_t count = std::max(needed, mesh.tetrahedra.size() * 3 / 2);
  const Status status = CheckFitsMemory(std::int64_t(count * (sizeof(Tetrahedron) + sizeof(float))), where_ + ": tetrahedra of its cells");
  if (!status.ok()) return status;
  mesh.tetrahedra.reserve(count);
  if (mesh.at == ValuesAt::kCells) mesh.values.reserve(count);
  return Status::Ok();
}

Status MeshBuilder::AddCells(const WholeNumbers& kinds, const WholeNumbers& corners) {
  Mesh& mesh = result_.mesh;
  std::vector<Tetrahedron>& tetrahedra = mesh.tetrahedra;
  std::vector<PointNumber> of_cell;
  const std::int64_t* corner = corners.data();
  for (const std::int64_t type : kinds) {
    const std::size_t cell = next_++, begin = tetrahedra.size();
    const CellKind& kind = *FindCellKind(int(type));
    bool left_out = !piece_.cells_out.empty() && piece_.cells_out[cell];
    of_cell.clear();
    for (const std::int64_t* const end = corner + kind.points; corner != end; ++corner) {
      if (*corner < 0 || *corner >= std::int64_t(numbers_.size())) {
        return Damaged(fmt::format("cell {} has point {}, must be in [0, {})", cell, *corner, numbers_.size()));
      }
      left_out = left_out || (!piece_.points_out.empty() && piece_.points_out[std::size_t(*corner)]);
      of_cell.push_back(numbers_[std::size_t(*corner)]);
    }
    if (left_out) {
      ++left_out_;
      continue;
    }
    ++counts_[std::size_t(&kind - CellKinds().data())];
    SplitCell(kind, of_cell, tetrahedra);
    // A cell with a point twice, as some grids have at their poles, makes parts without a volume.
    const auto flat = [](const Tetrahedron& t) {
      return t[0] == t[1] || t[0] == t[2] || t[0] == t[3] || t[1] == t[2] || t[1] == t[3] || t[2] == t[3];
    };
    tetrahedra.erase(std::remove_if(tetrahedra.begin() + std::ptrdiff_t(begin), tetrahedra.end(), flat), tetrahedra.end());
    if (mesh.at == ValuesAt::kCells) mesh.values.resize(tetrahedra.size(), ValueOf(cell));
  }
  return Status::Ok();
}

Status MeshBuilder::EndPiece() {
  auto& [info, bounds, mesh, spool] = result_;
  const AlignedVector<MeshPoint>& points = points_.held();
  for (std::size_t i = counted_ - (points_.size() - points.size()); i < points.size(); ++i, ++counted_) {
    for (int axis = 0; axis < 3; ++axis) {
      const double place = points[i][std::size_t(axis)];
      bounds.low[axis] = counted_ == 0 ? place : std::min(bounds.low[axis], place);
      bounds.high[axis] = counted_ == 0 ? place : std::max(bounds.high[axis], place);
    }
  }
  if (spill_ == nullptr) return Status::Ok();
  if (!spool) {
    constexpr std::uint64_t kBytesACell = sizeof(Tetrahedron) + sizeof(float);
    if (points.size() * kBytesPerMeshPoint + mesh.tetrahedra.size() * kBytesACell <= spill_->most_bytes) return Status::Ok();
    Result<CellSpool> begun = spill_->begin();
    if (!begun.ok()) return begun.status();
    spool = std::make_shared<CellSpool>(*std::move(begun));
  }
  if (Status status = points_.MoveTo(spool->points); !status.ok()) return status;
  if (Status status = spool->cells.Append(std::span<const Tetrahedron>(mesh.tetrahedra)); !status.ok()) return status;
  if (mesh.at == ValuesAt::kCells) {
    if (Status status = spool->values.Append(std::span<const float>(mesh.values)); !status.ok()) return status;
  }
  reserved_ = std::int64_t(spool->cells.size());
  mesh.tetrahedra.clear();
  mesh.values.clear();
  return Status::Ok();
}

Result<LoadedMesh> MeshBuilder::Finish(const std::string& path) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  if (Status status = EndPiece(); !status.ok()) return status;
  auto& [info, bounds, mesh, spool] = result_;
  const std::string left_out = fmt::format("{} cells are left out, which the file calls ghosts, refined or hidden", left_out_);
  if (left_out_ > 0) info.notes.push_back(left_out);
  if (mesh.tetrahedra.empty() && (!spool || spool->cells.size() == 0))
    return wrong("has no cells with a volume" + (left_out_ > 0 ? "; " + left_out : ""));
  piece_ = {};
  numbers_ = {};
  const AlignedVector<MeshPoint>& points = points_.held();
  info.points = std::int64_t(points_.size());
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    info.cells += counts_[i];
    if (counts_[i] > 0) info.kinds.push_back({&CellKinds()[i], counts_[i]});
  }
  const Vec3 extent = bounds.high - bounds.low;
  for (const Axis axis : kAxes) {
    if (extent[axis] >= kLeastExtent && extent[axis] <= kMostExtent) continue;
    return wrong(
        fmt::format("its points reach over {} along {}, must be in [{}, {}]", extent[axis], Letter(axis), kLeastExtent, kMostExtent));
  }
  if (spool) {
    for (const Status& status : {spool->points.Flush(), spool->cells.Flush(), spool->values.Flush()}) {
      if (!status.ok()) return status;
    }
    return std::move(result_);
  }
  const auto bytes = std::int64_t(points.size() * (sizeof(mesh.points[0]) + sizeof(float)));
  if (Status status = CheckFitsMemory(bytes, path + ": its points"); !status.ok()) return status;
  mesh.points.reserve(points.size());
  if (mesh.at == ValuesAt::kPoints) mesh.values.reserve(points.size());
  for (const auto& [x, y, z, value] : points) {
    mesh.points.push_back({float(x - bounds.low.x), float(y - bounds.low.y), float(z - bounds.low.z)});
    if (mesh.at == ValuesAt::kPoints) mesh.values.push_back(float(value));
  }
  return std::move(result_);
}

}  // namespace slabstream
