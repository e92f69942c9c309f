#include "tests/data/volume_io/vtu_files.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>

namespace slabstream {

FileBytes VtuFile(const VtuSpec& spec, const VtiOptions& options) {
  constexpr const char* kTypes[] = {"Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32", "Float64"};
  const bool curvilinear = !spec.extent.empty();
  const std::string type = curvilinear ? "StructuredGrid" : "UnstructuredGrid";
  const std::string piece = curvilinear ? fmt::format("Extent=\"{}\"", spec.extent)
                                        : fmt::format("NumberOfPoints=\"{}\" NumberOfCells=\"{}\"", spec.points, spec.cells);
  FileBytes text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"{1}\" header_type=\"{2}\"{3}>\n"
      "<{0}>\n<Piece {4}>\n",
      type, spec.big_endian ? "BigEndian" : "LittleEndian", options.wide_header ? "UInt64" : "UInt32",
      options.block > 0 ? " compressor=\"vtk" + options.compressor + "DataCompressor\"" : "", piece);
  const bool appended = options.format == "appended";
  FileBytes samples;
  for (const char* section : {"PointData", "CellData", "Points", "Cells"}) {
    if (curvilinear && section == std::string("Cells")) continue;
    const std::string& scalars = section == std::string("PointData") ? spec.point_scalars : spec.cell_scalars;
    const bool has_scalars = std::string(section).ends_with("Data") && !scalars.empty();
    text += fmt::format("<{}{}>\n", section, has_scalars ? " Scalars=\"" + scalars + "\"" : "");
    for (const VtuArray& array : spec.arrays) {
      if (array.section != section) continue;
      const FileSpec file{.type = array.type, .big_endian = spec.big_endian};
      const FileBytes plain = options.format == "ascii" ? AsText(array.values) : EncodeSamples(array.type, array.values, spec.big_endian);
      const FileBytes stored = VtkXmlSamples(file, plain, options);
      text += fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"{}\"{}>", kTypes[int(array.type)],
                          array.name, array.components, options.format, appended ? fmt::format(" offset=\"{}\"", samples.size()) : "");
      if (appended) {
        samples += stored;
      } else {
        text += "\n" + stored + "\n";
      }
      if (array.components > 1) text += "<InformationKey name=\"L2_NORM_FINITE_RANGE\"><Value index=\"0\">1</Value></InformationKey>\n";
      text += "</DataArray>\n";
    }
    text += fmt::format("</{}>\n", section);
  }
  text += "</Piece>\n</" + type + ">\n";
  if (appended) text += "<AppendedData encoding=\"" + options.encoding + "\">\n  _" + samples + "\n</AppendedData>\n";
  return text + "</VTKFile>\n";
}

namespace {

class LegacyWriter {
 public:
  explicit LegacyWriter(const LegacyOptions& options) : options_(options) {
    const bool curvilinear = !options.dimensions.empty();
    text_ = fmt::format("# vtk DataFile Version {}\nwritten by a test\n{}\nDATASET {}\n", options.offsets ? "5.1" : "3.0",
                        options.binary ? "BINARY" : "ASCII", curvilinear ? "STRUCTURED_GRID" : "UNSTRUCTURED_GRID");
    if (curvilinear) Line("DIMENSIONS " + options.dimensions);
  }

  void Line(const std::string& line) { text_ += line + "\n"; }
  void Numbers(SampleType type, const std::vector<double>& values) {
    text_ += (options_.binary ? EncodeSamples(type, values, true) : AsText(values)) + "\n";
  }
  void Metadata() {
    if (options_.metadata) text_ += "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 1 2\n\n";
  }

  void Cells(const VtuSpec& spec) {
    std::vector<double> corners, ends, kinds;
    for (const VtuArray& array : spec.arrays) {
      if (array.section == "Cells") (array.name == "connectivity" ? corners : array.name == "offsets" ? ends : kinds) = array.values;
    }
    ends.insert(ends.begin(), 0);
    if (options_.offsets) {
      Line(fmt::format("CELLS {} {}\nOFFSETS vtktypeint64", ends.size(), corners.size()));
      Numbers(SampleType::kInt64, ends);
      Line("CONNECTIVITY vtktypeint64");
      Numbers(SampleType::kInt64, corners);
    } else {
      std::vector<double> counted;
      for (std::size_t cell = 0; cell + 1 < ends.size(); ++cell) {
        counted.push_back(ends[cell + 1] - ends[cell]);
        counted.insert(counted.end(), corners.begin() + std::ptrdiff_t(ends[cell]), corners.begin() + std::ptrdiff_t(ends[cell + 1]));
      }
      Line(fmt::format("CELLS {} {}", ends.size() - 1, counted.size()));
      Numbers(SampleType::kInt32, counted);
    }
    Line(fmt::format("CELL_TYPES {}", kinds.size()));
    Numbers(SampleType::kInt32, kinds);
  }

  void Data(const VtuSpec& spec, bool of_points) {
    std::vector<const VtuArray*> fields;
    const int elements = of_points ? spec.points : spec.cells;
    Line(fmt::format("{}_DATA {}", of_points ? "POINT" : "CELL", elements));
    for (const VtuArray& array : spec.arrays) {
      if (array.section != (of_points ? "PointData" : "CellData")) continue;
      if (array.name == (of_points ? spec.point_scalars : spec.cell_scalars)) {
        Line(fmt::format("SCALARS {} {} {}\nLOOKUP_TABLE default", array.name, LegacyType(array.type), array.components));
      } else if (array.components == 3) {
        Line(fmt::format("VECTORS {} {}", array.name, LegacyType(array.type)));
      } else {
        fields.push_back(&array);
        continue;
      }
      Numbers(array.type, array.values);
      Metadata();
    }
    if (!fields.empty()) Line(fmt::format("FIELD FieldData {}", fields.size()));
    for (const VtuArray* array : fields) {
      Line(fmt::format("{} {} {} {}", array->name, array->components, elements, LegacyType(array->type)));
      Numbers(array->type, array->values);
      Metadata();
    }
  }

  static const char* LegacyType(SampleType type) {
    constexpr const char* kTypes[] = {"char",         "unsigned_char", "short",         "unsigned_short", "int",
                                      "unsigned_int", "vtktypeint64",  "vtktypeuint64", "float",          "double"};
    return kTypes[int(type)];
  }

  const FileBytes& text() const { return text_; }

 private:
  LegacyOptions options_;
  FileBytes text_;
};

}  // namespace

FileBytes LegacyGridFile(const VtuSpec& spec, const LegacyOptions& options) {
  LegacyWriter writer(options);
  for (const VtuArray& array : spec.arrays) {
    if (array.section != "Points") continue;
    writer.Line(fmt::format("POINTS {} {}", spec.points, LegacyWriter::LegacyType(array.type)));
    writer.Numbers(array.type, array.values);
    writer.Metadata();
  }
  if (options.dimensions.empty()) writer.Cells(spec);
  writer.Data(spec, false);
  writer.Data(spec, true);
  return writer.text();
}

VtuSpec GridSpec(const std::vector<Vec3>& points, const std::vector<int>& types, const std::vector<std::vector<int>>& connectivity) {
  VtuArray values{"PointData", "height"}, numbers{"CellData", "number", SampleType::kInt16};
  VtuArray places{"Points", "Points", SampleType::kFloat64, 3};
  VtuArray corners{"Cells", "connectivity", SampleType::kInt64}, ends{"Cells", "offsets", SampleType::kInt64};
  VtuArray kinds{"Cells", "types", SampleType::kUint8};
  for (const Vec3& p : points) {
    values.values.push_back(p.x + 10 * p.y + 100 * p.z);
    places.values.insert(places.values.end(), {p.x, p.y, p.z});
  }
  for (std::size_t cell = 0; cell < types.size(); ++cell) {
    corners.values.insert(corners.values.end(), connectivity[cell].begin(), connectivity[cell].end());
    ends.values.push_back(double(corners.values.size()));
    kinds.values.push_back(types[cell]);
    numbers.values.push_back(double(cell));
  }
  return {.points = int(points.size()),
          .cells = int(types.size()),
          .arrays = {values, numbers, places, corners, ends, kinds},
          .point_scalars = "height"};
}

VtuSpec BoxOfHexahedra(const Index3& begin, const Index3& end, PlacePoint place) {
  std::vector<Vec3> points;
  std::vector<std::vector<int>> corners;
  const int row = end.x - begin.x + 1, layer = row * (end.y - begin.y + 1);
  for (int z = begin.z; z <= end.z; ++z) {
    for (int y = begin.y; y <= end.y; ++y) {
      for (int x = begin.x; x <= end.x; ++x) {
        const int n = int(points.size());
        points.push_back(place({double(x), double(y), double(z)}));
        if (x == end.x || y == end.y || z == end.z) continue;
        corners.push_back({n, n + 1, n + row + 1, n + row, n + layer, n + layer + 1, n + layer + row + 1, n + layer + row});
      }
    }
  }
  return GridSpec(points, std::vector<int>(corners.size(), 12), corners);
}

FileBytes VtkListFile(const std::string& type, const std::vector<std::string>& files) {
  const bool pieces = type.starts_with('P');
  FileBytes text =
      fmt::format("<?xml version=\"1.0\"?>\n<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"LittleEndian\">\n<{0}>\n", type);
  for (const std::string& file : files)
    text += fmt::format("<{} {}=\"{}\"/>\n", pieces ? "Piece" : "DataSet", pieces ? "Source" : "file", file);
  return text + fmt::format("</{}>\n</VTKFile>\n", type);
}

double VolumeOf(const Mesh& mesh) {
  double volume = 0;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    const auto place = [&](std::size_t i) { return Vec3{mesh.points[t[i]].x, mesh.points[t[i]].y, mesh.points[t[i]].z}; };
    volume += std::abs(Dot(place(1) - place(0), Cross(place(2) - place(0), place(3) - place(0)))) / 6;
  }
  return volume;
}

VtuSpec SmallGrid() {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},     {0, 0, 1},
                                    {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 2}, {2, 0, 0}};
  return GridSpec(points, {13, 13, 14, 10}, {{0, 1, 3, 4, 5, 7}, {1, 2, 3, 5, 6, 7}, {4, 5, 6, 7, 8}, {1, 9, 2, 5}});
}

}  // namespace slabstream
