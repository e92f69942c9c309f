// What each further format means: axes, units, types and encodings of MRC, VTK, NumPy, raw samples; several volumes in one file,
// and several components of a voxel.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/volume_io/formats.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class ReadersTest : public testing::Test {
 protected:
  LoadedVolume Read(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    WriteFile(directory_ / name, bytes);
    return ReadPath(directory_ / name, options);
  }
  static LoadedVolume ReadPath(const std::string& path, const ReadOptions& options = {}) {
    Result<LoadedVolume> loaded = ReadVolume(path, options);
    CHECK(loaded.ok()) << loaded.status().message();
    return *std::move(loaded);
  }
  // One line that names the path.
  std::string WhyNot(const std::string& name, const FileBytes& bytes, const ReadOptions& options = {}) {
    WriteFile(directory_ / name, bytes);
    return WhyNotPath(directory_ / name, options);
  }
  static std::string WhyNotPath(const std::string& path, const ReadOptions& options = {}) {
    const Result<LoadedVolume> loaded = ReadVolume(path, options);
    EXPECT_FALSE(loaded.ok());
    EXPECT_THAT(loaded.status().message(), testing::AllOf(HasSubstr(path), testing::Not(HasSubstr("\n"))));
    EXPECT_EQ(loaded.status().code(), StatusCode::kInvalidArgument) << loaded.status().message();
    return loaded.status().message();
  }

  TemporaryDirectory directory_;
};

std::vector<double> Counted(std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(double(i));
  return values;
}

std::vector<double> ValuesOf(const LoadedVolume& loaded) {
  const Volume& volume = *loaded.volume;
  std::vector<double> values;
  VisitScalarType(volume.description.type, [&]<class T>(const T*) {
    for (std::size_t i = 0; i < CountIn(volume.description.geometry.size); ++i) {
      values.push_back(volume.description.mapping.FromStored(double(volume.block.samples<T>()[i])));
    }
  });
  return values;
}

FileBytes Halves(const std::vector<std::uint16_t>& halves) { return EncodeSamples(SampleType::kUint16, {halves.begin(), halves.end()}); }

// 0, the least subnormal one, 1/3 rounded, 1, -2, the largest, infinity
const std::vector<std::uint16_t> kHalves = {0x0000, 0x0001, 0x3555, 0x3c00, 0xc000, 0x7bff, 0x7c00};
const std::vector<double> kHalfValues = {0, 0x1p-24, 0.333251953125, 1, -2, 65504, std::numeric_limits<double>::infinity()};

// --- MRC

// What is told while a file is read.
std::vector<int> PercentsOf(const std::string& path) {
  std::vector<int> told;
  ReadProgress progress([&](const ReadShare& read) { told.push_back(read.percent); });
  EXPECT_TRUE(ReadVolume(path, {.progress = &progress}).ok());
  return told;
}

TEST_F(ReadersTest, ReadingTellsHowFarItIs) {
  const FileBytes samples(std::size_t{64} << 20, '\0');
  const auto header = [](const std::string& encoding) {
    return "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 256 256 1024\nencoding: " + encoding + "\n\n";
  };
  WriteFile(directory_ / "raw.nrrd", header("raw") + samples);
  EXPECT_THAT(PercentsOf(directory_ / "raw.nrrd"), testing::ElementsAre(25, 50, 75, 100));
  WriteFile(directory_ / "packed.nrrd", header("gzip") + Gzip(samples));
  const std::vector<int> packed = PercentsOf(directory_ / "packed.nrrd");
  EXPECT_THAT(packed, testing::IsSupersetOf({25, 50, 75, 100}));
  EXPECT_TRUE(std::ranges::is_sorted(packed, std::ranges::less_equal())) << "each is told once";
}

TEST_F(ReadersTest, MrcHasItsModesInBothByteOrders) {
  const struct {
    int mode;
    SampleType type;
    std::vector<double> values;
  } modes[] = {{0, SampleType::kInt8, {-128, 0, 127}},
               {1, SampleType::kInt16, {-32768, 5, 32767}},
               {2, SampleType::kFloat32, {-1.5, 0.25, 1e30F}},
               {6, SampleType::kUint16, {0, 40000, 65535}}};
  for (const auto& [mode, type, values] : modes) {
    for (const bool big_endian : {false, true}) {
      const LoadedVolume loaded = Read("v.mrc", MrcHeader({.size = {3, 1, 1}, .mode = mode, .big_endian = big_endian, .extension = 80}) +
                                                    EncodeSamples(type, values, big_endian));
      EXPECT_EQ(ValuesOf(loaded), values) << mode;
      EXPECT_EQ(loaded.info.file_type, ToString(type));
      EXPECT_EQ(loaded.info.format, "MRC");
    }
  }
  EXPECT_EQ(ValuesOf(Read("v.mrc", MrcHeader({.size = {7, 1, 1}, .mode = 12}) + Halves(kHalves))), kHalfValues);
  // Bytes are signed, unless IMOD wrote them and does not say so.
  EXPECT_EQ(ValuesOf(Read("v.mrc", MrcHeader({.size = {1, 1, 1}, .imod = 2}) + "\xff")), std::vector<double>{255});
  EXPECT_EQ(ValuesOf(Read("v.mrc", MrcHeader({.size = {1, 1, 1}, .imod = 1}) + "\xff")), std::vector<double>{-1});
}

TEST_F(ReadersTest, MrcAxesAreThoseOfTheCell) {
  // The same object in each order of columns, rows and sections.
  const Index3 size = {4, 3, 2};  // along x, y and z of the cell
  const Vec3 spacing = {0.5, 1.25, 3};
  for (const Index3 axes : {Index3{1, 2, 3}, {1, 3, 2}, {2, 1, 3}, {2, 3, 1}, {3, 1, 2}, {3, 2, 1}}) {
    const Index3 stored = {size[axes.x - 1], size[axes.y - 1], size[axes.z - 1]};
    FileBytes samples;
    for (std::size_t i = 0; i < CountIn(stored); ++i) {
      Index3 at;
      for (int j = 0; j < 3; ++j) at[axes[j] - 1] = PlaceIn(stored, i)[j];
      samples += char(NumberIn(size, at));
    }
    const LoadedVolume loaded =
        Read("v.mrc", MrcHeader({.size = stored, .starts = {7, -8, 9}, .axes = axes, .spacing = spacing}) + samples);
    const VolumeGeometry& geometry = loaded.info.finest().geometry;
    EXPECT_EQ(geometry.size, size);
    ExpectNear(geometry.spacing, spacing, 1e-6);
    EXPECT_EQ(geometry.orientation.unit, LengthUnit::kAngstrom);
    EXPECT_EQ(geometry.orientation.axes, Orientation{}.axes);
    EXPECT_EQ(ValuesOf(loaded), Counted(24)) << axes.x << axes.y << axes.z;
    Vec3 origin;
    for (int j = 0; j < 3; ++j) origin[axes[j] - 1] = Index3{7, -8, 9}[j] * spacing[axes[j] - 1];
    ExpectNear(geometry.orientation.origin, origin, 1e-5);
  }
  const MrcSpec with_origin{.starts = {7, -8, 9}, .origin = {10, 20, 30}};
  ExpectNear(Read("v.mrc", MrcHeader(with_origin) + FileBytes(24, 'x')).info.finest().geometry.orientation.origin, {10, 20, 30}, 1e-6);
  // A cell whose a and b enclose 60 degrees is straightened.
  EXPECT_TRUE(Read("v.mrc", MrcHeader({.angles = {90, 90, 60}}) + FileBytes(24, 'x')).info.stored->slanted);
  EXPECT_THAT(WhyNot("v.mrc", MrcHeader({.axes = {1, 2, 2}}) + FileBytes(24, 'x')), HasSubstr("MAPC, MAPR and MAPS are 1, 2 and 2"));
}

TEST_F(ReadersTest, MrcSaysWhatItIsNot) {
  EXPECT_THAT(WhyNot("v.mrc", MrcHeader({.mode = 4}) + FileBytes(192, 'x')), HasSubstr("MRC mode 4 (complex floats) is not supported"));
  FileBytes old = MrcHeader({});
  old.replace(208, 4, 4, '\0');
  EXPECT_THAT(WhyNot("v.map", old + FileBytes(24, 'x')), HasSubstr("'MAP '"));
  FileBytes negative = MrcHeader({});
  negative[95] = '\xff';
  EXPECT_THAT(WhyNot("v.mrc", negative + FileBytes(24, 'x')), HasSubstr("extended header"));
  EXPECT_THAT(WhyNot("v.mrc", MrcHeader({.spacing = {1, std::nan(""), 1}}) + FileBytes(24, 'x')), HasSubstr("cell: the step along y is"));
}

// --- VTK

TEST_F(ReadersTest, VtkImagesAreReadFromEveryEncoding) {
  const std::vector<double> values = Counted(24);
  for (const SampleType type : {SampleType::kUint8, SampleType::kInt16, SampleType::kFloat64, SampleType::kUint64}) {
    for (const bool big_endian : {false, true}) {
      for (const bool wide : {false, true}) {
        for (const std::size_t block : {0, 1, 7, 24, 1000}) {
          for (const auto& [format, encoding] : {std::pair{"appended", "raw"}, {"appended", "base64"}, {"binary", ""}, {"ascii", ""}}) {
            SCOPED_TRACE(fmt::format("{} {} {} {} {} {}", ToString(type), big_endian, wide, block, format, encoding));
            const FileSpec spec{.type = type, .big_endian = big_endian, .spacing = {0.5, 1.25, 3}};
            const FileBytes samples = std::string(format) == "ascii" ? AsText(values) : EncodeSamples(type, values, big_endian);
            for (const char* const compressor : {"ZLib", "LZ4", "LZMA"}) {
              if (block == 0 && std::string(compressor) != "ZLib") continue;
              const VtiOptions options{
                  .format = format, .encoding = encoding, .wide_header = wide, .block = block, .compressor = compressor};
              const LoadedVolume loaded = Read("v.vti", VtiFile(spec, samples, options));
              EXPECT_EQ(ValuesOf(loaded), values) << compressor;
              EXPECT_EQ(loaded.info.finest().geometry.spacing, spec.spacing);
            }
          }
        }
      }
    }
  }
}

TEST_F(ReadersTest, VtkImagesLieWhereTheirDirectionSays) {
  const FileBytes samples = EncodeSamples(SampleType::kUint8, Counted(24));
  // Their x runs along the world's y, their y along -x.
  const VtiOptions turned{.direction = "0 -1 0 1 0 0 0 0 1", .extent = "10 13 20 22 -1 0", .origin = {100, 200, 300}};
  const LoadedVolume loaded = Read("v.vti", VtiFile({.spacing = {0.5, 2, 3}}, samples, turned));
  const auto& [size, spacing, orientation, stretch] = loaded.info.finest().geometry;
  EXPECT_EQ(size, (Index3{3, 4, 2}));
  EXPECT_EQ(spacing, (Vec3{2, 0.5, 3}));
  EXPECT_EQ(orientation.world, World::kScene);
  // The first voxel is at 100 - 20 * 2, 200 + 10 * 0.5, 300 - 3, and x runs back from there.
  ExpectNear(orientation.origin, {60 - 2 * 2, 205, 297}, 1e-12);
  EXPECT_EQ(ValuesOf(loaded)[2], 0);
}

TEST_F(ReadersTest, VtkImagesOfSeveralArraysTakeTheActiveOne) {
  const FileBytes samples = EncodeSamples(SampleType::kUint8, Counted(24));
  const auto file = [&](const std::string& attributes, int arrays) {
    return VtiFile({}, samples, {.attributes = attributes, .arrays = arrays});
  };
  EXPECT_EQ(ValuesOf(Read("v.vti", file("Scalars=\"density2\"", 3))), Counted(24));
  EXPECT_EQ(ValuesOf(Read("v.vti", file("", 1))), Counted(24));
  EXPECT_THAT(WhyNot("v.vti", file("", 3)), HasSubstr("choose one by its name (--array): density, density2, density3"));
  EXPECT_THAT(WhyNot("v.vti", file("Scalars=\"other\"", 2)), HasSubstr("several arrays"));
}

TEST_F(ReadersTest, VtkFilesSayWhatTheyAreNot) {
  const FileBytes samples = EncodeSamples(SampleType::kUint8, Counted(24)), good = VtiFile({}, samples);
  const auto with = [](FileBytes file, const std::string& from, const std::string& to) {
    for (std::size_t at = file.find(from); at != FileBytes::npos; at = file.find(from, at + to.size())) file.replace(at, from.size(), to);
    return file;
  };
  const std::pair<FileBytes, const char*> images[] = {
      {with(good, "type=\"ImageData\"", "type=\"RectilinearGrid\""), "'RectilinearGrid', must be ImageData"},
      {with(good, "<Piece Extent=\"0 3", "<Piece Extent=\"0 2.5"), "Extent of Piece is '0 2.5 0 2 0 1', must be 6 whole numbers"},
      {with(good, "<Piece Extent=\"0 3", "<Piece Extent=\"0 -1"), "has no piece with a point in it"},
      {with(good, "UInt8", "String"), "type 'String'"},
      {with(VtiFile({}, samples, {.block = 8}), "vtkZLib", "vtkZstd"),
       "vtkZstdDataCompressor is not supported; supported: vtkZLibDataCompressor, vtkLZ4DataCompressor, vtkLZMADataCompressor"},
      {with(good, "Spacing=\"1 1 1\"", "Spacing=\"1 nan 1\""), "Direction: the step along y is"},
      {with(good, "Spacing=\"1 1 1\"", "Spacing=\"1 one 1\""), "Spacing of ImageData is '1 one 1'"},
      {with(good, "<?xml version=\"1.0\"?>", "<!DOCTYPE a [<!ENTITY b \"c\">]>"), "document type definition"},
      {"<VTKFile a=\"" + FileBytes(std::size_t{2} << 20, 'x'), "too long"},
      {with(good, "0 3 0 2 0 1", "0 3 0 2 0 70000"), "size along z is 70001"},
  };
  for (const auto& [file, why] : images) EXPECT_THAT(WhyNot("v.vti", file), HasSubstr(why));

  const FileBytes legacy = VtkFile({}, samples, true);
  const std::pair<FileBytes, const char*> files[] = {
      {with(legacy, "STRUCTURED_POINTS", "POLYDATA"), "type POLYDATA, must be STRUCTURED_POINTS, RECTILINEAR_GRID, STRUCTURED_GRID or"},
      {with(legacy, "POINT_DATA", "CELL_DATA"), "CELL_DATA has 24 elements, the grid of its DIMENSIONS 6"},
      {with(legacy, "SCALARS", "TRIANGLES"), "has 'TRIANGLES', must have a VTK keyword that is supported"},
      {with(legacy.substr(0, legacy.size() - 22), "unsigned_char", "bit"), "array density: type 'bit' is not supported"},
      {with(legacy, "LOOKUP_TABLE", "LOOKUP"), "LOOKUP_TABLE is missing"},
      {with(legacy, "POINT_DATA 24", "POINT_DATA 25"), "POINT_DATA has 25 elements, the grid of its DIMENSIONS 24"},
      {with(legacy, "BINARY", "BINARI"), "must be ASCII or BINARY"},
      {with(legacy, "DIMENSIONS 4", "DIMENSIONS 4.5"), "size along x is 4.5"},
      {with(legacy, "SPACING 1", "SPACING 0"), "SPACING: the step along x is (0, 0, 0)"},
  };
  for (const auto& [file, why] : files) EXPECT_THAT(WhyNot("v.vtk", file), HasSubstr(why));
}

TEST_F(ReadersTest, LegacyVtkIsReadAsTextAndAsBinary) {
  const std::vector<double> values = Counted(24);
  for (const SampleType type : {SampleType::kInt8, SampleType::kUint16, SampleType::kInt32, SampleType::kFloat32, SampleType::kFloat64}) {
    const FileSpec spec{.type = type, .spacing = {0.5, 1.25, 3}};
    const LoadedVolume binary = Read("v.vtk", VtkFile(spec, EncodeSamples(type, values, true), true)),
                       text = Read("v.vtk", VtkFile(spec, AsText(values), false, " 1"));
    for (const LoadedVolume* loaded : {&binary, &text}) {
      EXPECT_EQ(ValuesOf(*loaded), values);
      EXPECT_EQ(loaded->info.file_type, ToString(type));
      EXPECT_EQ(loaded->info.finest().geometry.spacing, spec.spacing);
      EXPECT_EQ(loaded->info.finest().geometry.orientation.origin, (Vec3{1, 2, 3}));
    }
  }
}

TEST_F(ReadersTest, LegacyVtkFieldsAreReadAndPassedBy) {
  const FileBytes samples = EncodeSamples(SampleType::kUint8, Counted(24));
  const std::string start = "# vtk DataFile Version 5.1\nt\nBINARY\nDATASET STRUCTURED_POINTS\nFIELD FieldData 1\nTIME 1 1 double\n" +
                            FileBytes(8, 'x') + "\nMETADATA\nINFORMATION 0\n\nDIMENSIONS 4 3 2\nSPACING 1 1 1\nORIGIN 0 0 0\n";
  const std::string one = "POINT_DATA 24\nFIELD FieldData 1\nrho 1 24 unsigned_char\n" + samples + "\n";
  const std::string two =
      "POINT_DATA 24\nFIELD FieldData 2\nrho 1 24 unsigned_char\n" + samples + "\nT 1 24 unsigned_char\n" + samples + "\n";
  EXPECT_EQ(ValuesOf(Read("v.vtk", start + one)), Counted(24));
  EXPECT_THAT(WhyNot("v.vtk", start + two), HasSubstr("choose one by its name (--array): rho, T"));
  const std::string cells = "CELL_DATA 6\nSCALARS c unsigned_char\nLOOKUP_TABLE default\n" + FileBytes(6, 'x') + "\n";
  EXPECT_EQ(ValuesOf(Read("v.vtk", start + cells + one)), std::vector<double>(6, 'x'));  // the only scalars
  EXPECT_EQ(ValuesOf(Read("v.vtk", start + cells + one, {.array = "rho"})), Counted(24));
}

// --- NumPy

TEST_F(ReadersTest, NumPyIndicesAreZThenYThenX) {
  const FileBytes samples = EncodeSamples(SampleType::kUint8, Counted(24));
  const LoadedVolume c_order = Read("v.npy", NpyHeader("|u1", "(2, 3, 4)") + samples);
  EXPECT_EQ(c_order.info.finest().geometry.size, (Index3{4, 3, 2}));
  EXPECT_EQ(ValuesOf(c_order), Counted(24));
  // The same array a[z, y, x] with z fastest in memory.
  FileBytes fortran;
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 3; ++y) {
      for (int z = 0; z < 2; ++z) fortran += char(NumberIn({4, 3, 2}, {x, y, z}));
    }
  }
  const LoadedVolume loaded = Read("v.npy", NpyHeader("|u1", "(2, 3, 4)", true) + fortran, {.spacing = Vec3{0.5, 1.25, 3}});
  EXPECT_EQ(loaded.info.finest().geometry.size, (Index3{4, 3, 2}));
  EXPECT_EQ(loaded.info.finest().geometry.spacing, (Vec3{0.5, 1.25, 3}));
  EXPECT_EQ(ValuesOf(loaded), Counted(24));
}

TEST_F(ReadersTest, NumPyHasEveryTypeAndVersion) {
  for (int type = 0; type <= int(SampleType::kFloat64); ++type) {
    for (const bool big_endian : {false, true}) {
      const FileSpec spec{.type = SampleType(type), .big_endian = big_endian};
      EXPECT_EQ(ValuesOf(Read("v.npy", NpyHeader(spec) + EncodeSamples(spec.type, Counted(24), big_endian))), Counted(24));
    }
  }
  for (const int version : {1, 2, 3}) {
    EXPECT_EQ(ValuesOf(Read("v.npy", NpyHeader("|b1", "(1, 1, 3)", false, version) + FileBytes("\0\1\1", 3))),
              (std::vector<double>{0, 1, 1}));
  }
  EXPECT_EQ(ValuesOf(Read("v.npy", NpyHeader("<f2", "(1, 1, 7)") + Halves(kHalves))), kHalfValues);
  EXPECT_EQ(ValuesOf(Read("v.npy", NpyHeader("|u1", "(2L, 1L, 1L)") + "ab")), (std::vector<double>{'a', 'b'}));
}

TEST_F(ReadersTest, ANumPyArrayOfTwoAxesIsASlice) {
  const LoadedVolume c = Read("v.npy", NpyHeader("|u1", "(2, 3)") + "abcdef"),
                     fortran = Read("v.npy", NpyHeader("|u1", "(2, 3)", true) + "adbecf");
  for (const LoadedVolume* const loaded : {&c, &fortran}) {
    EXPECT_EQ(loaded->info.finest().geometry.size, (Index3{3, 2, 1}));
    EXPECT_EQ(ValuesOf(*loaded), (std::vector<double>{'a', 'b', 'c', 'd', 'e', 'f'}));
  }
}

TEST_F(ReadersTest, NumPySaysWhatItIsNot) {
  const std::pair<FileBytes, const char*> files[] = {
      {NpyHeader("|u1", "(24,)"), "has 1 dimensions"},
      {NpyHeader("|u1", "()"), "has 0 dimensions"},
      {NpyHeader("|u1", "(2, 3, -4)"), "size along x is -4"},
      {NpyHeader("|u1", "(2, 3, four)"), "its shape is missing"},
      {NpyHeader("<c8", "(2, 3, 4)"), "dtype '<c8' is not supported"},
      {NpyHeader("|u1", "(2, 3, 4)", false, 4), "version 4 is not supported"},
      {NpyHeader("|u1", "(5, 2, 3, 4)") + FileBytes(96, 'x'), "holds 5 volumes, of which --time takes one: 0 to 4"},
      {"not an array at all", "does not begin with \\x93NUMPY"},
  };
  for (const auto& [header, why] : files) EXPECT_THAT(WhyNot("v.npy", header + FileBytes(24, 'x')), HasSubstr(why));
}

// --- raw samples

TEST_F(ReadersTest, RawSamplesAreWhatTheOptionsSay) {
  const std::vector<double> values = {-5, 1000, 3, -32768, 7, 8};
  const FileBytes file = "12345" + EncodeSamples(SampleType::kInt16, values, true);
  ReadOptions options{.spacing = Vec3{0.5, 1.25, 3}, .dims = Index3{3, 2, 1}, .type = SampleType::kInt16, .big_endian = true, .offset = 5};
  for (const char* name : {"v.raw", "v.dat", "without_ending"}) {
    const LoadedVolume loaded = Read(name, file, options);
    EXPECT_EQ(ValuesOf(loaded), values);
    EXPECT_EQ(loaded.info.finest().geometry.size, (Index3{3, 2, 1}));
    EXPECT_EQ(loaded.info.finest().geometry.spacing, (Vec3{0.5, 1.25, 3}));
    EXPECT_EQ(loaded.info.format, "raw");
  }
  options.offset = 6;
  EXPECT_EQ(ReadVolume(directory_ / "v.raw", options).status().code(), StatusCode::kDataLoss);
  options.type.reset();
  EXPECT_THAT(WhyNotPath(directory_ / "v.raw", options), HasSubstr("raw files need --type TYPE, or in --data"));
  EXPECT_THAT(WhyNotPath(directory_ / "v.raw"), HasSubstr("v.raw?dims=X,Y,Z,type=TYPE"));
  EXPECT_FALSE(LooksLikeVolume(directory_ / "v.raw")) << "the samples of a .mhd are no volume of their own";
}

// --- several volumes, several components

TEST_F(ReadersTest, OneOfSeveralVolumesIsTaken) {
  std::vector<double> values = Counted(96);
  const FileBytes samples = EncodeSamples(SampleType::kUint8, values);
  const std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 5 3 2 3\nkinds: domain domain domain list\n";
  const struct {
    const char* file;
    FileBytes bytes;
    int volumes;
    std::size_t voxels;
  } files[] = {
      {"v.nii", NiftiHeader({.dimensions = {4, 3, 2, 4}}) + samples, 4, 24},
      {"v.nii.gz", Gzip(NiftiHeader({.dimensions = {4, 3, 2, 4}}) + samples), 4, 24},
      {"v.nrrd", nrrd + "encoding: raw\n\n" + samples, 3, 30},
      {"v.nrrd", nrrd + "encoding: gzip\n\n" + Gzip(samples), 3, 30},
      {"v.mha", "NDims = 4\nDimSize = 4 3 2 4\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + samples, 4, 24},
      {"v.mrc", MrcHeader({.volumes = 4}) + samples, 4, 24},
      {"v.npy", NpyHeader("|u1", "(4, 2, 3, 4)") + samples, 4, 24},
  };
  for (const auto& [file, bytes, volumes, voxels] : files) {
    SCOPED_TRACE(file);
    for (int time = 0; time < volumes; ++time) {
      const LoadedVolume loaded = Read(file, bytes, {.time = TimeRange{time, time}});
      EXPECT_EQ(ValuesOf(loaded),
                std::vector<double>(values.begin() + time * std::ptrdiff_t(voxels), values.begin() + (time + 1) * std::ptrdiff_t(voxels)));
    }
    EXPECT_THAT(WhyNot(file, bytes), HasSubstr(fmt::format("holds {} volumes, of which --time takes one: 0 to {}", volumes, volumes - 1)));
    EXPECT_THAT(WhyNot(file, bytes, {.time = TimeRange{volumes, volumes}}),
                HasSubstr(fmt::format("time is {}, must be in [0, {}]", volumes, volumes - 1)));
  }
  EXPECT_EQ(ValuesOf(Read("v.nii", NiftiHeader({}) + FileBytes(24, 'x'), {.time = TimeRange{0, 0}})).size(), 24U);
  // What is there of the last volume is not enough.
  WriteFile(directory_ / "cut.nii", NiftiHeader({.dimensions = {4, 3, 2, 4}}) + samples.substr(0, 95));
  EXPECT_EQ(ReadVolume(directory_ / "cut.nii", {.time = TimeRange{3, 3}}).status().code(), StatusCode::kDataLoss);
  EXPECT_TRUE(ReadVolume(directory_ / "cut.nii", {.time = TimeRange{2, 2}}).ok());
}

TEST_F(ReadersTest, OneOfSeveralComponentsIsTaken) {
  // Red is the voxel's number, green 100 more, blue 0.
  FileBytes samples;
  for (int i = 0; i < 24; ++i) samples += {char(i), char(i + 100), 0};
  FileBytes nifti = NiftiHeader({});
  nifti[70] = char(128);
  const std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 4 3 2\nspacings: nan 1 1 1\n";
  FileSpec tiff;
  const std::pair<const char*, FileBytes> files[] = {
      {"v.nii", nifti + samples},
      {"v.nrrd", nrrd + "kinds: RGB-color domain domain domain\nencoding: raw\n\n" + samples},
      {"v.nrrd", nrrd + "encoding: raw\n\n" + samples},
      {"v.nrrd",
       nrrd + "space: RAS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: vector space space space\nencoding: raw\n\n" + samples},
      {"v.mha", "NDims = 3\nDimSize = 4 3 2\nElementNumberOfChannels = 3\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + samples},
      {"v.vtk", VtkFile({}, samples, true, " 3")},
      {"v.vti", VtiFile({}, samples, {.components = 3})},
  };
  std::vector<double> luminance, green;
  for (int i = 0; i < 24; ++i) {
    luminance.push_back(std::nearbyint(0.2126 * i + 0.7152 * (i + 100)));
    green.push_back(i + 100);
  }
  for (const auto& [file, bytes] : files) {
    SCOPED_TRACE(file);
    EXPECT_THAT(WhyNot(file, bytes), HasSubstr("has 3 components a voxel, of which --channel takes one: 0 to 2, or luminance"));
    EXPECT_EQ(ValuesOf(Read(file, bytes, {.channel = 0})), Counted(24));
    EXPECT_EQ(ValuesOf(Read(file, bytes, {.channel = 1})), green);
    EXPECT_EQ(ValuesOf(Read(file, bytes, {.channel = kLuminance})), luminance);
    EXPECT_THAT(WhyNot(file, bytes, {.channel = 3}), HasSubstr("channel must be 0 to 2"));
  }
  EXPECT_THAT(WhyNot("v.nii", NiftiHeader({}) + FileBytes(24, 'x'), {.channel = 1}), HasSubstr("has 1 component a voxel"));
  EXPECT_THAT(WhyNot("v.mha",
                     "NDims = 3\nDimSize = 4 3 2\nElementNumberOfChannels = 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
                         FileBytes(48, 'x'),
                     {.channel = kLuminance}),
              HasSubstr("channel must be 0 to 1"));
}

TEST_F(ReadersTest, LabelsAreTold) {
  FileBytes labels = NiftiHeader({});
  labels[68] = char(0xea);
  labels[69] = 3;  // 1002
  EXPECT_TRUE(Read("v.nii", labels + FileBytes(24, 'x')).info.labels);
  EXPECT_FALSE(Read("v.nii", NiftiHeader({}) + FileBytes(24, 'x')).info.labels);
  FileBytes segmentation = NrrdHeader({}, "raw");
  segmentation.insert(segmentation.size() - 1, "Segment0_ID:=liver\n");
  EXPECT_TRUE(Read("v.seg.nrrd", segmentation + FileBytes(24, 'x')).info.labels);
}

TEST_F(ReadersTest, OptionsThatAFormatDoesNotTakeAreNamed) {
  const FileBytes file = NiftiHeader({}) + FileBytes(24, 'x');
  EXPECT_THAT(WhyNot("v.nii", file, {.spacing = Vec3{1, 1, 1}}), HasSubstr("spacing is no option of NIfTI, which takes time, channel"));
  EXPECT_THAT(WhyNot("v.nii", file, {.dims = Index3{1, 1, 1}}), HasSubstr("dims is no option of NIfTI"));
  EXPECT_THAT(WhyNot("v.tif", file, {.offset = 3}), HasSubstr("offset is no option of TIFF"));
}

// --- units

TEST_F(ReadersTest, UnitsOfTextHeadersAreTold) {
  const auto unit = [&](const std::string& name, const std::string& header) {
    return Read(name, header + FileBytes(8, 'x')).info.finest().geometry.orientation.unit;
  };
  const auto nrrd = [&](const std::string& lines) {
    return unit("v.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n" + lines + "\n");
  };
  const std::string scene = "space: 3D-right-handed\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n",
                    patient = "space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n";
  EXPECT_EQ(nrrd(""), std::nullopt);
  EXPECT_EQ(nrrd("spacings: 1 1 2\nunits: \"um\" \"um\" \"um\"\n"), LengthUnit::kMicrometre);
  EXPECT_EQ(nrrd("units: \"microns\" \"microns\" \"microns\"\n"), LengthUnit::kMicrometre);
  EXPECT_EQ(nrrd("units: \"\u03bcm\" \"\u03bcm\" \"\u03bcm\"\n"), LengthUnit::kMicrometre);
  EXPECT_EQ(nrrd("units: \"nanometers\" \"nanometers\" \"nanometers\"\n"), LengthUnit::kNanometre);
  EXPECT_EQ(nrrd(scene + "space units: \"cm\" \"cm\" \"cm\"\n"), LengthUnit::kCentimetre);
  EXPECT_EQ(nrrd(patient + "space units: \"um\" \"um\" \"um\"\n"), LengthUnit::kMicrometre);
  EXPECT_EQ(nrrd(patient + "space units: \"mm\" \"mm\" \"mm\"\n"), std::nullopt) << "goes without saying";
  for (const char* other :
       {"\"mm\" \"mm\" \"um\"", "\"mm\" \"mm\"", "\"pixel\" \"pixel\" \"pixel\"", "mm mm mm", "\"mm\" \"mm\" \"mm", "\""}) {
    EXPECT_EQ(nrrd(std::string("units: ") + other + "\n"), std::nullopt) << other;
  }
  // Not of the axis of components.
  EXPECT_EQ(Read("v.nrrd",
                 "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 1 2 2 2\nencoding: raw\nkinds: vector domain domain domain\n"
                 "units: \"\" \"nm\" \"nm\" \"nm\"\n\n" +
                     FileBytes(8, 'x'),
                 {.channel = 0})
                .info.finest()
                .geometry.orientation.unit,
            LengthUnit::kNanometre);
  const auto meta = [&](const std::string& lines) {
    return unit("v.mha", "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n" + lines + "ElementDataFile = LOCAL\n");
  };
  EXPECT_EQ(meta(""), std::nullopt);
  EXPECT_EQ(meta("DistanceUnits = ?\n"), std::nullopt);
  EXPECT_EQ(meta("DistanceUnits = um\n"), LengthUnit::kMicrometre);
}

}  // namespace
}  // namespace slabstream
