// Unstructured grids in VTK's XML files (.vtu): one piece (vtk_xml.h).
#include <fmt/format.h>

#include <utility>

#include "common/base/parse_number.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/mesh_builder.h"
#include "data/volume_io/mesh_formats.h"
#include "data/volume_io/vtk_xml.h"

namespace slabstream {
namespace {

class XmlGridReader {
 public:
  XmlGridReader(const std::string& path, VtkXmlFile file) : path_(path), file_(std::move(file)), builder_(path, "VTK unstructured grid") {}

  Result<LoadedMesh> Read(const MeshOptions& options);

 private:
  Result<std::int64_t> Count(const std::string& attribute, std::int64_t most) const;
  Result<const VtkArray*> Find(const char* section, const std::string& name) const;
  // The numbers of an array that has type.components of each of `tuples`.
  template <class T>
  Result<AlignedVector<T>> Numbers(const VtkArray& array, const VtkArrayType& type, std::int64_t tuples) const;
  Result<AlignedVector<std::int64_t>> OfCells(const char* name, std::int64_t tuples) const;
  Status ReadPoints(std::int64_t points);
  Status ReadCells(std::int64_t cells);

  const std::string& path_;
  const VtkXmlFile file_;
  MeshBuilder builder_;
};

Result<std::int64_t> XmlGridReader::Count(const std::string& attribute, std::int64_t most) const {
  const std::string text = file_.piece().Attribute(attribute);
  const std::int64_t count = ParseNumber<std::int64_t>(text).value_or(-1);
  if (count >= 1 && count <= most) return count;
  return file_.Wrong(fmt::format("{} is '{}', must be a whole number in [1, {}]", attribute, text, most));
}

Result<const VtkArray*> XmlGridReader::Find(const char* section, const std::string& name) const {
  for (const VtkArray& array : file_.arrays()) {
    if (array.section == section && (name.empty() || array.name() == name)) return &array;
  }
  return file_.Wrong(fmt::format("has no array {} in {}", name, section));
}

template <class T>
Result<AlignedVector<T>> XmlGridReader::Numbers(const VtkArray& array, const VtkArrayType& type, std::int64_t tuples) const {
  const std::int64_t samples = tuples * type.components;
  if (Status status = file_.CheckHolds(array, type.type, samples); !status.ok()) return status;
  const std::int64_t bytes = samples * std::int64_t(BytesPerSample(type.type));
  if (Status status = CheckFitsMemory(bytes + samples * std::int64_t(sizeof(T)), fmt::format("{}: array {}", path_, array.name()));
      !status.ok())
    return status;
  AlignedVector<std::byte> read(static_cast<std::size_t>(bytes));
  if (Status status = file_.ReadSamples(array, type.type, read); !status.ok()) return status;
  return Converted<T>(type.type, read);
}

Result<AlignedVector<std::int64_t>> XmlGridReader::OfCells(const char* name, std::int64_t tuples) const {
  const Result<const VtkArray*> array = Find("Cells", name);
  if (!array.ok()) return array.status();
  const Result<VtkArrayType> type = file_.TypeOf(**array, 1);
  if (!type.ok()) return type.status();
  if (type->type == SampleType::kFloat32 || type->type == SampleType::kFloat64) {
    return file_.Wrong(fmt::format("array {} of Cells has no whole numbers", name));
  }
  return Numbers<std::int64_t>(**array, *type, tuples);
}

Status XmlGridReader::ReadPoints(std::int64_t points) {
  const Result<const VtkArray*> array = Find("Points", "");
  if (!array.ok()) return array.status();
  const Result<VtkArrayType> type = file_.TypeOf(**array, 3);
  if (!type.ok()) return type.status();
  if (type->components != 3) return file_.Wrong(fmt::format("its points have {} components, must have 3", type->components));
  const Result<AlignedVector<double>> places = Numbers<double>(**array, *type, points);
  return places.ok() ? builder_.SetPoints(*places) : places.status();
}

Status XmlGridReader::ReadCells(std::int64_t cells) {
  const Result<AlignedVector<std::int64_t>> kinds = OfCells("types", cells), ends = OfCells("offsets", cells);
  for (const auto* numbers : {&kinds, &ends}) {
    if (!numbers->ok()) return numbers->status();
  }
  const Result<std::int64_t> count = builder_.SetCells(*kinds, *ends);
  if (!count.ok()) return count.status();
  const Result<AlignedVector<std::int64_t>> corners = OfCells("connectivity", *count);
  return corners.ok() ? builder_.SetCorners(*corners) : corners.status();
}

Result<LoadedMesh> XmlGridReader::Read(const MeshOptions& options) {
  constexpr int kMostComponents = 1024;
  if (file_.pieces() != 1) return file_.Wrong(fmt::format("has {} pieces, must have 1", file_.pieces()));
  const Result<std::int64_t> points = Count("NumberOfPoints", kMaxMeshPoints), cells = Count("NumberOfCells", kMaxTetrahedra);
  for (const auto* count : {&points, &cells}) {
    if (!count->ok()) return count->status();
  }
  std::vector<const VtkArray*> listed;
  for (const VtkArray& array : file_.arrays()) {
    if (array.section != "PointData" && array.section != "CellData") continue;
    const Result<VtkArrayType> type = file_.TypeOf(array, kMostComponents);
    if (!type.ok()) return type.status();
    const std::string& active = file_.ActiveScalars(array.section);
    const ValuesAt at = array.section == "PointData" ? ValuesAt::kPoints : ValuesAt::kCells;
    builder_.AddArray({array.name(), at, type->type, type->components}, !active.empty() && active == array.name());
    listed.push_back(&array);
  }
  const Result<std::size_t> chosen = builder_.ChooseArray(options);
  if (!chosen.ok()) return chosen.status();
  if (options.headers_only) return builder_.Take();
  if (Status status = ReadPoints(*points); !status.ok()) return status;
  if (Status status = ReadCells(*cells); !status.ok()) return status;
  const VtkArray& array = *listed[*chosen];
  Result<AlignedVector<float>> values =
      Numbers<float>(array, *file_.TypeOf(array, kMostComponents), array.section == "PointData" ? *points : *cells);
  if (!values.ok()) return values.status();
  builder_.SetValues(*std::move(values));
  return builder_.Take();
}

}  // namespace

Result<LoadedMesh> ReadVtkXmlGrid(const std::string& path, const MeshOptions& options) {
  Result<VtkXmlFile> file = VtkXmlFile::Open(path, "UnstructuredGrid");
  if (!file.ok()) return file.status();
  return XmlGridReader(path, *std::move(file)).Read(options);
}

}  // namespace slabstream
