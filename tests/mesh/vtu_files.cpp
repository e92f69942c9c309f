#include "tests/mesh/vtu_files.h"

#include <fmt/format.h>

namespace slabstream {

FileBytes VtuFile(const VtuSpec& spec, const VtiOptions& options) {
  constexpr const char* kTypes[] = {"Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32", "Float64"};
  FileBytes text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{}\" header_type=\"{}\"{}>\n"
      "<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
      spec.big_endian ? "BigEndian" : "LittleEndian", options.wide_header ? "UInt64" : "UInt32",
      options.block > 0 ? " compressor=\"vtkZLibDataCompressor\"" : "", spec.points, spec.cells);
  const bool appended = options.format == "appended";
  FileBytes samples;
  for (const char* section : {"PointData", "CellData", "Points", "Cells"}) {
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
      text += "</DataArray>\n";
    }
    text += fmt::format("</{}>\n", section);
  }
  text += "</Piece>\n</UnstructuredGrid>\n";
  if (appended) text += "<AppendedData encoding=\"" + options.encoding + "\">\n  _" + samples + "\n</AppendedData>\n";
  return text + "</VTKFile>\n";
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

VtuSpec SmallGrid() {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},     {0, 0, 1},
                                    {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 2}, {2, 0, 0}};
  return GridSpec(points, {13, 13, 14, 10}, {{0, 1, 3, 4, 5, 7}, {1, 2, 3, 5, 6, 7}, {4, 5, 6, 7, 8}, {1, 9, 2, 5}});
}

}  // namespace slabstream
