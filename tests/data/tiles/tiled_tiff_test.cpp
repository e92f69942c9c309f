// Boxes that are read tile by tile are those of the volume that ReadVolume reads; coarser levels are the smaller pictures of the pages.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <vector>

#include "data/tiles/tiled_tiff.h"
#include "tests/data/positional/read_decoded.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/tiff_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random.h"
#include "tests/support/random_box.h"

namespace slabstream {
namespace {

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options = {}) {
  return OpenTiff(path, options, TestReadContext());
}

std::shared_ptr<VolumeSource> Opened(const std::string& path, const ReadOptions& options = {}) { return Opened(Open(path, options)); }

void ExpectLikeWhole(const std::string& path, const ReadOptions& options, Random& random, int boxes = 10,
                     std::vector<std::string> files = {}) {
  if (files.empty()) files = {path};
  SCOPED_TRACE(path);
  const LoadedVolume whole = ReadDecoded(path, options).value();
  const std::shared_ptr<VolumeSource> source = Opened(path, options);
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.files, files);
  EXPECT_EQ(info.notes, whole.info.notes);
  EXPECT_EQ(info.times, whole.info.times);
  EXPECT_EQ(info.channels, whole.info.channels);
  EXPECT_EQ(info.time, whole.info.time);
  ExpectReadsAs(whole, *source, random, boxes, [](const Box&, const auto&) {});
}

// A TIFF whose pages may have smaller pictures, with the sample Sample() at each place.
struct PyramidSpec {
  Index3 size = {40, 30, 3};
  int levels = 3;
  const char* mode = "w";  // of libtiff: "w8" is BigTIFF, "wb" big endian
  bool in_pages = true;    // as sub-directories; else as pages that follow
  int tile = 16;           // pixels a side; 0: strips
  int components = 1;
  int compression = COMPRESSION_NONE;
  std::string description = {};  // of the first page
  int odd_page = -1;             // which has other tiles
};

std::uint16_t Sample(int level, int page, int x, int y, int component) {
  return std::uint16_t(10000 * level + 1000 * page + 31 * y + x + 7000 * component);
}

Index3 SizeOf(const PyramidSpec& spec, int level) {
  return {std::max(spec.size.x >> level, 1), std::max(spec.size.y >> level, 1), spec.size.z};
}

void WritePyramid(const std::string& path, const PyramidSpec& spec) {
  TIFF* tiff = TIFFOpen(path.c_str(), spec.mode);
  CHECK(tiff != nullptr) << path;
  for (int page = 0; page < spec.size.z; ++page) {
    for (int level = 0; level < spec.levels; ++level) {
      const Index3 size = SizeOf(spec, level);
      const int tile = page == spec.odd_page ? 2 * spec.tile : spec.tile;
      TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, size.x);
      TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, size.y);
      TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
      TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, spec.components);
      TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
      TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, spec.components == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
      TIFFSetField(tiff, TIFFTAG_COMPRESSION, spec.compression);
      if (page == 0 && level == 0 && !spec.description.empty()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, spec.description.c_str());
      if (level > 0) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
      const std::vector<std::uint64_t> places(std::size_t(spec.levels), 0);
      if (level == 0 && spec.levels > 1 && spec.in_pages) TIFFSetField(tiff, TIFFTAG_SUBIFD, spec.levels - 1, places.data());
      const auto fill = [&](int x0, int y0, int width, int height) {
        std::vector<std::uint16_t> samples;
        for (int y = y0; y < y0 + height; ++y) {
          for (int x = x0; x < x0 + width; ++x) {
            for (int c = 0; c < spec.components; ++c) samples.push_back(Sample(level, page, x, y, c));
          }
        }
        return samples;
      };
      if (tile > 0) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, tile);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, tile);
        for (int y = 0; y < size.y; y += tile) {
          for (int x = 0; x < size.x; x += tile) {
            std::vector<std::uint16_t> samples = fill(x, y, tile, tile);
            CHECK_GT(TIFFWriteTile(tiff, samples.data(), std::uint32_t(x), std::uint32_t(y), 0, 0), 0);
          }
        }
      } else {
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 4);
        for (int y = 0; y < size.y; ++y) CHECK_EQ(TIFFWriteScanline(tiff, fill(0, y, size.x, 1).data(), std::uint32_t(y), 0), 1);
      }
      CHECK_EQ(TIFFWriteDirectory(tiff), 1);
    }
  }
  TIFFClose(tiff);
}

constexpr SampleType kTypes[] = {SampleType::kInt8,   SampleType::kUint8, SampleType::kInt16,  SampleType::kUint16,  SampleType::kInt32,
                                 SampleType::kUint32, SampleType::kInt64, SampleType::kUint64, SampleType::kFloat32, SampleType::kFloat64};

TEST(TiledTiff, ReadsEveryTypeInTilesAndStripsAsTheWholeReaderDoes) {
  Random random(41);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  std::vector<int> compressions = {COMPRESSION_NONE};
  for (const int compression : {COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_ZSTD, COMPRESSION_PACKBITS, COMPRESSION_LZMA}) {
    if (TIFFIsCODECConfigured(std::uint16_t(compression)) != 0) compressions.push_back(compression);
  }
  for (const SampleType type : kTypes) {
    for (const int tile : {0, 16}) {
      const FileSpec spec{
          .size = {random.Integer(1, 50), random.Integer(1, 40), random.Integer(2, 5)}, .type = type, .big_endian = random.Chance(0.5)};
      std::vector<double> values(CountIn(spec.size));
      for (double& value : values) value = random.Integer(0, 127);
      const int compression = compressions[random.Integer<std::size_t>(0, compressions.size() - 1)];
      WriteTiff(directory / "v.tif", spec, EncodeSamples(type, values), {.compression = compression, .tile = tile});
      ExpectLikeWhole(directory / "v.tif", {}, random);
      ExpectLikeWhole(directory / "v.tif", {.spacing = Vec3{1, 2, 3}}, random, 1);
    }
  }
  for (const int compression : compressions) {
    WriteTiff(directory / "v.tif", {.size = {33, 20, 3}}, std::string(33 * 20 * 3, 'x'), {.compression = compression, .tile = 16});
    ExpectLikeWhole(directory / "v.tif", {}, random, 3);
  }
  if (TIFFIsCODECConfigured(COMPRESSION_JPEG) != 0) {
    FileBytes smooth;
    for (int i = 0; i < 64 * 48 * 2; ++i) smooth += char(i % 64 + i / 64 % 48);
    WriteTiff(directory / "v.tif", {.size = {64, 48, 2}}, smooth, {.compression = COMPRESSION_JPEG, .tile = 16});
    ExpectLikeWhole(directory / "v.tif", {}, random);
  }
}

TEST(TiledTiff, HasTheSmallerPicturesOfPagesAsLevels) {
  Random random(42);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const char* mode : {"wl", "wb", "wl8", "wb8"}) {
    for (const bool in_pages : {true, false}) {
      for (const int tile : {16, 0}) {
        SCOPED_TRACE(fmt::format("{} {} {}", mode, in_pages, tile));
        const PyramidSpec spec{.mode = mode, .in_pages = in_pages, .tile = tile, .compression = COMPRESSION_LZW};
        WritePyramid(directory / "v.tif", spec);
        ExpectLikeWhole(directory / "v.tif", {}, random, 3);
        const auto source = Opened(directory / "v.tif");
        ASSERT_EQ(source->info().levels.size(), 3U);
        for (int level = 0; level < 3; ++level) {
          const VolumeGeometry& geometry = source->info().levels[std::size_t(level)].description.geometry;
          ASSERT_EQ(geometry.size, SizeOf(spec, level));
          for (int i = 0; i < 4; ++i) {
            const Box box = i == 0 ? geometry.bounds() : RandomBox(random, geometry.bounds());
            const auto bytes = ReadBox(*source, level, box);
            const auto* sample = reinterpret_cast<const std::uint16_t*>(bytes.data());
            for (int z = box.begin.z; z < box.end.z; ++z) {
              for (int y = box.begin.y; y < box.end.y; ++y) {
                for (int x = box.begin.x; x < box.end.x; ++x) ASSERT_EQ(*sample++, Sample(level, z, x, y, 0)) << x << ' ' << y << ' ' << z;
              }
            }
          }
        }
      }
    }
  }
}

TEST(TiledTiff, HasLevelsWhoseCornersCoincide) {
  const TemporaryDirectory directory;
  WritePyramid(directory / "v.tif", {.size = {41, 30, 2}});
  const auto source = Opened(directory / "v.tif", {.spacing = Vec3{0.5, 2, 3}});
  const VolumeGeometry& finest = source->info().levels[0].description.geometry;
  EXPECT_EQ(finest.spacing, (Vec3{0.5, 2, 3}));
  for (const SourceLevel& level : source->info().levels) {
    const VolumeGeometry& geometry = level.description.geometry;
    const auto corner = [](const VolumeGeometry& of, bool last) {
      return of.ToWorld(last ? ToVec3(of.size) - Vec3{0.5, 0.5, 0.5} : Vec3{-0.5, -0.5, -0.5});
    };
    for (const bool last : {false, true}) EXPECT_LT(Length(corner(geometry, last) - corner(finest, last)), 1e-12);
  }
  EXPECT_EQ(source->info().levels[1].block, (Index3{16, 15, 1}));
}

std::string Ome(const std::string& pixels) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image ID=\"Image:0\">"
         "<Pixels " +
         pixels +
         " PhysicalSizeX=\"0.5\" PhysicalSizeY=\"0.25\" PhysicalSizeZ=\"2\"><Channel Name=\"green\"/><Channel/>"
         "<Channel Name=\"red\"/><TiffData/></Pixels></Image></OME>";
}

TEST(TiledTiff, TakesATimeAndAChannelOfOmeFilesInAnyOrderOfPages) {
  Random random(43);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const char* order : {"XYZCT", "XYZTC", "XYCZT", "XYCTZ", "XYTZC", "XYTCZ"}) {
    SCOPED_TRACE(order);
    WritePyramid(directory / "v.ome.tif",
                 {.size = {20, 18, 12},
                  .levels = 2,
                  .description = Ome(fmt::format("SizeZ=\"2\" SizeC=\"3\" SizeT=\"2\" DimensionOrder=\"{}\"", order))});
    for (const int time : {0, 1}) {
      for (const int channel : {0, 1, 2})
        ExpectLikeWhole(directory / "v.ome.tif", {.time = TimeRange{time, time}, .channel = channel}, random, 2);
    }
  }
  const auto source = Opened(directory / "v.ome.tif", {.time = TimeRange{1, 1}, .channel = 2});
  EXPECT_THAT(source->info().channels, ElementsAre(FieldInfo{.name = "green"}, FieldInfo{}, FieldInfo{.name = "red"}));
  EXPECT_EQ(source->info().times.count, 2);
  EXPECT_EQ(source->info().levels.size(), 2U);
  EXPECT_EQ(source->info().levels[0].description.geometry.orientation.unit, LengthUnit::kMicrometre);
  EXPECT_THAT(Open(directory / "v.ome.tif").status().message(), HasSubstr("holds 2 volumes"));
}

TEST(TiledTiff, ReadsAnOmeTiffInSeveralFiles) {
  Random random(46);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  std::string planes;
  for (const int channel : {0, 1}) {
    planes += fmt::format(
        "<TiffData FirstC=\"{0}\" IFD=\"0\" PlaneCount=\"3\"><UUID FileName=\"{0}.ome.tif\">urn:uuid:{0}</UUID></TiffData>", channel);
  }
  const std::string header = OmeXml("SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\" DimensionOrder=\"XYZCT\"", planes);
  for (const int channel : {0, 1}) {
    WritePyramid(directory / fmt::format("{}.ome.tif", channel),
                 {.compression = channel == 0 ? COMPRESSION_NONE : COMPRESSION_LZW, .description = header});
  }
  const std::string first = directory / "0.ome.tif", second = directory / "1.ome.tif";
  ExpectLikeWhole(first, {.channel = 0}, random, 3);
  ExpectLikeWhole(first, {.channel = 1}, random, 3, {first, second});
  ExpectLikeWhole(second, {.channel = 0}, random, 3, {second, first});
  EXPECT_EQ(Opened(first, {.channel = 1})->info().levels.size(), 3U);
}

TEST(TiledTiff, ReadsImageJStacksWithOneDirectory) {
  Random random(47);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const bool big_endian : {false, true}) {
    FileBytes samples;
    for (int i = 0; i < 40 * 30 * 12 * 2; ++i) samples += char(random.Integer(0, 255));
    WriteFile(directory / "v.tif", OneDirectoryTiff({40, 30, 12}, 16, big_endian,
                                                    "ImageJ=1.54f\nimages=12\nchannels=2\nslices=3\nframes=2\nmin=3\nmax=900\n", samples));
    for (const int time : {0, 1}) {
      for (const int channel : {0, 1}) ExpectLikeWhole(directory / "v.tif", {.time = TimeRange{time, time}, .channel = channel}, random, 3);
    }
  }
}

TEST(TiledTiff, ReadsPackedSamplesAndPlanesOfComponents) {
  Random random(48);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const auto sample = [](int x, int y, int z, int component) { return std::uint64_t(x + 3 * y + 50 * z + 500 * component); };
  for (const int bits : {1, 8, 12, 16}) {
    for (const int tile : {0, 16}) {
      for (const int planar : {PLANARCONFIG_CONTIG, PLANARCONFIG_SEPARATE}) {
        WriteTiffKind(directory / "v.tif", {37, 21, 3}, {.bits = bits, .components = 2, .planar = planar, .tile = tile}, sample);
        for (const int component : {0, 1}) ExpectLikeWhole(directory / "v.tif", {.channel = component}, random, 3);
      }
    }
  }
}

TEST(TiledTiff, TakesAComponentOfAPixel) {
  Random random(44);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const int tile : {16, 0}) {
    WritePyramid(directory / "v.tif", {.levels = 2, .tile = tile, .components = 3});
    for (const int channel : {0, 1, 2}) ExpectLikeWhole(directory / "v.tif", {.channel = channel}, random, 4);
  }
  const std::shared_ptr<VolumeSource> second = Opened(directory / "v.tif", {.channel = 1});
  EXPECT_EQ(second->info().channels.size(), 3U);
  EXPECT_EQ(SamplesOf<std::uint16_t>(*second->At(0, 2)).value(),
            SamplesOf<std::uint16_t>(*Opened(directory / "v.tif", {.channel = 2})).value());
  EXPECT_THAT(Open(directory / "v.tif").status().message(), HasSubstr("has 3 components a voxel"));
  EXPECT_EQ(Opened(directory / "v.tif", {.channel = kLuminance}), nullptr) << "is decoded as a whole";
}

TEST(TiledTiff, ReadsOnlyTheTilesOfABox) {
  const TemporaryDirectory directory;
  WritePyramid(directory / "v.tif", {.size = {160, 160, 4}, .levels = 1});
  const auto source = Opened(directory / "v.tif");
  ReadBox(*source, 0, {{16, 32, 1}, {32, 48, 2}});
  EXPECT_EQ(source->counts().chunks, 1U);
  EXPECT_EQ(source->counts().stored_bytes, 512U);
}

TEST(TiledTiff, LeavesFoldersOfSlicesToWhoDecodesThemAsAWhole) {
  const TemporaryDirectory directory;
  WritePyramid(directory / "v.tif", {});
  EXPECT_NE(Opened(directory / "v.tif"), nullptr);
  EXPECT_EQ(Opened(directory.path()), nullptr);
}

TEST(TiledTiff, NamesWhatIsWrong) {
  const TemporaryDirectory directory;
  const std::string path = directory / "v.tif";
  WriteFile(path, "no picture");
  EXPECT_THAT(Open(path).status().message(), HasSubstr("not a TIFF volume"));
  WritePyramid(path, {.size = {40, 30, 1}});
  EXPECT_EQ(Opened(path)->info().levels[0].description.geometry.size, (Index3{40, 30, 1})) << "a slice";

  WritePyramid(path, {.odd_page = 2});
  const auto odd = Opened(path);
  AlignedVector<std::byte> bytes(2);
  EXPECT_TRUE(odd->ReadNow(0, {{0, 0, 1}, {1, 1, 2}}, bytes).ok());
  EXPECT_THAT(odd->ReadNow(0, {{0, 0, 2}, {1, 1, 3}}, bytes).message(),
              AllOf(HasSubstr("v.tif"), HasSubstr("slice 2"), HasSubstr("32 x 32, must have 16 x 16")));

  WritePyramid(path, {.levels = 1, .compression = COMPRESSION_LZW});
  const auto cut = Opened(path);
  std::filesystem::resize_file(path, 100);
  const Status damage = cut->ReadNow(0, {{20, 0, 1}, {21, 1, 2}}, bytes);
  EXPECT_EQ(damage.code(), StatusCode::kDataLoss);
  EXPECT_THAT(damage.message(), AllOf(HasSubstr("v.tif"), HasSubstr("slice 1")));
}

// Whatever the bytes, a file is refused, or its boxes are read or not, within the memory that its size allows.
TEST(TiledTiff, BearsDamagedFiles) {
  Random random(45);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  const std::string path = directory / "v.tif";
  std::vector<FileBytes> files;
  const std::string ome =
      OmeXml("SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\"",
             "<TiffData IFD=\"2\"/><TiffData FirstZ=\"1\" IFD=\"0\" PlaneCount=\"2\"><UUID FileName=\"v.tif\"/></TiffData>");
  for (const PyramidSpec& spec : {PyramidSpec{}, PyramidSpec{.mode = "w8", .tile = 0}, PyramidSpec{.levels = 1, .description = ome},
                                  PyramidSpec{.in_pages = false, .compression = COMPRESSION_LZW}}) {
    WritePyramid(path, spec);
    files.push_back(ReadFile(path));
  }
  WriteTiffKind(path, {37, 21, 3}, {.bits = 12, .tile = 16}, [](int x, int, int, int) { return std::uint64_t(x); });
  files.push_back(ReadFile(path));
  files.push_back(OneDirectoryTiff({40, 30, 12}, 16, true,
                                   "ImageJ=1.54f\nimages=12\nslices=12\nspacing=2\nunit=um\ncf=0\nc0=1\nc1=2\nmin=3\nmax=4\n",
                                   FileBytes(std::size_t{40} * 30 * 12 * 2, 'x')));
  int opened = 0;
  for (const FileBytes& whole : files) {
    for (int i = 0; i < 150; ++i) {
      FileBytes bytes = whole;
      for (int hits = random.Integer(1, 12); hits > 0; --hits) Damage(bytes[random.Integer<std::size_t>(0, bytes.size() - 1)], random);
      if (random.Chance(0.2)) bytes.resize(random.Integer<std::size_t>(0, bytes.size()));
      WriteFile(path, bytes);
      const auto source = Open(path);
      if (!source.ok()) continue;
      ++opened;
      for (int level = 0; level < int((*source)->info().levels.size()); ++level) {
        const VolumeDescription& description = (*source)->info().levels[std::size_t(level)].description;
        const Box box = RandomBox(random, Intersection(description.geometry.bounds(), {{0, 0, 0}, {500, 500, 5}}));
        AlignedVector<std::byte> out(std::size_t(box.voxel_count()) * BytesPerSample(description.type));
        const Status status = (*source)->ReadNow(level, box, out);
        EXPECT_TRUE(status.ok() || status.message().find("v.tif") != std::string::npos) << status.message();
      }
    }
  }
  EXPECT_GT(opened, 50);
}

}  // namespace
}  // namespace slabstream
