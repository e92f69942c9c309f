#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <span>
#include <utility>

#include "common/base/parse_number.h"
#include "common/volume/memory_budget.h"
#include "common/volume_io/mesh_reader.h"
#include "common/volume_io/text_header.h"
#include "common/volume_io/vtk_xml.h"

namespace slabstream {
namespace {

template <class T>
std::span<const T> As(const AlignedVector<std::byte>& bytes) {
  return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
}

class Reader {
 public:
  Reader(const std::string& path, const MeshOptions& options, VtkXmlFile file) : path_(path), options_(options), file_(std::move(file)) {}

  Result<LoadedMesh> Read();

 private:
  Result<std::int64_t> Count(const std::string& attribute, std::int64_t most) const;
  Result<const VtkArray*> Find(const char* section, const std::string& name) const;
  Status ListArrays();
  Status ChooseArray();
  // Samples of an array as they are in the file. The array has `components` of each of `tuples`.
  Result<AlignedVector<std::byte>> Samples(const VtkArray& array, const VtkArrayType& type, std::int64_t tuples) const;
  // The same, converted.
  template <class T>
  Result<AlignedVector<T>> Numbers(const VtkArray& array, const VtkArrayType& type, std::int64_t tuples) const;
  template <class T>
  Result<AlignedVector<T>> WholeNumbers(const char* name, std::int64_t tuples) const;
  Status ReadPoints();
  // Takes memory for what the cells of info.kinds make.
  Status ReserveTetrahedra();
  // The tetrahedra, and of each the number of its cell.
  Status ReadCells();
  Status ReadValues();

  const std::string& path_;
  const MeshOptions& options_;
  const VtkXmlFile file_;
  LoadedMesh result_;
  std::vector<const VtkArray*> listed_;  // those of info.arrays
  std::vector<std::uint32_t> cells_;     // by tetrahedron
};

Result<std::int64_t> Reader::Count(const std::string& attribute, std::int64_t most) const {
  const std::string text = file_.piece().Attribute(attribute);
  const std::int64_t count = ParseNumber<std::int64_t>(text).value_or(-1);
  if (count >= 1 && count <= most) return count;
  return file_.Wrong(fmt::format("{} is '{}', must be a whole number in [1, {}]", attribute, text, most));
}

Result<const VtkArray*> Reader::Find(const char* section, const std::string& name) const {
  for (const VtkArray& array : file_.arrays()) {
    if (array.section == section && (name.empty() || array.name() == name)) return &array;
  }
  return file_.Wrong(fmt::format("has no array {} in {}", name, section));
}

Result<AlignedVector<std::byte>> Reader::Samples(const VtkArray& array, const VtkArrayType& type, std::int64_t tuples) const {
  const std::int64_t samples = tuples * type.components;
  if (Status status = file_.CheckHolds(array, type.type, samples); !status.ok()) return status;
  const std::int64_t bytes = samples * std::int64_t(BytesPerSample(type.type));
  if (Status status = CheckFitsMemory(2 * bytes, fmt::format("{}: array {}", path_, array.name())); !status.ok()) return status;
  AlignedVector<std::byte> out(static_cast<std::size_t>(bytes));
  if (Status status = file_.ReadSamples(array, type.type, out); !status.ok()) return status;
  return out;
}

template <class T>
Result<AlignedVector<T>> Reader::Numbers(const VtkArray& array, const VtkArrayType& type, std::int64_t tuples) const {
  const Result<AlignedVector<std::byte>> bytes = Samples(array, type, tuples);
  if (!bytes.ok()) return bytes.status();
  AlignedVector<T> out(std::size_t(tuples * type.components));
  VisitSampleType(type.type, [&]<class S>(const S*) {
    std::ranges::transform(As<S>(*bytes), out.begin(), [](S sample) { return static_cast<T>(sample); });
  });
  return out;
}

template <class T>
Result<AlignedVector<T>> Reader::WholeNumbers(const char* name, std::int64_t tuples) const {
  const Result<const VtkArray*> array = Find("Cells", name);
  if (!array.ok()) return array.status();
  const Result<VtkArrayType> type = file_.TypeOf(**array, 1);
  if (!type.ok()) return type.status();
  if (type->type == SampleType::kFloat32 || type->type == SampleType::kFloat64) {
    return file_.Wrong(fmt::format("array {} of Cells has no whole numbers", name));
  }
  return Numbers<T>(**array, *type, tuples);
}

Status Reader::ListArrays() {
  constexpr int kMostComponents = 1024;
  for (const VtkArray& array : file_.arrays()) {
    if (array.section != "PointData" && array.section != "CellData") continue;
    const Result<VtkArrayType> type = file_.TypeOf(array, kMostComponents);
    if (!type.ok()) return type.status();
    result_.info.arrays.push_back(
        {array.name(), array.section == "PointData" ? ValuesAt::kPoints : ValuesAt::kCells, type->type, type->components});
    listed_.push_back(&array);
  }
  return ChooseArray();
}

Status Reader::ChooseArray() {
  const std::vector<MeshArray>& arrays = result_.info.arrays;
  std::string names;
  std::vector<std::size_t> scalars, active;
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const MeshArray& array = arrays[i];
    if (!options_.array.empty() && array.name == options_.array) {
      if (array.components != 1) {
        return file_.Wrong(fmt::format("array {} has {} components, must have 1", array.name, array.components));
      }
      result_.info.array = i;
      return Status::Ok();
    }
    if (array.components != 1) continue;
    names.append(names.empty() ? "" : ", ").append(array.name);
    scalars.push_back(i);
    const std::string& chosen = file_.ActiveScalars(listed_[i]->section);
    if (!chosen.empty() && chosen == array.name) active.push_back(i);
  }
  if (!options_.array.empty()) return file_.Wrong(fmt::format("has no array '{}'; it has {}", options_.array, names));
  if (scalars.empty()) return file_.Wrong("has no array with one component, of points (PointData) or cells (CellData)");
  if (active.empty() && scalars.size() > 1) {
    return file_.Wrong(fmt::format("has several arrays and none is the active scalars; choose one by its name: {}", names));
  }
  result_.info.array = active.empty() ? scalars.front() : active.front();
  return Status::Ok();
}

Status Reader::ReadPoints() {
  const Result<const VtkArray*> array = Find("Points", "");
  if (!array.ok()) return array.status();
  const Result<VtkArrayType> type = file_.TypeOf(**array, 3);
  if (!type.ok()) return type.status();
  if (type->components != 3) return file_.Wrong(fmt::format("its points have {} components, must have 3", type->components));
  const Result<AlignedVector<double>> places = Numbers<double>(**array, *type, result_.info.points);
  if (!places.ok()) return places.status();
  Mesh& mesh = result_.mesh;
  const auto place = [&](std::size_t i) { return Vec3{(*places)[3 * i], (*places)[3 * i + 1], (*places)[3 * i + 2]}; };
  mesh.points.resize(std::size_t(result_.info.points));
  result_.bounds = {place(0), place(0)};
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Vec3 p = place(i);
    if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))) return file_.Wrong(fmt::format("point {} is not finite", i));
    for (int axis = 0; axis < 3; ++axis) {
      result_.bounds.low[axis] = std::min(result_.bounds.low[axis], p[axis]);
      result_.bounds.high[axis] = std::max(result_.bounds.high[axis], p[axis]);
    }
  }
  const Vec3 extent = result_.bounds.high - result_.bounds.low;
  constexpr double kMostExtent = 1e30;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(extent[axis] > 0 && extent[axis] <= kMostExtent)) {
      return file_.Wrong(fmt::format("its points reach over {} along {}, must be in (0, {}]", extent[axis],
                                     Letter(kAxes[std::size_t(axis)]), kMostExtent));
    }
  }
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Vec3 p = place(i) - result_.bounds.low;
    mesh.points[i] = {float(p.x), float(p.y), float(p.z)};
  }
  return Status::Ok();
}

Status Reader::ReserveTetrahedra() {
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

Status Reader::ReadCells() {
  MeshFileInfo& info = result_.info;
  const Result<AlignedVector<std::int64_t>> types = WholeNumbers<std::int64_t>("types", info.cells);
  const Result<AlignedVector<std::int64_t>> ends = WholeNumbers<std::int64_t>("offsets", info.cells);
  for (const auto* numbers : {&types, &ends}) {
    if (!numbers->ok()) return numbers->status();
  }
  // Count first: what is wrong with a cell is said before memory is taken for the points of all.
  std::vector<std::int64_t> counts(CellKinds().size());
  std::int64_t end = 0;
  for (std::size_t cell = 0; cell < types->size(); ++cell) {
    const std::int64_t type = (*types)[cell];
    const CellKind* const kind = type >= 0 && type < 256 ? FindCellKind(int(type)) : nullptr;
    if (kind == nullptr) {
      return file_.Wrong(
          fmt::format("cell {} has VTK's type {}; supported: tetrahedra (10), voxels (11), hexahedra (12), wedges (13) and "
                      "pyramids (14). ParaView's filter Tetrahedralize makes tetrahedra of others",
                      cell, type));
    }
    end += kind->points;
    if ((*ends)[cell] != end) {
      return file_.Damaged(fmt::format("the points of cell {}, a {}, end at {}, must end at {}", cell, kind->name, (*ends)[cell], end));
    }
    ++counts[std::size_t(kind - CellKinds().data())];
  }
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) info.kinds.push_back({&CellKinds()[i], counts[i]});
  }
  if (Status status = ReserveTetrahedra(); !status.ok()) return status;
  const Result<AlignedVector<std::int64_t>> numbers = WholeNumbers<std::int64_t>("connectivity", end);
  if (!numbers.ok()) return numbers.status();
  std::vector<Tetrahedron>& tetrahedra = result_.mesh.tetrahedra;
  std::int64_t begin = 0;
  std::vector<PointNumber> points;
  for (std::size_t cell = 0; cell < types->size(); ++cell) {
    const CellKind& kind = *FindCellKind(int((*types)[cell]));
    points.clear();
    for (; begin < (*ends)[cell]; ++begin) {
      const std::int64_t number = (*numbers)[std::size_t(begin)];
      if (number < 0 || number >= info.points) {
        return file_.Damaged(fmt::format("cell {} has point {}, must be in [0, {})", cell, number, info.points));
      }
      points.push_back(PointNumber(number));
    }
    const std::size_t first = tetrahedra.size();
    SplitCell(kind, points, tetrahedra);
    // A cell with a point twice, as some grids have at their poles, makes parts without a volume.
    const auto flat = [](const Tetrahedron& t) {
      return t[0] == t[1] || t[0] == t[2] || t[0] == t[3] || t[1] == t[2] || t[1] == t[3] || t[2] == t[3];
    };
    tetrahedra.erase(std::remove_if(tetrahedra.begin() + std::ptrdiff_t(first), tetrahedra.end(), flat), tetrahedra.end());
    cells_.resize(tetrahedra.size(), std::uint32_t(cell));
  }
  return tetrahedra.empty() ? file_.Wrong("has no cells with a volume") : Status::Ok();
}

Status Reader::ReadValues() {
  const MeshArray& chosen = result_.info.arrays[result_.info.array];
  Mesh& mesh = result_.mesh;
  mesh.at = chosen.at;
  const bool of_points = chosen.at == ValuesAt::kPoints;
  Result<AlignedVector<float>> values =
      Numbers<float>(*listed_[result_.info.array], {chosen.type, 1}, of_points ? result_.info.points : result_.info.cells);
  if (!values.ok()) return values.status();
  if (of_points) {
    mesh.values = *std::move(values);
    return Status::Ok();
  }
  mesh.values.resize(mesh.tetrahedra.size());
  std::ranges::transform(cells_, mesh.values.begin(), [&](std::uint32_t cell) { return (*values)[cell]; });
  return Status::Ok();
}

Result<LoadedMesh> Reader::Read() {
  MeshFileInfo& info = result_.info;
  info.format = "VTK unstructured grid";
  if (file_.pieces() != 1) return file_.Wrong(fmt::format("has {} pieces, must have 1", file_.pieces()));
  const Result<std::int64_t> points = Count("NumberOfPoints", kMaxMeshPoints), cells = Count("NumberOfCells", kMaxTetrahedra);
  for (const auto* count : {&points, &cells}) {
    if (!count->ok()) return count->status();
  }
  info.points = *points;
  info.cells = *cells;
  if (Status status = ListArrays(); !status.ok()) return status;
  if (Status status = ReadPoints(); !status.ok()) return status;
  if (Status status = ReadCells(); !status.ok()) return status;
  if (Status status = ReadValues(); !status.ok()) return status;
  return std::move(result_);
}

}  // namespace

bool LooksLikeMesh(const std::string& path) { return ToLower(path).ends_with(".vtu"); }

Result<LoadedMesh> ReadMesh(const std::string& path, const MeshOptions& options) {
  Result<VtkXmlFile> file = VtkXmlFile::Open(path, "UnstructuredGrid");
  if (!file.ok()) return file.status();
  return Reader(path, options, *std::move(file)).Read();
}

}  // namespace slabstream
