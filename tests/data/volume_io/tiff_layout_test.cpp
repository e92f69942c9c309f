// Which pages of TIFF files are the slices of a volume, and how far apart voxels are: what OME, ImageJ and tifffile say in descriptions.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "data/open/read_volume.h"
#include "tests/data/volume_io/tiff_files.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/expect_near.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using Values = std::vector<double>;
using Color = std::array<float, 3>;

ReadOptions At(int time, int channel) { return {.time = TimeRange{time, time}, .channel = channel}; }

class TiffLayoutTest : public testing::Test {
 protected:
  // Pages of 4 x 3 pixels, filled with numbers from `first` on.
  std::string Write(const std::string& name, const std::string& description, int pages, int first = 0) {
    FileBytes samples;
    for (int page = 0; page < pages; ++page) samples += FileBytes(12, char(first + page));
    WriteTiff(directory_ / name, {.size = {4, 3, pages}}, samples, {.y_resolution = 50, .description = description});
    return directory_ / name;
  }
  std::string Write(const std::string& description, int pages) { return Write("v.tif", description, pages); }

  static LoadedVolume Read(const std::string& path, const ReadOptions& options = {}) {
    Result<LoadedVolume> loaded = ReadVolume(path, options);
    CHECK(loaded.ok()) << loaded.status().message();
    return *std::move(loaded);
  }
  // The first voxel of each slice.
  static Values Slices(const std::string& path, const ReadOptions& options = {}) {
    const Values values = DataValues(*Read(path, options).volume);
    Values slices;
    for (std::size_t i = 0; i < values.size(); i += 12) slices.push_back(values[i]);
    return slices;
  }
  static VolumeGeometry Geometry(const std::string& path, const ReadOptions& options = {}) {
    return Read(path, options).info.finest().geometry;
  }
  // One line that names the path.
  static std::string WhyNot(const std::string& path, const ReadOptions& options = {}, StatusCode code = StatusCode::kInvalidArgument) {
    const Result<LoadedVolume> loaded = ReadVolume(path, options);
    EXPECT_FALSE(loaded.ok());
    EXPECT_THAT(loaded.status().message(), AllOf(HasSubstr(path), testing::Not(HasSubstr("\n"))));
    EXPECT_EQ(loaded.status().code(), code) << loaded.status().message();
    return loaded.status().message();
  }

  TemporaryDirectory directory_;
};

// --- OME-TIFF

std::string Ome(const std::string& pixels, const std::string& channels = "") { return OmeXml(pixels, channels + "<TiffData/>"); }

TEST_F(TiffLayoutTest, OmeSizesAreMicrometres) {
  const auto spacing = [&](const std::string& sizes) {
    return Geometry(Write(Ome("SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\" " + sizes), 2)).spacing;
  };
  EXPECT_EQ(spacing("PhysicalSizeX=\"0.25\" PhysicalSizeY=\"0.5\" PhysicalSizeZ=\"2\""), (Vec3{0.25, 0.5, 2}));
  ExpectNear(
      spacing(
          "PhysicalSizeX=\"250\" PhysicalSizeXUnit=\"nm\" PhysicalSizeY=\"0.5\" PhysicalSizeYUnit=\"\xc2\xb5m\" PhysicalSizeZ=\"0.002\" "
          "PhysicalSizeZUnit=\"mm\""),
      {0.25, 0.5, 2}, 1e-12);
  ExpectNear(
      spacing("PhysicalSizeX=\"1\" PhysicalSizeXUnit=\"\xc3\x85\" PhysicalSizeY=\"100\" PhysicalSizeYUnit=\"pm\" PhysicalSizeZ=\"1\" "
              "PhysicalSizeZUnit=\"thou\""),
      {1e-4, 1e-4, 25.4}, 1e-12);
  EXPECT_EQ(spacing("PhysicalSizeX=\"0.25\" PhysicalSizeZ=\"2\""), (Vec3{0.25, 0.25, 2})) << "pixels are square";
}

TEST_F(TiffLayoutTest, OmeWithoutADistanceOfSlicesKeepsTheSizeOfPixels) {
  const std::string image = "SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\" PhysicalSizeX=\"0.25\" PhysicalSizeY=\"0.5\"";
  for (const char* z : {"", " PhysicalSizeZ=\"2\" PhysicalSizeZUnit=\"pixel\"", " PhysicalSizeZ=\"0\""}) {
    const LoadedVolume loaded = Read(Write(Ome(image + z), 2));
    EXPECT_EQ(loaded.info.finest().geometry.spacing, (Vec3{0.25, 0.5, 0.25})) << z;
    EXPECT_THAT(loaded.info.notes, Contains(HasSubstr("no PhysicalSizeZ")));
  }
}

TEST_F(TiffLayoutTest, OmeSizesHaveAUnit) {
  const auto unit = [&](const std::string& sizes, const ReadOptions& options = {}) {
    return Geometry(Write(Ome("SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\" " + sizes), 2), options).orientation.unit;
  };
  const std::string sizes = "PhysicalSizeX=\"0.25\" PhysicalSizeY=\"0.5\" PhysicalSizeZ=\"2\"";
  EXPECT_EQ(unit(sizes), LengthUnit::kMicrometre);
  EXPECT_EQ(unit(sizes + " PhysicalSizeXUnit=\"nm\""), LengthUnit::kMicrometre);
  EXPECT_EQ(unit(""), std::nullopt);
  EXPECT_EQ(unit(sizes, {.spacing = Vec3{1, 1, 2}}), std::nullopt) << "whoever gives the distances says no unit";
}

TEST_F(TiffLayoutTest, OmePagesAreInTheDimensionOrderWhereTiffDataLeaveItOpen) {
  const std::string sizes = "SizeZ=\"2\" SizeC=\"3\" SizeT=\"2\" DimensionOrder=",
                    channels = "<Channel Name=\"DAPI\"/><Channel Name=\"GFP\"/>";
  EXPECT_EQ(Slices(Write(Ome(sizes + "\"XYZCT\""), 12), At(1, 2)), (Values{10, 11}));
  EXPECT_EQ(Slices(Write(Ome(sizes + "\"XYCZT\""), 12), At(1, 2)), (Values{8, 11}));
  EXPECT_EQ(Slices(Write(OmeXml(sizes + "\"XYTCZ\"", ""), 12), At(1, 2)), (Values{5, 11}));
  EXPECT_EQ(Slices(Write(OmeXml(sizes + "\"XYZTC\"", "<TiffData IFD=\"0\" PlaneCount=\"12\"/>"), 12), At(0, 0)), (Values{0, 1}));
  const std::string path = Write(Ome(sizes + "\"XYZCT\"", channels), 12);
  EXPECT_THAT(WhyNot(path), HasSubstr("holds 2 volumes, of which --time takes one"));
  EXPECT_EQ(Slices(path, {.time = TimeRange{0, 0}}), (Values{0, 1})) << "the first channel";
  EXPECT_THAT(WhyNot(path, At(0, 3)), HasSubstr("has 3 channels, so channel must be 0 to 2 (0: DAPI, 1: GFP, 2)"));
  const LoadedVolume loaded = Read(path, At(1, 1));
  EXPECT_EQ(loaded.info.times.count, 2);
  EXPECT_EQ(loaded.info.time, 1);
  EXPECT_THAT(loaded.info.notes, Contains(HasSubstr("from page to page Z runs fastest, then C, then T")));
}

TEST_F(TiffLayoutTest, OmeSaysHowChannelsAreShownAndWhenTimesAre) {
  const std::string sizes = "SizeZ=\"2\" SizeC=\"3\" SizeT=\"2\" DimensionOrder=\"XYZCT\" ";
  const auto info = [&](const std::string& pixels, const std::string& channels) {
    return Read(Write(Ome(sizes + pixels, channels), 12), At(0, 0)).info;
  };
  const SourceInfo read = info("TimeIncrement=\"250\" TimeIncrementUnit=\"ms\"",
                               "<Channel Name=\"DAPI\" Color=\"65535\"/><Channel Color=\"-16776961\"/><Channel Name=\"x\" Color=\"-1\"/>");
  EXPECT_THAT(read.channels, ElementsAre(FieldInfo{.name = "DAPI", .color = Color{0, 0, 1}}, FieldInfo{.color = Color{1, 0, 0}},
                                         FieldInfo{.name = "x", .color = Color{1, 1, 1}}));
  EXPECT_EQ(read.times, (TimeAxis{2, 250, "ms"}));
  EXPECT_EQ(info("TimeIncrement=\"3\"", "").times, (TimeAxis{2, 3, "s"}));
  for (const char* color : {"", "red", "4294967295", "1.5", "255", "99999999999999999999"}) {
    const SourceInfo damaged = info("TimeIncrement=\"NaN\"", fmt::format("<Channel Color=\"{}\"/>", color));
    EXPECT_THAT(damaged.channels, ElementsAre(FieldInfo{}, FieldInfo{}, FieldInfo{})) << color;
    EXPECT_EQ(damaged.times, (TimeAxis{2}));
  }
  // One channel that is described; more descriptions than channels.
  const std::string one = Write(Ome("SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\"",
                                    "<Channel Name=\"GFP\" Color=\"16711935\"/><Channel Name=\"none\"/>"),
                                2);
  EXPECT_THAT(Read(one).info.channels, ElementsAre(FieldInfo{.name = "GFP", .color = Color{0, 1, 0}}));
  EXPECT_THAT(WhyNot(one, {.channel = 1}), HasSubstr("has 1 channel, so channel must be 0"));
}

TEST_F(TiffLayoutTest, TiffDataSayWhichPageAPlaneIs) {
  const std::string sizes = "SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\" DimensionOrder=\"XYZCT\"";
  const auto data = [](int channel, int slice, int page, int base) {
    return fmt::format("<TiffData FirstC=\"{}\" FirstZ=\"{}\" IFD=\"{}\"/>", channel + base, slice + base, page);
  };
  for (const int base : {0, 1}) {  // some writers count from 1
    std::string planes;
    for (const int channel : {0, 1}) {
      for (const int slice : {0, 1, 2}) planes += data(channel, slice, 2 * (2 - slice) + channel, base);
    }
    const std::string path = Write(OmeXml(sizes, planes), 6);
    EXPECT_EQ(Slices(path, {.channel = 0}), (Values{4, 2, 0}));
    EXPECT_EQ(Slices(path, {.channel = 1}), (Values{5, 3, 1}));
  }
  EXPECT_EQ(
      Slices(
          Write(OmeXml(sizes, "<TiffData FirstC=\"1\" IFD=\"0\" PlaneCount=\"3\"/><TiffData FirstC=\"0\" IFD=\"3\" NumPlanes=\"3\"/>"), 6),
          {.channel = 1}),
      (Values{0, 1, 2}));
  EXPECT_THAT(WhyNot(Write(OmeXml(sizes, data(0, 0, 0, 0)), 6)), HasSubstr("names no page for slice 1 of channel 0 at time 0"));
  EXPECT_THAT(WhyNot(Write(OmeXml(sizes, "<TiffData IFD=\"4\" PlaneCount=\"6\"/>"), 6)), HasSubstr("names page 6 of"));
  EXPECT_THAT(WhyNot(Write(OmeXml(sizes, "<TiffData IFD=\"-1\"/>"), 6)), HasSubstr("IFD of a TiffData is '-1'"));
}

// Each channel in a file of its own; any of them opens the set.
class OmeSetTest : public TiffLayoutTest {
 protected:
  OmeSetTest() {
    for (const int channel : {0, 1}) {
      planes_ += fmt::format(
          "<TiffData FirstC=\"{0}\" IFD=\"0\" PlaneCount=\"3\"><UUID FileName=\"{1}c{0}.ome.tif\">urn:uuid:{0}</UUID></TiffData>", channel,
          channel == 1 ? "D:\\scans\\" : "");
    }
  }
  std::string WriteFileOf(int channel) {
    return Write(fmt::format("c{}.ome.tif", channel), OmeXml(sizes_, planes_, fmt::format("urn:uuid:{}", channel)), 3, 10 * channel);
  }

  const std::string sizes_ = "SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\" DimensionOrder=\"XYZCT\"";
  std::string planes_;
};

TEST_F(OmeSetTest, IsOpenedByAnyOfItsFiles) {
  WriteFileOf(0);
  WriteFileOf(1);
  for (const char* file : {"c0.ome.tif", "c1.ome.tif"}) {
    EXPECT_EQ(Slices(directory_ / file, {.channel = 0}), (Values{0, 1, 2}));
    EXPECT_EQ(Slices(directory_ / file, {.channel = 1}), (Values{10, 11, 12}));
    EXPECT_THAT(Read(directory_ / file).info.notes, Contains(HasSubstr("in 2 files")));
  }
  EXPECT_EQ(Slices(directory_.path(), {.channel = 1}), (Values{10, 11, 12})) << "so does its folder";
}

TEST_F(OmeSetTest, PlanesOfAFileMayRunAlongAnotherAxisThanDimensionOrderSays) {
  const std::string sizes = "SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\" DimensionOrder=\"XYCZT\"";
  for (const int channel : {0, 1}) Write(fmt::format("c{}.ome.tif", channel), OmeXml(sizes, planes_), 3, 10 * channel);
  for (const char* file : {"c0.ome.tif", "c1.ome.tif"}) {
    EXPECT_EQ(Slices(directory_ / file, {.channel = 1}), (Values{10, 11, 12}));
    EXPECT_THAT(Read(directory_ / file).info.notes, Contains(HasSubstr("do not fit the order XYCZT")));
  }
}

TEST_F(OmeSetTest, NamesAFileThatIsMissing) {
  const std::string path = WriteFileOf(0);
  EXPECT_EQ(Slices(path), (Values{0, 1, 2}));
  EXPECT_THAT(WhyNot(path, {.channel = 1}, StatusCode::kNotFound), HasSubstr("c1.ome.tif, which is not there"));
  std::filesystem::remove(path);
  EXPECT_EQ(Slices(WriteFileOf(1), {.channel = 1}), (Values{10, 11, 12}));
}

TEST_F(OmeSetTest, LooksNowhereButInTheFolder) {
  std::filesystem::create_directory(directory_ / "set");
  const std::string path = Write("set/a.ome.tif",
                                 OmeXml(sizes_,
                                        "<TiffData IFD=\"0\" PlaneCount=\"3\"/><TiffData FirstC=\"1\" IFD=\"0\" PlaneCount=\"3\">"
                                        "<UUID FileName=\"../b.ome.tif\">urn:uuid:1</UUID></TiffData>"),
                                 3);
  Write("b.ome.tif", "", 3);
  EXPECT_THAT(WhyNot(path, {.channel = 1}, StatusCode::kNotFound), HasSubstr("set/b.ome.tif, which is not there"));
}

TEST_F(OmeSetTest, ItsMetadataMayBeInAnotherFile) {
  const std::string companion = directory_ / "v.companion.ome";
  WriteFile(companion, OmeXml(sizes_, planes_));
  for (const int channel : {0, 1}) {
    Write(fmt::format("c{}.ome.tif", channel),
          "<OME UUID=\"urn:uuid:0\"><BinaryOnly MetadataFile=\"v.companion.ome\" UUID=\"urn:uuid:9\"/></OME>", 3, 10 * channel);
  }
  for (const std::string& path : {companion, directory_ / "c0.ome.tif", directory_ / "c1.ome.tif"}) {
    EXPECT_EQ(Slices(path, {.channel = 1}), (Values{10, 11, 12})) << path;
  }
  std::filesystem::remove(companion);
  EXPECT_THAT(WhyNot(directory_ / "c0.ome.tif", {}, StatusCode::kNotFound), AllOf(HasSubstr("OME metadata"), HasSubstr("v.companion.ome")));
}

TEST_F(OmeSetTest, AFileThatWasRenamedIsItself) {
  const std::string sizes = "SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\"",
                    data = "<TiffData IFD=\"0\" PlaneCount=\"3\"><UUID FileName=\"old.ome.tif\">urn:uuid:1</UUID></TiffData>";
  for (const char* uuid : {"urn:uuid:1", "urn:uuid:2", ""}) {
    EXPECT_EQ(Slices(Write("new.ome.tif", OmeXml(sizes, data, uuid), 3)), (Values{0, 1, 2})) << uuid;
  }
  // Another file has the old name since.
  Write("old.ome.tif", OmeXml(sizes, "<TiffData/>", "urn:uuid:3"), 3, 10);
  EXPECT_EQ(Slices(Write("new.ome.tif", OmeXml(sizes, data, "urn:uuid:1"), 3)), (Values{0, 1, 2}));
}

TEST_F(TiffLayoutTest, OneOfSeveralOmeImagesIsTaken) {
  const std::string pixels = "<Pixels SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZCT\" SizeZ=";
  const std::string path =
      Write("<OME><Image Name=\"brain\">" + pixels + "\"2\"><TiffData IFD=\"0\" PlaneCount=\"2\"/></Pixels></Image><Image>" + pixels +
                "\"3\"><TiffData IFD=\"2\" PlaneCount=\"3\"/></Pixels></Image></OME>",
            5);
  EXPECT_EQ(Slices(path), (Values{0, 1}));
  EXPECT_EQ(Slices(path, {.series = "1"}), (Values{2, 3, 4}));
  EXPECT_THAT(Read(path).info.notes, Contains(HasSubstr("image 0 of 2, of which --series takes another one: 0: brain, 1")));
  EXPECT_THAT(WhyNot(path, {.series = "2"}), HasSubstr("series is 2, its OME description has 2 images"));
  EXPECT_THAT(WhyNot(path, {.series = "b"}), HasSubstr("series is 'b'"));
  EXPECT_THAT(WhyNot(Write("", 2), {.series = "0"}), HasSubstr("series is for OME-TIFF"));
}

TEST_F(TiffLayoutTest, OmeDescriptionsThatDoNotFitAreRefused) {
  const std::string order = " DimensionOrder=\"XYZCT\"";
  EXPECT_THAT(WhyNot(Write(Ome("SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\"" + order), 2)),
              HasSubstr("speaks of 3 slices, 1 channel and 1 time, the file has 2 pages"));
  EXPECT_THAT(WhyNot(Write(Ome("SizeZ=\"2\" SizeC=\"1\"" + order), 2)), HasSubstr("SizeT is ''"));
  EXPECT_THAT(WhyNot(Write(Ome("SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" DimensionOrder=\"XYZZZ\""), 2)),
              HasSubstr("DimensionOrder is 'XYZZZ'"));
  EXPECT_THAT(WhyNot(Write("<OME><Image>", 2)), HasSubstr("its OME description"));
  EXPECT_THAT(WhyNot(Write("by a scanner", 2), {.time = TimeRange{1, 1}}), HasSubstr("time is 1, must be in [0, 0]"));
}

// --- ImageJ

TEST_F(TiffLayoutTest, ImageJPagesRunThroughChannelsThenSlicesThenFrames) {
  const std::string header = "ImageJ=1.54f\nimages=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\nmode=composite\nloop=false\n";
  const std::string path = Write(header, 12);
  EXPECT_THAT(WhyNot(path), HasSubstr("--time"));
  for (const int time : {0, 1}) {
    for (const int channel : {0, 1}) {
      const int first = 6 * time + channel;
      EXPECT_EQ(Slices(path, At(time, channel)), (Values{double(first), double(first + 2), double(first + 4)}));
    }
  }
  EXPECT_EQ(Read(path, At(0, 1)).info.channels.size(), 2U);
  EXPECT_EQ(Slices(Write(header + "order=zct\n", 12), At(1, 1)), (Values{9, 10, 11})) << "as Micro-Manager writes it";
  EXPECT_THAT(WhyNot(Write(header + "order=zzt\n", 12)), HasSubstr("order in its ImageJ header is 'ZZT'"));
}

TEST_F(TiffLayoutTest, ImageJHeadersThatDoNotFitThePages) {
  const LoadedVolume loaded = Read(Write("ImageJ=1.54f\nimages=5\nslices=5\n", 7));
  EXPECT_EQ(loaded.info.finest().geometry.size.z, 7);
  EXPECT_THAT(loaded.info.notes, Contains(HasSubstr("speaks of 5 slices: each of its 7 pages is one")));
  EXPECT_THAT(WhyNot(Write("ImageJ=1.54f\nimages=10\nslices=5\nchannels=2\n", 7)),
              HasSubstr("speaks of 5 slices, 2 channels and 1 time, the file has 7 pages"));
  EXPECT_THAT(WhyNot(Write("ImageJ=1.54f\nslices=0\n", 7)), HasSubstr("slices in its ImageJ header is '0'"));
}

// A stack whose slices are called frames is far more common than a film; --time takes its word.
TEST_F(TiffLayoutTest, TimesOfOneSliceAreTakenForSlices) {
  const std::string path = Write("ImageJ=1.54f\nimages=7\nframes=7\n", 7);
  testing::internal::CaptureStderr();
  EXPECT_EQ(Slices(path), (Values{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("taken for slices"));
  EXPECT_EQ(Slices(path, {.time = TimeRange{1, 1}}), (Values{1})) << "the slice of a film";
}

TEST_F(TiffLayoutTest, ImageJSpacingIsThatOfResolutionAndSpacingInItsUnit) {
  // Pixels are 1/100 and 1/50 of the unit.
  const auto geometry = [&](const std::string& lines) { return Geometry(Write("ImageJ=1.54f\nimages=2\nslices=2\n" + lines, 2)); };
  struct Case {
    const char* unit;
    std::optional<LengthUnit> is;
    double factor;
  };
  for (const auto& [unit, is, factor] :
       {Case{"um", LengthUnit::kMicrometre, 1}, Case{"\\u00B5m", LengthUnit::kMicrometre, 1}, Case{"\xb5m", LengthUnit::kMicrometre, 1},
        Case{"\xc2\xb5m", LengthUnit::kMicrometre, 1}, Case{"micron", LengthUnit::kMicrometre, 1}, Case{"mm", LengthUnit::kMillimetre, 1},
        Case{"cm", LengthUnit::kCentimetre, 1}, Case{"nm", LengthUnit::kNanometre, 1}, Case{"inch", LengthUnit::kMicrometre, 25400},
        Case{"pixel", std::nullopt, 1}}) {
    const VolumeGeometry found = geometry(fmt::format("spacing=1.5\nunit={}\n", unit));
    EXPECT_EQ(found.orientation.unit, is) << unit;
    ExpectNear(found.spacing, factor * Vec3{0.01, 0.02, 1.5}, 1e-9 * factor);
  }
  EXPECT_EQ(geometry("unit=um\nspacing=-3\n").spacing.z, 3);
  ExpectNear(geometry("").spacing, Vec3{0.01, 0.02, 1}, 1e-9);
  EXPECT_EQ(geometry("unit=um\n").spacing.z, 1);
}

TEST_F(TiffLayoutTest, ImageJCalibratesValues) {
  const auto values = [&](const std::string& lines) { return Slices(Write("ImageJ=1.54f\nimages=2\nslices=2\n" + lines, 2)); };
  EXPECT_EQ(values("cf=0\nc0=-10.0\nc1=2.0\nvunit=HU\n"), (Values{-10, -8}));
  EXPECT_EQ(values("cf=1\nc0=-10.0\nc1=2.0\nc2=3.0\n"), (Values{0, 1}));
  EXPECT_THAT(Read(directory_ / "v.tif").info.notes, Contains(HasSubstr("function 1 is not applied")));
  // Signed samples of 16 bits.
  WriteTiff(directory_ / "s.tif", {.size = {2, 1, 2}, .type = SampleType::kUint16},
            EncodeSamples(SampleType::kUint16, {0, 32768, 32767, 65535}),
            {.description = "ImageJ=1.54f\nimages=2\nslices=2\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\nmin=-5\nmax=7\n"});
  const LoadedVolume loaded = Read(directory_ / "s.tif");
  EXPECT_EQ(DataValues(*loaded.volume), (Values{-32768, 0, -1, 32767}));
  EXPECT_THAT(loaded.info.channels, ElementsAre(FieldInfo{.window = ValueRange{-5, 7}})) << "calibrated";
  EXPECT_EQ(WhyNot(directory_ / "s.tif", {.channel = 1}), (directory_ / "s.tif") + ": has 1 channel, so channel must be 0");
}

TEST_F(TiffLayoutTest, ImageJSaysHowChannelsAreShown) {
  const std::string path = directory_ / "v.tif";
  const Color red{1, 0, 0}, teal{0, 1, 0.2F};
  const auto channels = [&](const std::string& lines, const ImageJEntries& entries, bool big_endian = true) {
    const FileBytes samples(12 * 4, '\1');
    WriteFile(path, OneDirectoryTiff({4, 3, 4}, 8, big_endian, "ImageJ=1.54f\nimages=4\nchannels=2\nslices=2\n" + lines, samples, entries));
    return Read(path).info.channels;
  };
  for (const bool big_endian : {false, true}) {
    const ImageJEntries looks = LooksOfImageJ(big_endian, {10, 200, -5, 7.5}, {{255, 0, 0}, {0, 255, 51}});
    EXPECT_THAT(channels("mode=composite\n", looks, big_endian), ElementsAre(FieldInfo{.color = red, .window = ValueRange{10, 200}},
                                                                             FieldInfo{.color = teal, .window = ValueRange{-5, 7.5F}}));
    EXPECT_THAT(channels("mode=grayscale\n", looks, big_endian),
                ElementsAre(FieldInfo{.window = ValueRange{10, 200}}, FieldInfo{.window = ValueRange{-5, 7.5F}}));
    EXPECT_EQ(channels("cf=0\nc0=-10\nc1=2\n", looks, big_endian)[0].window, (ValueRange{10, 390}));
  }
  // What makes no sense is not stated; what lies behind it still counts.
  EXPECT_THAT(channels("mode=composite\n", LooksOfImageJ(true, {10, 10, NAN, 7}, {{0, 0, 0}, {255, 0, 0}, {0, 255, 0}})),
              ElementsAre(FieldInfo{}, FieldInfo{.color = red}));
  EXPECT_THAT(channels("min=3\nmax=9\n", {}), ElementsAre(FieldInfo{}, FieldInfo{})) << "those of the channel that was shown last";
}

TEST_F(TiffLayoutTest, DamagedEntriesOfImageJAreIgnored) {
  const std::string path = directory_ / "v.tif";
  const ImageJEntries right = LooksOfImageJ(true, {10, 200, 5, 7}, {{255, 0, 0}, {0, 255, 0}});
  const auto expect_read = [&](const ImageJEntries& entries) {
    WriteFile(path, OneDirectoryTiff({4, 3, 4}, 8, true, "ImageJ=1.54f\nimages=4\nchannels=2\nslices=2\nmode=composite\n",
                                     FileBytes(12 * 4, '\1'), entries));
    const LoadedVolume loaded = Read(path);
    EXPECT_EQ(loaded.info.channels.size(), 2U);
    return loaded.info.channels;
  };
  for (const std::uint32_t size : {0U, 3U, 8U, 12U, 27U, 29U, 100000U, 0xffffffffU}) {
    for (std::size_t entry = 0; entry < right.sizes.size(); ++entry) {
      SCOPED_TRACE(fmt::format("entry {} of {} bytes", entry, size));
      ImageJEntries damaged = right;
      damaged.sizes[entry] = size;
      expect_read(damaged);
    }
  }
  for (std::size_t at = 0; at < 28; ++at) {  // kinds, and how many there are
    ImageJEntries damaged = right;
    damaged.bytes[at] = '\xff';
    expect_read(damaged);
  }
  ImageJEntries few = right;
  few.sizes.resize(3);
  EXPECT_EQ(expect_read(few)[1], (FieldInfo{.window = ValueRange{5, 7}}));
  ImageJEntries none = right;
  none.bytes.resize(20);
  EXPECT_EQ(expect_read(none)[1], FieldInfo{});
}

TEST_F(TiffLayoutTest, ImageJTimesHaveAStep) {
  const auto times = [&](const std::string& lines) {
    return Read(Write("ImageJ=1.54f\nimages=6\nslices=2\nframes=3\n" + lines, 6), At(0, 0)).info.times;
  };
  EXPECT_EQ(times("finterval=2.5\n"), (TimeAxis{3, 2.5, "s"}));
  EXPECT_EQ(times("finterval=2.5\ntunit=min\nfps=7\n"), (TimeAxis{3, 2.5, "min"}));
  EXPECT_EQ(times("finterval=2.5\ntunit=\\u00B5s\n"), (TimeAxis{3, 2.5, "us"}));
  EXPECT_EQ(times("fps=4\ntunit=min\n"), (TimeAxis{3, 0.25, "s"}));
  for (const char* lines : {"", "finterval=0\n", "finterval=-1\n", "finterval=nan\n", "finterval=soon\n", "fps=0\n"}) {
    EXPECT_EQ(times(lines), (TimeAxis{3})) << lines;
  }
}

TEST_F(TiffLayoutTest, ImageJStacksMayHaveOneDirectory) {
  const std::string header = "ImageJ=1.54f\nimages=12\nchannels=2\nslices=3\nframes=2\n", path = directory_ / "v.tif";
  for (const bool big_endian : {false, true}) {
    FileBytes samples;
    for (int page = 0; page < 12; ++page) {
      for (int i = 0; i < 12; ++i) samples += big_endian ? FileBytes{'\1', char(page)} : FileBytes{char(page), '\1'};
    }
    const FileBytes bytes = OneDirectoryTiff({4, 3, 12}, 16, big_endian, header, samples);
    WriteFile(path, bytes);
    EXPECT_EQ(Slices(path, At(1, 1)), (Values{256 + 7, 256 + 9, 256 + 11}));
    WriteFile(path, bytes.substr(0, bytes.size() - 1));
    EXPECT_THAT(WhyNot(path, At(0, 0), StatusCode::kDataLoss), HasSubstr("speaks of 12 pictures, the file holds 11"));
  }
  WriteTiff(path, {.size = {4, 3, 1}}, FileBytes(12, 'x'), {.compression = 5, .description = header});
  EXPECT_THAT(WhyNot(path, At(0, 0)), HasSubstr("must then be uncompressed and in one piece"));
}

// --- tifffile

TEST_F(TiffLayoutTest, TifffileSaysTheShapeOfTheArray) {
  const auto slices = [&](const std::string& json, int pages, const ReadOptions& options) { return Slices(Write(json, pages), options); };
  EXPECT_EQ(slices("{\"shape\": [2, 3, 3, 4]}", 6, At(1, 0)), (Values{3, 4, 5})) << "time, like NumPy's arrays";
  EXPECT_EQ(slices("{\"shape\": [2, 3, 3, 4]}", 6, {.channel = 1}), (Values{3, 4, 5}));
  EXPECT_EQ(slices("{\"shape\": [2, 3, 2, 3, 4]}", 12, At(1, 2)), (Values{10, 11}));
  EXPECT_EQ(slices("{\"shape\": [2, 3, 3, 4], \"axes\": \"ZCYX\"}", 6, {.channel = 2}), (Values{2, 5}));
  EXPECT_EQ(slices("{\"shape\": [2, 1, 3, 3, 4], \"axes\": \"TCZYX\"}", 6, At(1, 0)), (Values{3, 4, 5}));
  EXPECT_EQ(slices("{\"shape\": [5, 3, 4]}", 5, {}), (Values{0, 1, 2, 3, 4}));
  EXPECT_EQ(slices("{\"shape\": [3, 4]}", 5, {}), (Values{0, 1, 2, 3, 4})) << "written page by page";
  EXPECT_EQ(slices("{\"shape\": [2, 3, 4]}", 6, At(2, 0)), (Values{4, 5})) << "written stack by stack";
  EXPECT_THAT(WhyNot(Write("{\"shape\": [2, 3, 3, 4]}", 6)), HasSubstr("--time"));
  EXPECT_THAT(WhyNot(Write("{\"shape\": [2, 3, 2, 2, 3, 4]}", 24)), HasSubstr("more axes"));
  EXPECT_EQ(slices("{\"shape\": [6, 3, 4], \"axes\": \"CYX\"}", 6, {.channel = 4}), (Values{4}));
}

}  // namespace
}  // namespace slabstream
