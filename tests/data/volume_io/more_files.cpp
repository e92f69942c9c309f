#include "tests/data/volume_io/more_files.h"

#include <fmt/format.h>
#include <openjpeg.h>
#include <png.h>

#include <jpeglib.h>
#include <cstdio>

#include <algorithm>
#include <array>
#include <cstring>

#include "common/base/check.h"
#include "tests/data/codecs/packed_bytes.h"

namespace slabstream {
namespace {

template <class T>
void PutNumber(FileBytes& bytes, std::size_t offset, T value, bool big_endian) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  bytes.replace(offset, raw.size(), raw.data(), raw.size());
}

FileBytes Word(std::uint64_t number, const FileSpec& spec, const VtiOptions& options) {
  FileBytes word(options.wide_header ? 8 : 4, '\0');
  if (options.wide_header) {
    PutNumber(word, 0, number, spec.big_endian);
  } else {
    PutNumber(word, 0, std::uint32_t(number), spec.big_endian);
  }
  return word;
}

}  // namespace

FileBytes VtkXmlSamples(const FileSpec& spec, const FileBytes& samples, const VtiOptions& options) {
  if (options.format == "ascii") return samples;
  const bool base64 = options.format == "binary" || options.encoding == "base64";
  const auto encoded = [&](const FileBytes& bytes) { return base64 ? Base64(bytes) : bytes; };
  if (options.block == 0) return encoded(Word(samples.size(), spec, options) + samples);
  FileBytes sizes, blocks;
  std::size_t count = 0;
  for (std::size_t begin = 0; begin < samples.size(); begin += options.block, ++count) {
    const FileBytes block = PackBytes(options.compressor == "LZMA"  ? "xz"
                                      : options.compressor == "LZ4" ? "lz4 block"
                                                                    : "zlib",
                                      samples.substr(begin, options.block));
    sizes += Word(block.size(), spec, options);
    blocks += block;
  }
  return encoded(Word(count, spec, options) + Word(options.block, spec, options) + Word(samples.size() % options.block, spec, options) +
                 sizes) +
         encoded(blocks);
}

FileBytes Base64(const FileBytes& bytes) {
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  FileBytes text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t j = 0; j < 3; ++j) bits = bits << 8 | (i + j < bytes.size() ? std::uint8_t(bytes[i + j]) : 0U);
    for (std::size_t j = 0; j < 4; ++j) text += i + j > bytes.size() ? '=' : kLetters[bits >> (18 - 6 * j) & 63];
  }
  return text;
}

FileBytes MrcHeader(const MrcSpec& spec) {
  FileBytes bytes(1024 + std::size_t(spec.extension), '\0');
  const auto put = [&](int word, auto value) { PutNumber(bytes, 4 * std::size_t(word - 1), value, spec.big_endian); };
  for (int i = 0; i < 3; ++i) {
    const int axis = spec.axes[i] - 1;  // which column i runs along
    put(1 + i, std::int32_t(spec.size[i] * (i == 2 ? spec.volumes : 1)));
    put(5 + i, std::int32_t(spec.starts[i]));
    put(8 + axis, std::int32_t(spec.size[i]));
    put(11 + axis, float(spec.spacing[axis] * spec.size[i]));
    put(14 + i, float(spec.angles[i]));
    put(17 + i, std::int32_t(spec.axes[i]));
    put(50 + i, float(spec.origin[i]));
  }
  put(4, std::int32_t(spec.mode));
  put(23, std::int32_t(spec.volumes > 1 ? 401 : 1));
  put(24, std::int32_t(spec.extension));
  if (spec.imod != 0) {
    put(39, std::int32_t{1146047817});
    put(40, spec.imod);
  }
  bytes.replace(208, 4, "MAP ");
  bytes.replace(212, 4, spec.big_endian ? std::string("\x11\x11\0\0", 4) : std::string("\x44\x44\0\0", 4));
  return bytes;
}

FileBytes MghHeader(const Index3& size, std::int32_t type, const std::array<float, 15>& fields, bool good) {
  FileBytes bytes(284, '\0');
  const std::int32_t integers[] = {1, size.x, size.y, size.z, 1, type};
  for (std::size_t i = 0; i < 6; ++i) PutNumber(bytes, 4 * i, integers[i], true);
  PutNumber(bytes, 28, std::int16_t(good ? 1 : 0), true);
  for (std::size_t i = 0; i < fields.size(); ++i) PutNumber(bytes, 30 + 4 * i, fields[i], true);
  return bytes;
}

FileBytes NpyHeader(const std::string& descr, const std::string& shape, bool fortran, int version) {
  FileBytes text = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", descr, fortran ? "True" : "False", shape);
  const std::size_t before = version == 1 ? 10 : 12;
  text += FileBytes(64 - (before + text.size() + 1) % 64, ' ') + "\n";
  FileBytes header = "\x93NUMPY" + FileBytes{char(version), '\0', char(text.size() & 0xff), char(text.size() >> 8)};
  if (version > 1) header += FileBytes(2, '\0');
  return header + text;
}

FileBytes NpyHeader(const FileSpec& spec) {
  constexpr const char* kTypes[] = {"i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"};
  return NpyHeader(std::string(spec.big_endian ? ">" : "<") + kTypes[int(spec.type)],
                   fmt::format("({}, {}, {})", spec.size.z, spec.size.y, spec.size.x));
}

std::string AsText(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += fmt::format("{:.17g}\n", value);
  return text;
}

FileBytes VtkFile(const FileSpec& spec, const FileBytes& samples, bool binary, const std::string& components) {
  constexpr const char* kTypes[] = {"char",         "unsigned_char", "short",         "unsigned_short", "int",
                                    "unsigned_int", "long",          "unsigned_long", "float",          "double"};
  const auto& [x, y, z] = spec.size;
  return fmt::format(
             "# vtk DataFile Version 3.0\na title\n{}\nDATASET STRUCTURED_POINTS\nDIMENSIONS {} {} {}\nSPACING {} {} {}\nORIGIN 1 2 3\n"
             "POINT_DATA {}\nSCALARS density {}{}\nLOOKUP_TABLE default\n",
             binary ? "BINARY" : "ASCII", x, y, z, spec.spacing.x, spec.spacing.y, spec.spacing.z, x * y * z, kTypes[int(spec.type)],
             components) +
         samples + "\n";
}

FileBytes VtiFile(const FileSpec& spec, const FileBytes& samples, const VtiOptions& options) {
  constexpr const char* kTypes[] = {"Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32", "Float64"};
  const std::string extent =
      options.extent.empty() ? fmt::format("0 {} 0 {} 0 {}", spec.size.x - 1, spec.size.y - 1, spec.size.z - 1) : options.extent;
  FileBytes text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"{}\" header_type=\"{}\"{}>\n"
      "<ImageData WholeExtent=\"{}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\"{}>\n<Piece Extent=\"{}\">\n<PointData {}>\n",
      spec.big_endian ? "BigEndian" : "LittleEndian", options.wide_header ? "UInt64" : "UInt32",
      options.block > 0 ? " compressor=\"vtk" + options.compressor + "DataCompressor\"" : "", extent, options.origin.x, options.origin.y,
      options.origin.z, spec.spacing.x, spec.spacing.y, spec.spacing.z,
      options.direction.empty() ? "" : " Direction=\"" + options.direction + "\"", extent, options.attributes);
  const FileBytes stored = VtkXmlSamples(spec, samples, options);
  const bool appended = options.format == "appended";
  for (int i = 0; i < options.arrays; ++i) {
    text += fmt::format("<DataArray type=\"{}\" Name=\"density{}\" NumberOfComponents=\"{}\" format=\"{}\"{}>\n", kTypes[int(spec.type)],
                        i == 0 ? "" : std::to_string(i + 1), options.components, options.format, appended ? " offset=\"0\"" : "");
    // As VTK does for arrays of several components.
    if (!appended) text += stored + "\n";
    text +=
        "<InformationKey name=\"L2_NORM_RANGE\" location=\"vtkDataArray\" length=\"2\"><Value "
        "index=\"0\">0</Value></InformationKey>\n</DataArray>\n";
  }
  text += "</PointData>\n</Piece>\n</ImageData>\n";
  if (appended) text += "<AppendedData encoding=\"" + options.encoding + "\">\n  _" + stored + "\n</AppendedData>\n";
  return text + "</VTKFile>\n";
}

void WritePng(const std::string& path, const Index3& size, int bits, int kind, const FileBytes& samples, bool interlaced) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  CHECK(file != nullptr) << path;
  png_init_io(png, file);
  png_set_IHDR(png, info, png_uint_32(size.x), png_uint_32(size.y), bits, kind, interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  const std::array<png_color, 2> palette = {png_color{10, 20, 30}, png_color{200, 210, 220}};
  if (kind == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette.data(), int(palette.size()));
  png_write_info(png, info);
  if (bits == 16) png_set_swap(png);
  if (bits < 8) png_set_packing(png);
  FileBytes copy = samples;
  const std::size_t row = samples.size() / std::size_t(size.y);
  std::vector<png_bytep> rows;
  for (std::size_t y = 0; y < std::size_t(size.y); ++y) rows.push_back(reinterpret_cast<png_bytep>(copy.data() + y * row));
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  CHECK_EQ(std::fclose(file), 0);
}

FileBytes Bmp(const Index3& size, const BmpKind& kind, const FileBytes& rows) {
  const auto number = [](std::int64_t value, int bytes) {
    FileBytes text;
    for (int i = 0; i < bytes; ++i) text += char(value >> (8 * i));
    return text;
  };
  const auto begin = std::int64_t(54 + kind.palette.size());
  return "BM" + number(begin + std::int64_t(rows.size()), 4) + number(0, 4) + number(begin, 4) + number(40, 4) + number(size.x, 4) +
         number(kind.from_top ? -size.y : size.y, 4) + number(1, 2) + number(kind.bits, 2) + number(kind.compression, 4) +
         number(std::int64_t(rows.size()), 4) + number(0, 8) + number(std::int64_t(kind.palette.size() / 4), 4) + number(0, 4) +
         kind.palette + rows;
}

void WriteJpeg2000(const std::string& path, const Index3& size, int components, int bits, bool is_signed, const std::vector<int>& samples) {
  std::vector<opj_image_cmptparm_t> parts(
      std::size_t(components),
      opj_image_cmptparm_t{
          .dx = 1, .dy = 1, .w = OPJ_UINT32(size.x), .h = OPJ_UINT32(size.y), .prec = OPJ_UINT32(bits), .sgnd = is_signed ? 1U : 0U});
  opj_image_t* image = opj_image_create(OPJ_UINT32(components), parts.data(), components == 1 ? OPJ_CLRSPC_GRAY : OPJ_CLRSPC_SRGB);
  image->x1 = OPJ_UINT32(size.x);
  image->y1 = OPJ_UINT32(size.y);
  for (std::size_t i = 0; i < samples.size(); ++i) image->comps[i % std::size_t(components)].data[i / std::size_t(components)] = samples[i];
  opj_cparameters_t parameters;
  opj_set_default_encoder_parameters(&parameters);
  parameters.tcp_numlayers = 1;
  parameters.cp_disto_alloc = 1;
  parameters.numresolution = 3;
  opj_codec_t* codec = opj_create_compress(path.ends_with(".jp2") ? OPJ_CODEC_JP2 : OPJ_CODEC_J2K);
  opj_stream_t* stream = opj_stream_create_default_file_stream(path.c_str(), OPJ_FALSE);
  CHECK(opj_setup_encoder(codec, &parameters, image) != 0 && opj_start_compress(codec, image, stream) != 0 &&
        opj_encode(codec, stream) != 0 && opj_end_compress(codec, stream) != 0)
      << path;
  opj_stream_destroy(stream);
  opj_destroy_codec(codec);
  opj_image_destroy(image);
}

void WriteJpeg(const std::string& path, const Index3& size, int components, const FileBytes& samples, bool progressive) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  CHECK(file != nullptr) << path;
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  jpeg_stdio_dest(&jpeg, file);
  jpeg.image_width = JDIMENSION(size.x);
  jpeg.image_height = JDIMENSION(size.y);
  jpeg.input_components = components;
  jpeg.in_color_space = components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 100, TRUE);
  if (progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  FileBytes copy = samples;
  while (jpeg.next_scanline < jpeg.image_height) {
    auto* row = reinterpret_cast<JSAMPROW>(copy.data() + std::size_t(jpeg.next_scanline) * std::size_t(size.x) * std::size_t(components));
    (void)jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  CHECK_EQ(std::fclose(file), 0);
}

std::vector<SampleFile> OneOfEachFormat() {
  const FileSpec spec{.type = SampleType::kInt16}, big{.type = SampleType::kInt16, .big_endian = true};
  FileBytes samples;
  std::vector<double> values;
  for (int i = 0; i < 24; ++i) values.push_back(i * 321 - 2000);
  samples = EncodeSamples(SampleType::kInt16, values);
  const FileBytes swapped = EncodeSamples(SampleType::kInt16, values, true), zlib = Zlib(samples);
  const auto whole = [](const std::string& file, const FileBytes& header, const FileBytes& behind) {
    return SampleFile{file, header + behind, header.size()};
  };
  // XML and text: all of it is header, since samples are found by it.
  const auto all = [](const std::string& file, const FileBytes& bytes) { return SampleFile{file, bytes, bytes.size()}; };
  return {
      whole("v.nii", NiftiHeader(spec), samples),
      whole("v.nii.gz", "", Gzip(NiftiHeader(spec) + samples)),
      whole("v.nrrd", NrrdHeader(spec, "raw"), samples),
      whole("v.nrrd", NrrdHeader(spec, "gzip"), Gzip(samples)),
      whole("v.mha", MetaHeader(spec, "LOCAL"), samples),
      whole("v.mha", MetaHeader(spec, "LOCAL", std::int64_t(zlib.size())), zlib),
      whole("v.mrc", MrcHeader({.mode = 1, .extension = 40}), samples),
      whole("v.map.gz", "", Gzip(MrcHeader({.mode = 1, .big_endian = true}) + swapped)),
      whole("v.mgh", MghHeader(spec.size, 4, {1, 1, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1}), swapped),
      all("v.vtk", VtkFile(spec, swapped, true)),
      all("v.vtk", VtkFile(spec, AsText(values), false)),
      all("v.vti", VtiFile(spec, samples)),
      all("v.vti", VtiFile(big, swapped, {.format = "binary", .wide_header = true, .block = 16})),
      all("v.vti", VtiFile(spec, samples, {.encoding = "base64", .block = 20})),
      all("v.vti", VtiFile(spec, AsText(values), {.format = "ascii"})),
      whole("v.npy", NpyHeader(spec), samples),
  };
}

std::vector<SampleFile> CompressedStreams(const Index3& size, Random& random) {
  std::vector<SampleFile> files;
  for (const SampleType type : {SampleType::kInt8, SampleType::kUint8, SampleType::kInt16, SampleType::kUint16, SampleType::kFloat32}) {
    for (const bool big : {false, true}) {
      const FileSpec spec{.size = size, .type = type, .big_endian = big, .qform = 1};
      std::vector<double> values(CountIn(size));
      for (double& value : values) value = random.Integer(0, 127);
      const FileBytes samples = EncodeSamples(type, values, big), zlib = Zlib(samples);
      const FileBytes nrrd = NrrdHeader(spec, "gzip"), meta = MetaHeader(spec, "LOCAL", std::int64_t(zlib.size()));
      files.push_back({"v.nii.gz", Gzip(NiftiHeader(spec) + samples), 0});
      files.push_back({"v.nrrd", nrrd + Gzip(samples), nrrd.size()});
      files.push_back({"v.mha", meta + zlib, meta.size()});
    }
  }
  return files;
}

}  // namespace slabstream
