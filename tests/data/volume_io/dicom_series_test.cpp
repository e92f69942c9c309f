// Which series of a folder is read, and which are refused, with what is wrong and what to do.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "data/open/read_volume.h"
#include "data/volume_io/dicom_series.h"
#include "tests/data/volume_io/dicom_files.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// A file of the series: slice `z` of one that is 2 mm from slice to slice.
DicomSpec SliceAt(double z, const DicomValues& changed = {}) {
  DicomSpec spec{.pixels = std::string(24, 'x')};
  spec.values[kTagPosition] = fmt::format("0\\0\\{:.9g}", z);
  for (const auto& [tag, value] : changed) {
    if (value.empty()) {
      spec.values.erase(tag);
    } else {
      spec.values[tag] = value;
    }
  }
  return spec;
}

void WriteSlices(const TemporaryDirectory& directory, const std::string& name, const std::vector<DicomSpec>& slices) {
  for (std::size_t i = 0; i < slices.size(); ++i) WriteDicom(fmt::format("{}/{}{}", directory.path(), name, i), slices[i]);
}

DicomValues SeriesNumbered(const std::string& uid, const std::string& number, const std::string& description = "HEAD") {
  return {{kTagSeriesUid, uid}, {kTagSeriesNumber, number}, {kTagSeriesDescription, description}};
}

TEST(DicomSeries, TextsWithControlCharactersAreShownInOneLine) {
  const TemporaryDirectory directory;
  DicomSpec report{.values = {{0x00080016, "1.2.840.10008.5.1.4.1.1.88.11"},
                              {kTagSeriesUid, "1.2\n7"},
                              {kTagModality, "S\nR\x1b[2J"},
                              {kTagSeriesNumber, "1\r"},
                              {kTagSeriesDescription, "two\nlines"}}};
  WriteDicom(directory / "report", report);
  const Result<std::vector<DicomSeries>> all = ListDicomSeries(directory.path());
  ASSERT_TRUE(all.ok()) << all.status().message();
  ASSERT_EQ(all->size(), 1U);
  EXPECT_EQ(all->front().modality, "S\nR\x1b[2J");  // as in the file
  EXPECT_EQ(all->front().trouble.message(), "no images: its modality is 'S?R?[2J'");
  const Result<LoadedVolume> loaded = ReadVolume(directory.path());
  ASSERT_FALSE(loaded.ok());
  EXPECT_THAT(loaded.status().message(), AllOf(HasSubstr("S?R?[2J"), testing::Not(testing::ContainsRegex("[\x01-\x1f]"))));
}

TEST(DicomSeries, TheOnlyVolumeIsChosenAmongOtherThings) {
  const TemporaryDirectory directory;
  WriteSlices(directory, "ct", {SliceAt(0), SliceAt(2), SliceAt(4)});
  DicomValues scout = SeriesNumbered("1.2.4", "2", "SCOUT");
  scout[kTagImageType] = "ORIGINAL\\PRIMARY\\LOCALIZER";
  WriteSlices(directory, "scout", {SliceAt(0, scout), SliceAt(7, scout)});
  DicomValues capture = SeriesNumbered("1.2.5", "99", "DOSE REPORT");
  capture.merge(DicomValues{{kTagPosition, ""}, {kTagOrientation, ""}});
  WriteSlices(directory, "capture", {SliceAt(0, capture)});
  WriteSlices(directory, "single", {SliceAt(0, SeriesNumbered("1.2.6", "4"))});
  DicomSpec report{.values = {{0x00080016, "1.2.840.10008.5.1.4.1.1.88.11"}, {kTagSeriesUid, "1.2.7"}, {kTagModality, "SR"}}};
  WriteDicom(directory / "report", report);

  const Result<LoadedVolume> loaded = ReadVolume(directory.path());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->info.finest().geometry.size, (Index3{4, 3, 3}));
  // A localizer is a volume if one asks for it.
  const Result<LoadedVolume> asked = ReadVolume(directory.path(), {.series = "2"});
  ASSERT_TRUE(asked.ok()) << asked.status().message();
  EXPECT_EQ(asked->info.finest().geometry.spacing.z, 7);

  const Result<std::vector<DicomSeries>> all = ListDicomSeries(directory.path());
  ASSERT_TRUE(all.ok()) << all.status().message();
  std::vector<std::string> kinds;
  for (const DicomSeries& series : *all) kinds.push_back(series.uid + ": " + series.other);
  EXPECT_THAT(kinds, testing::ElementsAre("1.2.7: no images", "1.2.3: ", "1.2.4: a localizer", "1.2.6: a single slice",
                                          "1.2.5: images without a place"));
}

TEST(DicomSeries, AmongSeveralVolumesNoneIsChosenInSilence) {
  const TemporaryDirectory directory;
  WriteSlices(directory, "a", {SliceAt(0), SliceAt(2)});
  WriteSlices(directory, "b", {SliceAt(0, SeriesNumbered("1.2.4", "2", "LUNG")), SliceAt(3, SeriesNumbered("1.2.4", "2", "LUNG"))});
  WriteSlices(directory, "c", {SliceAt(0, SeriesNumbered("1.2.5", "2")), SliceAt(4, SeriesNumbered("1.2.5", "2"))});
  const Status several = ReadVolume(directory.path()).status();
  EXPECT_EQ(several.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(several.message(), AllOf(HasSubstr("3 series"), HasSubstr("--series"), HasSubstr("1 (CT, 2 images, \"HEAD\")"),
                                       HasSubstr("2 (CT, 2 images, \"LUNG\")")));
  const auto spacing = [&](const std::string& series) {
    const Result<LoadedVolume> loaded = ReadVolume(directory.path(), {.series = series});
    return loaded.ok() ? loaded->info.finest().geometry.spacing.z : 0;
  };
  EXPECT_EQ(spacing("1"), 2);
  EXPECT_EQ(spacing("1.2.4"), 3);
  EXPECT_EQ(spacing("1.2.5"), 4);
  const Status ambiguous = ReadVolume(directory.path(), {.series = "2"}).status();
  EXPECT_EQ(ambiguous.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(ambiguous.message(), AllOf(HasSubstr("2 series have the number 2"), HasSubstr("1.2.4"), HasSubstr("1.2.5")));
  const Status unknown = ReadVolume(directory.path(), {.series = "1.2"}).status();
  EXPECT_EQ(unknown.code(), StatusCode::kNotFound);
  EXPECT_THAT(unknown.message(), HasSubstr("no series '1.2'"));
}

TEST(DicomSeries, WithoutAVolumeSaysWhatThereIs) {
  const TemporaryDirectory directory;
  WriteSlices(directory, "a", {SliceAt(0)});
  EXPECT_THAT(ReadVolume(directory.path()).status().message(), AllOf(HasSubstr("a single slice"), HasSubstr("at least 2")));
  EXPECT_THAT(ReadVolume(directory / "a0").status().message(), HasSubstr("'" + directory.path() + "'")) << "names the folder to take";
  WriteSlices(directory, "b", {SliceAt(0, SeriesNumbered("1.2.4", "2"))});
  EXPECT_THAT(ReadVolume(directory.path()).status().message(), AllOf(HasSubstr("none of the 2 series"), HasSubstr("a single slice")));
}

TEST(DicomSeries, ThatIsNoStackIsRefusedByName) {
  const DicomValues echo_1 = {{kTagEchoTime, "4.6"}}, echo_2 = {{kTagEchoTime, "9.2"}};
  const struct {
    const char* name;
    std::vector<DicomSpec> slices;
    std::vector<std::string> words;
  } cases[] = {
      {"gap",
       {SliceAt(0), SliceAt(2), SliceAt(4), SliceAt(8), SliceAt(10)},
       {"1 slice is missing", "it is 4 mm, elsewhere 2 mm", "/s2", "/s3"}},
      {"gaps", {SliceAt(0), SliceAt(2), SliceAt(4), SliceAt(6), SliceAt(12), SliceAt(16)}, {"3 slices are missing", "/s3", "/s4"}},
      {"uneven",
       {SliceAt(0), SliceAt(2), SliceAt(4.6), SliceAt(6), SliceAt(8)},
       {"varies from 1.4 to 2.6 mm", "0.2 of a voxel", "dcm2niix"}},
      {"aside",
       {SliceAt(0), SliceAt(2), SliceAt(4, {{kTagPosition, "0.4\\0\\4"}}), SliceAt(6)},
       {"/s2 lies 0.4 pixels beside its place", "limit 0.2"}},
      {"twice", {SliceAt(0), SliceAt(2), SliceAt(2), SliceAt(4)}, {"4 images at 3 positions", "2 of them at (0, 0, 2)", "dcm2niix"}},
      {"echoes, of which one lacks a slice",
       {SliceAt(0, echo_1), SliceAt(2, echo_1), SliceAt(0, echo_2)},
       {"3 images at 2 positions", "2 of them at (0, 0, 0)", "no attribute divides them"}},
      {"echoes at their own places",
       {SliceAt(0, echo_1), SliceAt(2, echo_1), SliceAt(0, echo_2), SliceAt(2, {{kTagEchoTime, "9.2"}, {kTagPosition, "0.4\\0\\2"}})},
       {"lies 0.4 pixels beside its place"}},
      {"all at one place", {SliceAt(0), SliceAt(0), SliceAt(0)}, {"3 images at 1 positions"}},
      {"sizes", {SliceAt(0), SliceAt(2, {{kTagColumns, "3"}, {kTagRows, "4"}}), SliceAt(4)}, {"several sizes", "is 3 x 4", "is 4 x 3"}},
      {"orientations",
       {SliceAt(0), SliceAt(2, {{kTagOrientation, "0\\1\\0\\0\\0\\-1"}}), SliceAt(4)},
       {"several orientations", "(0, 1, 0)", "(1, 0, 0)", "dcm2niix"}},
      {"spacings", {SliceAt(0), SliceAt(2, {{kTagPixelSpacing, "1\\1.1"}})}, {"several pixel spacings", "1.1 mm"}},
      {"no spacing", {SliceAt(0, {{kTagPixelSpacing, ""}}), SliceAt(2)}, {"no PixelSpacing"}},
      {"zero spacing", {SliceAt(0, {{kTagPixelSpacing, "0\\1"}}), SliceAt(2)}, {"PixelSpacing is 0, 1"}},
      {"no orientation", {SliceAt(0, {{kTagOrientation, ""}}), SliceAt(2)}, {"no ImageOrientationPatient"}},
      {"broken orientation",
       {SliceAt(0, {{kTagOrientation, "1\\0\\0\\1\\0\\0"}}), SliceAt(2)},
       {"ImageOrientationPatient is", "right angles"}},
      {"broken position", {SliceAt(0, {{kTagPosition, "0\\0\\nan"}}), SliceAt(2)}, {"ImagePositionPatient is (0, 0, nan)"}},
      {"one without a place", {SliceAt(0), SliceAt(2, {{kTagPosition, ""}})}, {"no ImagePositionPatient"}},
      {"colours",
       {SliceAt(0, {{kTagSamplesPerPixel, "3"}, {kTagPhotometric, "RGB"}}), SliceAt(2)},
       {"a colour image (RGB, 3 samples a pixel)", "must have 1"}},
      {"palette", {SliceAt(0, {{kTagPhotometric, "PALETTE COLOR"}}), SliceAt(2)}, {"a colour image"}},
      {"mosaic", {SliceAt(0, {{kTagImageType, "ORIGINAL\\PRIMARY\\MOSAIC"}}), SliceAt(2)}, {"mosaic", "dcm2niix"}},
      {"bits", {SliceAt(0, {{kTagBitsAllocated, "12"}}), SliceAt(2)}, {"BitsAllocated is 12", "8, 16 and 32"}},
      {"stored", {SliceAt(0, {{kTagBitsStored, "17"}}), SliceAt(2)}, {"BitsStored is 17"}},
      {"high", {SliceAt(0, {{kTagHighBit, "16"}}), SliceAt(2)}, {"HighBit is 16"}},
      {"slope", {SliceAt(0, {{kTagSlope, "0"}}), SliceAt(2)}, {"RescaleSlope is 0"}},
      {"intercept", {SliceAt(0, {{kTagIntercept, "many"}}), SliceAt(2)}, {"RescaleIntercept nan"}},
      {"wide pixels in big endian",
       {{.values = SliceAt(0, PixelValues(SampleType::kInt32)).values, .pixels = std::string(48, 'x'), .syntax = DicomSyntax::kBigEndian},
        SliceAt(2)},
       {"pixels of 32 bits in big endian"}},
      {"frames", {SliceAt(0, {{kTagFrames, "0"}}), SliceAt(2)}, {"NumberOfFrames is 0"}},
  };
  for (const auto& each : cases) {
    SCOPED_TRACE(each.name);
    const TemporaryDirectory directory;
    WriteSlices(directory, "s", each.slices);
    const Status status = ReadVolume(directory.path(), {.series = "1"}).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), AllOf(HasSubstr(directory.path()), HasSubstr("series 1: "), testing::Not(HasSubstr("\n"))));
    for (const std::string& word : each.words) EXPECT_THAT(status.message(), HasSubstr(word));
  }
}

TEST(DicomSeries, MayBeRoundedAsScannersRound) {
  const TemporaryDirectory directory;
  std::vector<DicomSpec> slices;
  for (int z = 0; z < 60; ++z) slices.push_back(SliceAt(std::round(0.625 * z * 10) / 10));
  WriteSlices(directory, "s", slices);
  const Result<LoadedVolume> loaded = ReadVolume(directory.path());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_NEAR(loaded->info.finest().geometry.spacing.z, 0.625, 0.002);
}

}  // namespace
}  // namespace slabstream
