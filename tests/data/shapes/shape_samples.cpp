#include "tests/data/shapes/shape_samples.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "common/base/check.h"
#include "tests/data/codecs/packed_bytes.h"

namespace slabstream {
namespace {

using Int = std::int32_t;

std::string TextPly() {
  return "ply\nformat ascii 1.0\ncomment SPACE=LPS\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
         "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
         "property uchar alpha\nproperty float quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0 0 0 1 255 0 1 255 0.5\n1 0 0 0 2 0 0 128 0 7 nan\n1 1.5 0 1 0 0 0 0 0 0 -1\n0 1 3 0 0 0 1 2 3 4 7\n4 0 1 2 3\n";
}

std::string BinaryPly(bool big) {
  return fmt::format(
             "ply\nformat binary_{}_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
             "property list uchar short unknown\nelement face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\nend_header\n",
             big ? "big" : "little") +
         NumberBytes<double>({1e7, 2, 3}, big) + '\0' + NumberBytes<double>({1e7 + 0.125, 2, 3}, big) + '\1' +
         NumberBytes<short>({7}, big) + NumberBytes<double>({1e7, 2.5, 3}, big) + '\0' + "\7\3" +
         NumberBytes<std::uint32_t>({2, 1, 0}, big);
}

std::string BinaryStl() {
  std::string bytes = "solid by 3D Slicer SPACE=LPS";
  bytes.resize(80, ' ');
  bytes += NumberBytes<std::uint32_t>({2});
  for (const auto& corners :
       {NumberBytes<float>({0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0}), NumberBytes<float>({0, 0, 0, 1, -0.0F, 0, 1, 2, 0, 0, 2, 0})})
    bytes += corners + NumberBytes<std::uint16_t>({0});
  return bytes;
}

std::string TextStl() {
  const std::string facet = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1e0 0 0\n  VERTEX 0 +1 0\n endloop\nendfacet\n";
  return "solid vertex of mine\n" + facet + facet + "endsolid vertex of mine\n";
}

std::string Obj() {
  return "# SPACE=LPS\nv 1 2 3 1 0.5 0\nv 2 2 3 0 0 0\nv 2 3 3 0 0 1\nv 1 3 3 1 1 1\nvn 0 0 2\nvt 0 0\nvn 1 0 0\n"
         "f 1//1 2//1 3//1 4//1\nf -4/1/-1 -3/1/-1 -2/1/-1\n";
}

// A triangle with everything under two nodes, and a strip that a node mirrors.
std::string Glb() {
  const std::string binary =
      NumberBytes<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) + NumberBytes<float>({0, 0, 1, 0, 0, 1, 1, 0, 0}) +
      NumberBytes<std::uint8_t>({255, 0, 0, 255, 0, 255, 0, 128, 0, 0, 51, 0}) + NumberBytes<std::uint16_t>({0, 1, 2, 0}) +
      NumberBytes<float>({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0}) + NumberBytes<std::uint32_t>({0, 1, 2, 3});
  return GlbFile(
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,2]}],
          "nodes":[{"translation":[10,0,0],"rotation":[0,0,0.7071067811865476,0.7071067811865476],"scale":[2,2,2],"children":[1]},
                   {"mesh":0,"translation":[1,0,0]},{"mesh":1,"matrix":[-1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]}],
          "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"COLOR_0":2},"indices":3}]},
                    {"primitives":[{"attributes":{"POSITION":4},"indices":5,"mode":5}]}],
          "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
                       {"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"},
                       {"bufferView":1,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"},
                       {"bufferView":2,"componentType":5123,"count":3,"type":"SCALAR"},
                       {"bufferView":3,"componentType":5126,"count":4,"type":"VEC3"},
                       {"bufferView":4,"componentType":5125,"count":4,"type":"SCALAR"}],
          "bufferViews":[{"buffer":0,"byteLength":72},{"buffer":0,"byteOffset":72,"byteLength":12},
                         {"buffer":0,"byteOffset":84,"byteLength":8},{"buffer":0,"byteOffset":92,"byteLength":64,"byteStride":16},
                         {"buffer":0,"byteOffset":156,"byteLength":16}],
          "buffers":[{"byteLength":172}]})",
      binary);
}

// Of a mesh with a square and a strip: with the numbers of corners among them, or since version 5 with offsets.
std::string LegacyMesh(bool offsets, bool binary) {
  std::string file = fmt::format("# vtk DataFile Version {}\nmade by hand; SPACE=LPS\n{}\nDATASET POLYDATA\nPOINTS 5 float\n",
                                 offsets ? "5.1" : "3.0", binary ? "BINARY" : "ASCII");
  const auto ints = [&](std::initializer_list<Int> numbers) {
    if (binary) return NumberBytes(numbers, true) + "\n";
    return fmt::format("{}\n", fmt::join(numbers, " "));
  };
  const auto floats = [&](std::initializer_list<float> numbers) {
    if (binary) return NumberBytes(numbers, true) + "\n";
    return fmt::format("{}\n", fmt::join(numbers, " "));
  };
  file += floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 1});
  if (offsets) {
    file += "POLYGONS 2 4\nOFFSETS int\n" + ints({0, 4}) + "CONNECTIVITY int\n" + ints({0, 1, 2, 3});
    file += "TRIANGLE_STRIPS 2 4\nOFFSETS int\n" + ints({0, 4}) + "CONNECTIVITY int\n" + ints({0, 1, 2, 4});
  } else {
    file += "POLYGONS 1 5\n" + ints({4, 0, 1, 2, 3}) + "TRIANGLE_STRIPS 1 5\n" + ints({4, 0, 1, 2, 4});
  }
  file += "POINT_DATA 5\nSCALARS depth float 1\nLOOKUP_TABLE default\n" + floats({0.5, 1, 1.5, 2, 2.5});
  file += "NORMALS Normals float\n" + floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 1, 0, 0});
  file += "COLOR_SCALARS RGB 3\n";
  return file + (binary ? std::string("\xff\0\0\0\xff\0\0\0\xff\1\2\3\0\0\0", 15) : "1 0 0 0 1 0 0 0 1 0.004 0.008 0.012 0 0 0") + "\n";
}

std::string LegacyLines() {
  return "# vtk DataFile Version 3.0\nlines\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0 1 0 0 1 1 0 9 9 9\nVERTICES 1 2\n1 3\n"
         "LINES 3 9\n3 2 1 0\n2 0 2\n1 3\nPOINT_DATA 4\nFIELD FieldData 1\nTubeRadius 1 4 float\n0.5 1 1.5 2\n";
}

std::string XmlPoints() {
  return "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"><PolyData><FieldData><Array type=\"String\" "
         "Name=\"SPACE\" "
         "NumberOfTuples=\"1\" format=\"ascii\">76 80 83 0</Array></FieldData><Piece NumberOfPoints=\"3\" NumberOfVerts=\"2\">"
         "<PointData><DataArray type=\"Float32\" Name=\"t\" format=\"ascii\">7 8 9</DataArray></PointData><Points>"
         "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 2 3 4 5 6</DataArray></Points><Verts>"
         "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">2 0</DataArray>"
         "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">1 2</DataArray></Verts></Piece></PolyData></VTKFile>";
}

std::string FreeSurfer() {
  return "\xff\xff\xfe"
         "created by hand\n\n" +
         NumberBytes<Int>({3, 1}, true) + NumberBytes<float>({0, 0, 0, 1, 0, 0, 0, 2, 0}, true) + NumberBytes<Int>({0, 1, 2}, true) +
         NumberBytes<Int>({2, 0, 20}, true) +
         "valid = 1  # volume info valid\nfilename = a.mgz\nvolume = 256 256 256\nvoxelsize = 1 1 1\nxras   = -1 0 0\nyras   = 0 0 -1\n"
         "zras   = 0 1 0\ncras   = 1.5 -2.5 3\n";
}

std::string Base64(const std::string& bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string letters;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < bytes.size() ? std::uint8_t(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) letters += i + k > bytes.size() ? '=' : kLetters[bits >> (18 - 6 * k) & 63];
  }
  return letters;
}

std::string Gifti(const std::string& encoding) {
  const bool text = encoding == "ASCII", packed = encoding == "GZipBase64Binary";
  const auto array = [&](const std::string& intent, const std::string& type, const std::string& dimensions, const std::string& as_text,
                         const std::string& bytes, const std::string& inside) {
    return fmt::format(
        "<DataArray Intent=\"NIFTI_INTENT_{}\" DataType=\"NIFTI_TYPE_{}\" ArrayIndexingOrder=\"RowMajorOrder\" {} Encoding=\"{}\" "
        "Endian=\"LittleEndian\">{}<Data>{}</Data></DataArray>",
        intent, type, dimensions, encoding, inside, text ? as_text : Base64(PackBytes(packed ? "zlib" : "", bytes)));
  };
  const std::string rows = "Dimensionality=\"2\" Dim0=\"{}\" Dim1=\"3\"";
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?><!DOCTYPE GIFTI SYSTEM \"http://www.nitrc.org/frs/download.php/115/gifti.dtd\">"
         "<GIFTI Version=\"1.0\" NumberOfDataArrays=\"3\">" +
         array("POINTSET", "FLOAT32", "Dimensionality=\"2\" Dim0=\"3\" Dim1=\"3\"", "0 0 0 1 0 0 0 2 0",
               NumberBytes<float>({0, 0, 0, 1, 0, 0, 0, 2, 0}),
               "<CoordinateSystemTransformMatrix><DataSpace><![CDATA[NIFTI_XFORM_UNKNOWN]]></DataSpace><TransformedSpace>"
               "<![CDATA[NIFTI_XFORM_SCANNER_ANAT]]></TransformedSpace><MatrixData>1 0 0 1.5 0 1 0 -2.5 0 0 1 3 0 0 0 1</MatrixData>"
               "</CoordinateSystemTransformMatrix>") +
         array("TRIANGLE", "INT32", "Dimensionality=\"2\" Dim0=\"1\" Dim1=\"3\"", "0 1 2", NumberBytes<Int>({0, 1, 2}), "") +
         array("SHAPE", "FLOAT32", "Dimensionality=\"1\" Dim0=\"3\"", "7 8 9", NumberBytes<float>({7, 8, 9}), "") + "</GIFTI>";
}

std::string Trk(bool big, Int version) {
  std::string header(1000, '\0');
  const auto put = [&](std::size_t at, const std::string& bytes) { header.replace(at, bytes.size(), bytes); };
  put(0, "TRACK");
  put(6, NumberBytes<short>({10, 20, 30}, big));
  put(12, NumberBytes<float>({2, 2, 2}, big));
  put(36, NumberBytes<short>({1}, big));
  put(238, NumberBytes<short>({1}, big));
  if (version == 2) {
    put(440, NumberBytes<float>({2, 0, 0, -9, 0, 2, 0, 1, 0, 0, 2, 3, 0, 0, 0, 1}, big));
    put(948, "LAS");
  }
  put(988, NumberBytes<Int>({version == 2 ? 3 : 0, version, 1000}, big));
  return header + NumberBytes<Int>({2}, big) + NumberBytes<float>({1, 1, 1, 7, 3, 1, 1, 8, 0}, big) + NumberBytes<Int>({1}, big) +
         NumberBytes<float>({1, 1, 1, 7, 0}, big) + NumberBytes<Int>({3}, big) +
         NumberBytes<float>({1, 1, 1, 7, 1, 3, 1, 8, 1, 3, 5, 9, 0}, big);
}

template <class T>
std::string Tck(const std::string& type, bool big) {
  constexpr T kNan = std::numeric_limits<T>::quiet_NaN(), kInf = std::numeric_limits<T>::infinity();
  std::string header = fmt::format("mrtrix tracks\ncount: 2\ndatatype: {}\nfile: . 64\nEND\n", type);
  header.resize(64);
  return header +
         NumberBytes<T>({0, 0, 0, 1, 0, 0, kNan, kNan, kNan, 5, 5, 5, kNan, kNan, kNan, 1, 2, 3, 4, 5, 6, 7, 8, 9, kInf, kInf, kInf}, big);
}

std::string Npy(const std::string& descr, const std::string& order, const std::string& shape, const std::string& bytes) {
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", descr, order, shape);
  text.resize(117, ' ');
  return std::string("\x93NUMPY\1\0\x76\0", 10) + text + "\n" + bytes;
}

}  // namespace

std::string GlbFile(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4);
  const auto size = [](std::size_t bytes) { return NumberBytes<std::uint32_t>({std::uint32_t(bytes)}); };
  return "glTF" + size(2) + size(28 + json.size() + binary.size()) + size(json.size()) + "JSON" + json + size(binary.size()) +
         std::string("BIN\0", 4) + binary;
}

std::vector<ShapeSample> ShapeSamples() {
  return {
      {"text.ply", TextPly()},
      {"little.ply", BinaryPly(false)},
      {"big.ply", BinaryPly(true)},
      {"binary.STL", BinaryStl()},
      {"text.stl", TextStl()},
      {"a.obj", Obj()},
      {"a.glb", Glb()},
      {"old_text.vtk", LegacyMesh(false, false)},
      {"old.vtk", LegacyMesh(false, true)},
      {"new_text.vtk", LegacyMesh(true, false)},
      {"new.vtk", LegacyMesh(true, true)},
      {"lines.vtk", LegacyLines()},
      {"points.vtp", XmlPoints()},
      {"lh.pial", FreeSurfer()},
      {"text.gii", Gifti("ASCII")},
      {"base64.gii", Gifti("Base64Binary")},
      {"packed.surf.gii", Gifti("GZipBase64Binary")},
      {"little.trk", Trk(false, 2)},
      {"big.trk", Trk(true, 2)},
      {"first.trk", Trk(false, 1)},
      {"little.tck", Tck<float>("Float32LE", false)},
      {"big.tck", Tck<double>("Float64BE", true)},
      {"a.csv",
       "\xef\xbb\xbf"
       "name,Z,\"X\",Y,red,green,blue,value,r\nfirst,3,1,2,255,0,1,0.5,4\nsecond,6,4,5,0,0,0,,0\n"},
      {"plain.csv", "1 2 3\n4 5\t6\n"},
      {"tab.tsv", "x\ty\tz\tr\tg\tb\n1\t2\t3\t1\t0.5\t0\n"},
      {"slicer.fcsv", "# Markups fiducial file version = 5.0\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow\n1,1,2,3,0\n2,4,5,6,0\n"},
      {"c.npy", Npy("<f4", "False", "(2, 3)", NumberBytes<float>({1, 2, 3, 4, 5, 6}))},
      {"fortran.npy", Npy(">i2", "True", "(2, 4)", NumberBytes<short>({1, 4, 2, 5, 3, 6, 7, 8}, true))}};
}

std::string BytesOfShapeSample(const std::string& name) {
  for (const ShapeSample& sample : ShapeSamples()) {
    if (sample.name == name) return sample.bytes;
  }
  CHECK(false) << name;
  return "";
}

std::string WhatIsWrong(const Shape& shape) {
  const std::size_t count = shape.positions.size();
  if (count == 0) return "no vertex";
  const auto finite = [](const auto& place) { return std::ranges::all_of(place, [](float x) { return std::isfinite(x); }); };
  if (!std::ranges::all_of(shape.positions, finite) || !std::ranges::all_of(shape.normals, finite)) return "not finite";
  for (const auto& [x, y, z] : shape.normals) {
    const double length = std::hypot(x, y, z);
    if (length != 0 && std::abs(length - 1) > 1e-5) return fmt::format("a normal of length {}", length);
  }
  for (const std::size_t size : {shape.normals.size(), shape.colors.size(), shape.values.size(), shape.radii.size()}) {
    if (size != 0 && size != count) return fmt::format("{} of {} vertices", size, count);
  }
  if (!std::ranges::all_of(shape.radii, [](float radius) { return radius >= 0 && std::isfinite(radius); })) return "a radius";
  const auto inside = [&](std::uint32_t corner) { return corner < count; };
  if (!std::ranges::all_of(shape.triangles, [&](const auto& corners) { return std::ranges::all_of(corners, inside); })) return "a triangle";
  if ((shape.kind == ShapeKind::kMesh) != !shape.triangles.empty()) return "the kind";
  const std::vector<std::uint32_t>& begins = shape.line_begins;
  if ((shape.kind == ShapeKind::kLines) != !begins.empty()) return "the kind";
  if (begins.empty()) return "";
  if (begins.front() != 0 || begins.back() != count) return "the ends of lines";
  for (std::size_t i = 1; i < begins.size(); ++i) {
    if (begins[i] < begins[i - 1] + 2) return "a line of one vertex";
  }
  return "";
}

}  // namespace slabstream
