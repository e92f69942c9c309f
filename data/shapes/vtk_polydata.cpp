// Polydata of VTK, in legacy (.vtk) and in XML files (.vtp): polygons and strips of triangles, else lines, else points.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "common/text/parse_number.h"
#include "data/shapes/shape_formats.h"
#include "data/volume_io/text_cursor.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/vtk_legacy_file.h"
#include "data/volume_io/vtk_xml.h"

namespace slabstream {
namespace {

using WholeArray = AlignedVector<std::int64_t>;

struct Cells {
  WholeArray ends, corners;  // where each cell ends among the corners of all
};

enum CellKind : std::size_t { kVertices, kLines, kPolygons, kStrips, kCellKinds };  // as kPolydataCells

constexpr std::string_view kType = "PolyData";

// A piece of a file: the only one of a legacy file.
class LegacyPiece {
 public:
  explicit LegacyPiece(VtkLegacyFile& file) : file_(file), offered_(file.Offered()) {}

  Result<AlignedVector<double>> Places() const {
    const Result<VtkLegacyArray> array = file_.Own("POINTS");
    return array.ok() ? file_.ReadNumbers<double>(*array) : array.status();
  }
  bool floats() const { return file_.Own("POINTS")->type == SampleType::kFloat32; }
  const std::vector<GridArray>& arrays() const { return offered_.arrays; }
  Result<AlignedVector<float>> Read(std::size_t number) const { return file_.ReadNumbers<float>(file_.arrays()[offered_.numbers[number]]); }

  Result<Cells> ReadCells(CellKind kind) const {
    const std::string name(kPolydataCells[kind]);
    if (file_.Own(name + " OFFSETS").ok()) {
      Result<WholeArray> ends = ReadWhole(name + " OFFSETS"), corners = ReadWhole(name + " CONNECTIVITY");
      if (!ends.ok() || !corners.ok()) return ends.ok() ? corners.status() : ends.status();
      if (!ends->empty()) ends->erase(ends->begin());  // 0, where the first cell begins
      return Cells{*std::move(ends), *std::move(corners)};
    }
    if (!file_.Own(name).ok()) return Cells();
    const Result<WholeArray> numbers = ReadWhole(name);
    if (!numbers.ok()) return numbers.status();
    Cells cells;
    for (std::size_t at = 0; at < numbers->size();) {
      const std::int64_t count = (*numbers)[at++];
      if (count < 0 || count > std::int64_t(numbers->size() - at))
        return file_.Damaged(
            fmt::format("cell {} of {} has {} points, {} numbers are left", cells.ends.size(), name, count, numbers->size() - at));
      cells.corners.insert(cells.corners.end(), numbers->data() + at, numbers->data() + at + std::size_t(count));
      cells.ends.push_back(std::int64_t(cells.corners.size()));
      at += std::size_t(count);
    }
    return cells;
  }

 private:
  Result<WholeArray> ReadWhole(const std::string& name) const {
    const Result<VtkLegacyArray> array = file_.Own(name);
    return array.ok() ? file_.ReadNumbers<std::int64_t>(*array) : array.status();
  }

  VtkLegacyFile& file_;
  const OfferedArrays offered_;
};

class XmlPiece {
 public:
  XmlPiece(const VtkXmlFile& file, std::size_t number) : file_(file), number_(number), offered_(file.Offered()) {}

  Result<AlignedVector<double>> Places() const { return ReadAll<double>("Points", "", 3, Count("NumberOfPoints")); }
  bool floats() const { return file_.TypeOf(**file_.Find(number_, "Points", ""), 3)->type == SampleType::kFloat32; }
  const std::vector<GridArray>& arrays() const { return offered_.arrays; }
  Result<AlignedVector<float>> Read(std::size_t number) const {
    return ReadAll<float>("PointData", arrays()[number].name, arrays()[number].components, Count("NumberOfPoints"));
  }

  Result<Cells> ReadCells(CellKind kind) const {
    constexpr std::array<const char*, kCellKinds> kSections = {"Verts", "Lines", "Polys", "Strips"};
    const std::string section = kSections[kind];
    const Result<std::int64_t> count = Count("NumberOf" + section);
    if (!count.ok() || *count == 0) return count.ok() ? Result(Cells()) : count.status();
    Result<WholeArray> ends = ReadAll<std::int64_t>(section, "offsets", 1, *count);
    if (!ends.ok()) return ends.status();
    Result<WholeArray> corners = ReadAll<std::int64_t>(section, "connectivity", 1, std::max<std::int64_t>(ends->back(), 0));
    if (!corners.ok()) return corners.status();
    return Cells{*std::move(ends), *std::move(corners)};
  }

 private:
  Result<std::int64_t> Count(const std::string& attribute) const {
    const std::string text = file_.pieces()[number_].Attribute(attribute);
    const std::int64_t count = text.empty() ? 0 : ParseNumber<std::int64_t>(text).value_or(-1);
    if (count >= 0 && count <= kMaxShapeVertices) return count;
    return file_.Wrong(fmt::format("{} is '{}', must be a whole number in [0, {}]", attribute, text, kMaxShapeVertices));
  }

  template <class T>
  Result<AlignedVector<T>> ReadAll(const std::string& section, const std::string& name, int components,
                                   const Result<std::int64_t>& tuples) const {
    if (!tuples.ok()) return tuples.status();
    const Result<const VtkArray*> array = file_.Find(number_, section, name);
    if (!array.ok()) return array.status();
    const Result<VtkArrayType> type = file_.TypeOf(**array, components);
    if (!type.ok()) return type.status();
    if (type->components == components) return file_.ReadNumbers<T>(**array, type->type, *tuples * components);
    return file_.Wrong(fmt::format("array {} of {} has {} components, must have {}", name, section, type->components, components));
  }

  const VtkXmlFile& file_;
  const std::size_t number_;
  const OfferedArrays offered_;
};

template <class Piece>
class PieceReader {
 public:
  PieceReader(const Piece& piece, ShapeBuilder& builder) : piece_(piece), builder_(builder) {}

  Status Read() {
    auto places = piece_.Places();
    if (!places.ok()) return places.status();
    places_ = *std::move(places);
    if (piece_.floats()) builder_.SetFloats();
    if (Status status = ReadArrays(); !status.ok()) return status;
    std::array<Cells, kCellKinds> cells;
    for (std::size_t kind = 0; kind < kCellKinds; ++kind) {
      Result<Cells> read = piece_.ReadCells(CellKind(kind));
      if (!read.ok()) return read.status();
      cells[kind] = *std::move(read);
      if (Status status = Check(cells[kind], CellKind(kind)); !status.ok()) return status;
    }
    const bool mesh = !cells[kPolygons].ends.empty() || !cells[kStrips].ends.empty();
    if (mesh || (cells[kLines].ends.empty() && cells[kVertices].ends.empty())) {
      const auto base = std::int64_t(builder_.vertices());
      builder_.Expect(points(), 0);
      for (std::size_t point = 0; point < points(); ++point) AddVertex(point);
      ForEach(cells[kPolygons], [&](std::span<const std::int64_t> corners) { builder_.AddPolygon(corners, base); });
      ForEach(cells[kStrips], [&](std::span<const std::int64_t> corners) { builder_.AddStrip(corners, base); });
      return Status::Ok();
    }
    const bool lines = !cells[kLines].ends.empty();
    ForEach(cells[lines ? kLines : kVertices], [&](std::span<const std::int64_t> corners) {
      for (const std::int64_t point : corners) AddVertex(std::size_t(point));
      if (lines) builder_.EndLine();
    });
    return Status::Ok();
  }

 private:
  std::size_t points() const { return places_.size() / 3; }

  // What of the points' arrays a shape has: three components that are called normals, colours as bytes, radii; and the active scalars, or
  // else the first array with one component that is not VTK's own.
  Status ReadArrays() {
    std::array<std::optional<std::size_t>, kVertexColumns> chosen;
    for (std::size_t i = 0; i < piece_.arrays().size(); ++i) {
      const GridArray& array = piece_.arrays()[i];
      if (array.at != ValuesAt::kPoints || !array.type) continue;
      const std::string name = ToLower(array.name);
      const auto take = [&](VertexColumn column) {
        if (!chosen[column]) chosen[column] = i;
      };
      if (array.components == 3 && name.find("normal") != std::string::npos) take(kNormalX);
      if ((array.components == 3 || array.components == 4) && *array.type == SampleType::kUint8) take(kRed);
      if (array.components != 1 || name.starts_with("vtk")) continue;
      if (name.find("radius") != std::string::npos) {
        take(kRadius);
      } else if (array.active) {
        chosen[kValue] = i;
      } else {
        take(kValue);
      }
    }
    builder_.HasOnlyPlaces();
    builder_.SetFullChannel(255);
    for (const VertexColumn column : {kNormalX, kRed, kValue, kRadius}) {
      if (!chosen[column]) continue;
      auto read = piece_.Read(*chosen[column]);
      if (!read.ok()) return read.status();
      const auto components = std::size_t(piece_.arrays()[*chosen[column]].components);
      if (read->size() != points() * components) {
        return Status::DataLoss(fmt::format("array {} has {} numbers, must have {}", piece_.arrays()[*chosen[column]].name, read->size(),
                                            points() * components));
      }
      builder_.Has(column);
      if (column == kRed && components == 4) builder_.Has(kAlpha);
      columns_.push_back({column, components, *std::move(read)});
    }
    return Status::Ok();
  }

  Status Check(const Cells& cells, CellKind kind) const {
    std::int64_t begin = 0;
    for (const std::int64_t end : cells.ends) {
      if (end < begin || end > std::int64_t(cells.corners.size()))
        return Status::DataLoss(
            fmt::format("a cell of {} ends at {}, must be in [{}, {}]", kPolydataCells[kind], end, begin, cells.corners.size()));
      begin = end;
    }
    for (const std::int64_t corner : cells.corners) {
      if (corner < 0 || corner >= std::int64_t(points()))
        return Status::DataLoss(fmt::format("a cell of {} has point {}, must be in [0, {})", kPolydataCells[kind], corner, points()));
    }
    return Status::Ok();
  }

  template <class Function>
  void ForEach(const Cells& cells, Function&& function) {
    std::size_t begin = 0;
    for (const std::int64_t end : cells.ends) {
      function(std::span(cells.corners).subspan(begin, std::size_t(end) - begin));
      begin = std::size_t(end);
    }
  }

  void AddVertex(std::size_t point) {
    VertexRow row{};
    std::copy_n(places_.begin() + std::ptrdiff_t(3 * point), 3, row.begin() + kX);
    for (const Column& each : columns_)
      std::copy_n(each.numbers.begin() + std::ptrdiff_t(each.components * point), each.components, row.begin() + each.column);
    builder_.AddVertex(row);
  }

  struct Column {
    VertexColumn column = kX;  // the first one
    std::size_t components = 1;
    AlignedVector<float> numbers;
  };

  const Piece& piece_;
  ShapeBuilder& builder_;
  AlignedVector<double> places_;
  std::vector<Column> columns_;
};

Status ReadLegacyPolydata(const std::string& path, ShapeBuilder& builder) {
  Result<VtkLegacyFile> file = VtkLegacyFile::Open(path, {"POLYDATA"});
  if (!file.ok()) return file.status();
  TextCursor cursor(path);
  cursor.Line();
  if (SaysLps(cursor.Line().value_or(""))) builder.SetLps();
  const LegacyPiece piece(*file);
  return PieceReader(piece, builder).Read();
}

Status ReadXmlPolydata(const std::string& path, ShapeBuilder& builder) {
  const Result<VtkXmlFile> file = VtkXmlFile::Open(path, kType, {});
  if (!file.ok()) return file.status();
  // 3D Slicer states the axes as an array of the dataset.
  constexpr std::string_view kLps = {"LPS", 4};
  if (const Result<const VtkArray*> space = file->Find(0, "FieldData", "SPACE"); space.ok()) {
    const auto letters = file->ReadNumbers<char>(**space, SampleType::kInt8, std::int64_t(kLps.size()));
    if (letters.ok() && std::ranges::equal(*letters, kLps)) builder.SetLps();
  }
  for (std::size_t number = 0; number < file->pieces().size(); ++number) {
    const XmlPiece piece(*file, number);
    if (Status status = PieceReader(piece, builder).Read(); !status.ok()) return status;
  }
  return Status::Ok();
}

}  // namespace

void ReadVtkPolydata(const std::string& path, ShapeBuilder& builder) {
  builder.Fail(ToLower(path).ends_with(".vtp") ? ReadXmlPolydata(path, builder) : ReadLegacyPolydata(path, builder));
}

}  // namespace slabstream
