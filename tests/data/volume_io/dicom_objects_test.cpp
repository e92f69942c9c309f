// DICOM objects beside the plain series of slices: several volumes in a series, copies of images, nuclear medicine, segmentations, float
// pixels; and files that are written in unusual ways.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "tests/data/codecs/packed_bytes.h"
#include "tests/data/volume_io/dicom_files.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/support/expect_near.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr DicomTag kSopClass = 0x00080016, kSopInstance = 0x00080018, kSpacingBetweenSlices = 0x00180088;
constexpr DicomTag kPositionSequence = 0x00209113, kOrientationSequence = 0x00209116, kMeasuresSequence = 0x00289110,
                   kFrameContent = 0x00209111;

// The patient's axes as those of the voxels, so that their order stays as in the file.
const DicomValues kUpright = {{kTagOrientation, "-1\\0\\0\\0\\-1\\0"}};

LoadedVolume MustRead(const std::string& path, const ReadOptions& options = {}) {
  Result<LoadedVolume> loaded = ReadVolume(path, options);
  CHECK(loaded.ok()) << loaded.status().message();
  return *std::move(loaded);
}

std::string WhyNot(const std::string& path, const ReadOptions& options = {}) { return ReadVolume(path, options).status().message(); }

ReadOptions AtTimeOf(int time) { return {.time = TimeRange{time, time}}; }

// A slice of 4 x 3 pixels of one value.
DicomSpec Slice(double z, int value, const DicomValues& changed = {}) {
  DicomSpec spec{.pixels = EncodeSamples(SampleType::kInt16, std::vector<double>(12, value))};
  spec.values[kTagPosition] = fmt::format("0\\0\\{}", z);
  for (const auto& [tag, text] : kUpright) spec.values[tag] = text;
  for (const auto& [tag, text] : changed) spec.values[tag] = text;
  return spec;
}

// An image of several frames of 4 x 3 pixels, without any place.
DicomSpec Frames(std::size_t count, SampleType type, const DicomValues& changed) {
  DicomSpec spec;
  for (const DicomTag tag : {kTagPosition, kTagOrientation, kTagPixelSpacing}) spec.values.erase(tag);
  for (const auto& [tag, text] : PixelValues(type)) spec.values[tag] = text;
  spec.values[kTagFrames] = std::to_string(count);
  for (const auto& [tag, text] : changed) spec.values[tag] = text;
  return spec;
}

TEST(DicomObjects, TimesOfASeriesAreTakenByNumber) {
  const TemporaryDirectory directory;
  // In the order of numbers, not of text.
  const std::vector<std::string> echoes = {"9.2", "100", "4.6"};
  for (int echo = 0; echo < 3; ++echo) {
    for (int z = 0; z < 2; ++z) {
      WriteDicom(fmt::format("{}/{}{}", directory.path(), echo, z),
                 Slice(2 * z, 10 * echo + z, {{kTagEchoTime, echoes[std::size_t(echo)]}}));
    }
  }
  EXPECT_THAT(WhyNot(directory.path()),
              AllOf(HasSubstr("EchoTime 4.6, 9.2, 100"), HasSubstr("holds 3 volumes, of which --time takes one")));
  const int in_order[] = {2, 0, 1};
  for (int time = 0; time < 3; ++time) {
    const LoadedVolume loaded = MustRead(directory.path(), AtTimeOf(time));
    EXPECT_EQ(DataValues(*loaded.volume).front(), 10 * in_order[time]);
    EXPECT_EQ(DataValues(*loaded.volume).back(), 10 * in_order[time] + 1);
    EXPECT_EQ(loaded.info.times, (TimeAxis{3})) << "echoes are no times";
    EXPECT_EQ(loaded.info.time, time);
    EXPECT_THAT(loaded.info.notes, Contains(HasSubstr("EchoTime 4.6, 9.2, 100")));
  }
  EXPECT_THAT(WhyNot(directory.path(), AtTimeOf(3)), HasSubstr("time is 3, must be in [0, 2]"));
}

TEST(DicomObjects, TimesOfTheHeartAreMilliseconds) {
  constexpr DicomTag kTriggerTime = 0x00181060;
  const auto times = [&](const std::vector<std::string>& triggers) {
    const TemporaryDirectory directory;
    for (std::size_t time = 0; time < triggers.size(); ++time) {
      for (int z = 0; z < 2; ++z) {
        WriteDicom(fmt::format("{}/{}{}", directory.path(), time, z), Slice(2 * z, z, {{kTriggerTime, triggers[time]}}));
      }
    }
    return MustRead(directory.path(), AtTimeOf(0)).info.times;
  };
  EXPECT_EQ(times({"0", "62.5", "31.25"}), (TimeAxis{3, 31.25, "ms"}));
  EXPECT_EQ(times({"0", "10", "31"}), (TimeAxis{3}));
}

// As an enhanced image of a heart or of diffusion has it: frames in the order of their dimensions, two of which are no places.
TEST(DicomObjects, FramesOfSeveralDimensionsAreDivided) {
  const TemporaryDirectory directory;
  DicomSpec spec = Frames(12, SampleType::kInt16, {});
  spec.shared = {{kOrientationSequence, kUpright}, {kMeasuresSequence, {{kTagPixelSpacing, "1\\1"}}}};
  std::vector<double> pixels;
  for (int z = 2; z >= 0; --z) {
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) {
        spec.per_frame.push_back({{kPositionSequence, {{kTagPosition, fmt::format("0\\0\\{}", z)}}},
                                  {kFrameContent, {{0x00209157, fmt::format("1 {} {} {}", 3 - z, a + 1, b + 1)}}}});
        pixels.insert(pixels.end(), 12, 100 * z + 10 * a + b);
      }
    }
  }
  spec.pixels = EncodeSamples(SampleType::kInt16, pixels);
  WriteDicom(directory / "enhanced", spec);
  for (int time = 0; time < 4; ++time) {
    const std::vector<double> values = DataValues(*MustRead(directory / "enhanced", AtTimeOf(time)).volume);
    for (std::size_t z = 0; z < 3; ++z) EXPECT_EQ(values[12 * z], 100 * double(z) + 10 * (time / 2) + time % 2);
  }
  EXPECT_THAT(WhyNot(directory / "enhanced"),
              HasSubstr("DimensionIndexValues[3] and DimensionIndexValues[4] 1 and 1, 1 and 2, 2 and 1, ..."));
}

TEST(DicomObjects, OneOfEachCopyIsEnough) {
  for (const DicomSyntax other : {DicomSyntax::kExplicit, DicomSyntax::kRle}) {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory / "copy");
    for (int z = 0; z < 3; ++z) {
      DicomSpec spec = Slice(2 * z, z, {{kSopInstance, fmt::format("1.2.3.{}", z)}});
      WriteDicom(directory / std::to_string(z), spec);
      spec.syntax = other;  // a copy may be packed in another way
      WriteDicom(directory / "copy/" + std::to_string(z), spec);
    }
    const LoadedVolume loaded = MustRead(directory.path());
    EXPECT_EQ(loaded.info.finest().geometry.size.z, 3);
    EXPECT_EQ(DataValues(*loaded.volume).back(), 2);
    EXPECT_THAT(loaded.info.notes, ElementsAre(HasSubstr("3 copies")));
  }
}

TEST(DicomObjects, ImagesOfOneUidThatDifferAreRefused) {
  const struct {
    DicomSpec other;
    const char* what;
  } cases[] = {{Slice(2, 8), "different pixels"},
               {Slice(3, 7), "different sizes, places or rescalings"},
               {Slice(2, 7, {{kTagSlope, "2"}}), "different sizes, places or rescalings"},
               {Slice(2, 7, {{kTagBitsStored, "12"}, {kTagHighBit, "11"}}), "different types of pixels"}};
  for (const auto& each : cases) {
    const TemporaryDirectory directory;
    WriteDicom(directory / "first", Slice(0, 7));
    for (auto [name, spec] : {std::pair("second", Slice(2, 7)), {"third", each.other}}) {
      spec.values[kSopInstance] = "1.2.3.4";
      WriteDicom(directory / name, spec);
    }
    EXPECT_THAT(WhyNot(directory.path()), AllOf(HasSubstr(directory / "second"), HasSubstr(directory / "third"), HasSubstr(each.what)));
  }
}

DicomSpec Nuclear(int frames, const DicomValues& changed) {
  DicomSpec spec = Frames(std::size_t(frames), SampleType::kUint8,
                          {{kSopClass, "1.2.840.10008.5.1.4.1.1.20"},
                           {kTagModality, "NM"},
                           {kTagImageType, "ORIGINAL\\PRIMARY\\RECON TOMO\\EMISSION"},
                           {kTagPixelSpacing, "2\\2"},
                           {kSpacingBetweenSlices, "3"}});
  for (const auto& [tag, text] : changed) spec.values[tag] = text;
  if (changed.contains(kSpacingBetweenSlices) && changed.at(kSpacingBetweenSlices).empty()) spec.values.erase(kSpacingBetweenSlices);
  spec.sequences = {{0x00540022, {{{kTagPosition, "10\\-20\\30"}, {kTagOrientation, "-1\\0\\0\\0\\-1\\0"}}}}};
  for (int i = 0; i < frames; ++i) spec.pixels += FileBytes(12, char(i));
  return spec;
}

// PS3.3 C.8.4.15: the sign of SpacingBetweenSlices is the direction along the normal, which is to superior here.
TEST(DicomObjects, ReconstructedNuclearMedicineLiesAsItsDetectorSays) {
  const TemporaryDirectory directory;
  for (const double spacing : {3.0, -3.0}) {
    WriteDicom(directory / "nm", Nuclear(4, {{kSpacingBetweenSlices, fmt::format("{}", spacing)}}));
    const LoadedVolume loaded = MustRead(directory / "nm");
    const VolumeGeometry& geometry = loaded.info.finest().geometry;
    EXPECT_EQ(geometry.spacing, (Vec3{2, 2, 3}));
    EXPECT_EQ(geometry.orientation.origin, (Vec3{-10, 20, spacing > 0 ? 30.0 : 21.0}));
    EXPECT_EQ(DataValues(*loaded.volume).front(), spacing > 0 ? 0 : 3);
  }
}

TEST(DicomObjects, GatedNuclearMedicineIsDividedByItsVectors) {
  const TemporaryDirectory directory;
  DicomSpec spec = Nuclear(6, {{kTagImageType, "ORIGINAL\\PRIMARY\\RECON GATED TOMO\\EMISSION"}});
  spec.values[0x00540070] = "1 1 1 2 2 2";  // TimeSlotVector
  spec.values[0x00540080] = "3 2 1 3 2 1";  // SliceVector
  WriteDicom(directory / "nm", spec);
  EXPECT_THAT(WhyNot(directory / "nm"), AllOf(HasSubstr("TimeSlotVector 1, 2"), HasSubstr("--time")));
  const LoadedVolume loaded = MustRead(directory / "nm", AtTimeOf(1));
  EXPECT_EQ(DataValues(*loaded.volume).front(), 5) << "slice 1 is the last frame";
  EXPECT_EQ(loaded.info.finest().geometry.orientation.origin.z, 30);
}

TEST(DicomObjects, NuclearMedicineWithoutSlicesIsNamed) {
  const TemporaryDirectory directory;
  WriteDicom(directory / "nm", Nuclear(4, {{kTagImageType, "ORIGINAL\\PRIMARY\\TOMO\\EMISSION"}}));
  EXPECT_THAT(WhyNot(directory / "nm"), HasSubstr("of the type 'TOMO' are no slices"));
  WriteDicom(directory / "nm", Nuclear(4, {{kSpacingBetweenSlices, ""}}));
  EXPECT_THAT(WhyNot(directory / "nm"), HasSubstr("no SpacingBetweenSlices"));
}

struct SegmentFrame {
  int segment = 0;
  double z = 0;
  std::vector<int> pixels;  // 12
};

// Bits are packed across frames, the lowest bit first (PS3.5 section 8.1.1).
FileBytes Packed(const std::vector<SegmentFrame>& frames) {
  FileBytes bytes;
  std::size_t bit = 0;
  for (const SegmentFrame& frame : frames) {
    for (const int pixel : frame.pixels) {
      if (bit % 8 == 0) bytes += '\0';
      bytes.back() = char(bytes.back() | pixel << (bit++ % 8));
    }
  }
  return bytes;
}

DicomSpec Segmentation(const std::vector<SegmentFrame>& frames, const std::vector<std::pair<int, std::string>>& segments,
                       const std::string& type = "BINARY") {
  DicomSpec spec =
      Frames(frames.size(), SampleType::kUint8, {{kSopClass, "1.2.840.10008.5.1.4.1.1.66.4"}, {kTagModality, "SEG"}, {0x00620001, type}});
  if (type == "BINARY") {
    for (const DicomTag tag : {kTagBitsAllocated, kTagBitsStored}) spec.values[tag] = "1";
    spec.values[kTagHighBit] = "0";
  }
  spec.shared = {{kOrientationSequence, kUpright}, {kMeasuresSequence, {{kTagPixelSpacing, "1\\1"}, {kSpacingBetweenSlices, "2"}}}};
  for (const SegmentFrame& frame : frames) {
    spec.per_frame.push_back({{kPositionSequence, {{kTagPosition, fmt::format("0\\0\\{}", frame.z)}}},
                              {0x0062000a, {{0x0062000b, std::to_string(frame.segment)}}}});
    if (type != "BINARY") spec.pixels += FileBytes(frame.pixels.begin(), frame.pixels.end());
  }
  if (type == "BINARY") spec.pixels = Packed(frames);
  std::vector<DicomValues> items;
  for (const auto& [number, label] : segments) items.push_back({{0x00620004, std::to_string(number)}, {0x00620005, label}});
  spec.sequences = {{0x00620002, items}};
  return spec;
}

TEST(DicomObjects, SegmentsBecomeLabels) {
  const TemporaryDirectory directory;
  // Frames in any order; that of segment 300 is not in the first slice, and the slice at 4 has none at all.
  const std::vector<int> left = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, right = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1};
  const auto labels = [](const LoadedVolume& loaded) { return DataValues(*loaded.volume); };
  for (const int second : {2, 300}) {
    WriteDicom(directory / "seg",
               Segmentation({{second, 6, right}, {1, 6, left}, {1, 0, left}, {second, 2, right}}, {{second, "Lesion"}, {1, "Liver"}}));
    const LoadedVolume loaded = MustRead(directory / "seg");
    EXPECT_TRUE(loaded.info.labels);
    EXPECT_EQ(loaded.info.finest().type, second == 2 ? ScalarType::kUint8 : ScalarType::kUint16);
    EXPECT_EQ(loaded.info.finest().geometry.size, (Index3{4, 3, 4}));
    EXPECT_EQ(loaded.info.finest().geometry.spacing, (Vec3{1, 1, 2}));
    std::vector<double> expected(48, 0);
    for (std::size_t i = 0; i < 12; ++i) {
      expected[i] = left[i];
      expected[12 + i] = second * right[i];
      expected[36 + i] = left[i] + second * right[i];
    }
    EXPECT_EQ(labels(loaded), expected);
    EXPECT_THAT(loaded.info.notes, Contains(HasSubstr(fmt::format("1 'Liver', {} 'Lesion'", second))));
    const LoadedVolume one = MustRead(directory / "seg", {.channel = 1});
    for (std::size_t i = 0; i < 48; ++i) EXPECT_EQ(labels(one)[i], expected[i] == second ? second : 0);
  }
}

TEST(DicomObjects, SegmentsThatOverlapAreTakenOneByOne) {
  const TemporaryDirectory directory;
  const std::vector<int> all(12, 1);
  WriteDicom(directory / "seg", Segmentation({{1, 0, all}, {1, 2, all}, {2, 2, all}}, {{1, "Liver"}, {2, "Lesion"}}));
  EXPECT_THAT(WhyNot(directory / "seg"),
              AllOf(HasSubstr("segments 1 'Liver' and 2 'Lesion' overlap"), HasSubstr("--channel takes one, of 0 to 1")));
  EXPECT_EQ(DataValues(*MustRead(directory / "seg", {.channel = 1}).volume).back(), 2);
  EXPECT_EQ(DataValues(*MustRead(directory / "seg", {.channel = 0}).volume).back(), 1);
}

TEST(DicomObjects, SharesOfASegmentAreValues) {
  const TemporaryDirectory directory;
  DicomSpec spec = Segmentation({{1, 0, std::vector<int>(12, 50)}, {1, 2, std::vector<int>(12, 100)}, {2, 0, std::vector<int>(12, 25)}},
                                {{1, "Liver"}, {2, "Lesion"}}, "FRACTIONAL");
  spec.values[0x0062000e] = "100";  // MaximumFractionalValue
  WriteDicom(directory / "seg", spec);
  const LoadedVolume loaded = MustRead(directory / "seg");
  EXPECT_FALSE(loaded.info.labels);
  EXPECT_THAT(loaded.info.channels, ElementsAre(FieldInfo{.name = "1 'Liver'"}, FieldInfo{.name = "2 'Lesion'"}));
  EXPECT_NEAR(DataValues(*loaded.volume).front(), 0.5, 1e-6);
  EXPECT_NEAR(DataValues(*loaded.volume).back(), 1, 1e-6);
  EXPECT_NEAR(DataValues(*MustRead(directory / "seg", {.channel = 1}).volume).front(), 0.25, 1e-6);
}

TEST(DicomObjects, ALabelMapIsLabels) {
  const TemporaryDirectory directory;
  // The slice at 2 is left out, since it has no label.
  DicomSpec spec = Segmentation({{0, 0, std::vector<int>(12, 5)}, {0, 4, std::vector<int>(12, 9)}, {0, 6, std::vector<int>(12, 5)}},
                                {{5, "Liver"}, {9, "Lesion"}}, "LABELMAP");
  spec.values[kTagPhotometric] = "PALETTE COLOR";
  WriteDicom(directory / "seg", spec);
  const LoadedVolume loaded = MustRead(directory / "seg");
  EXPECT_TRUE(loaded.info.labels);
  const std::vector<double> values = DataValues(*loaded.volume);
  ASSERT_EQ(values.size(), 48U);
  for (std::size_t z = 0; z < 4; ++z) EXPECT_EQ(values[12 * z], (std::vector<double>{5, 0, 9, 5}[z]));
}

TEST(DicomObjects, SegmentationsThatMakeNoSenseAreRefused) {
  const TemporaryDirectory directory;
  const std::vector<int> none(12, 0);
  const auto why = [&](const DicomSpec& spec) {
    WriteDicom(directory / "seg", spec);
    return WhyNot(directory / "seg");
  };
  EXPECT_THAT(why(Segmentation({{1, 0, none}, {7, 2, none}}, {{1, "Liver"}})), HasSubstr("frame 2 is of segment 7"));
  EXPECT_THAT(why(Segmentation({{1, 0, none}, {1, 2, none}, {1, 2, none}}, {{1, "Liver"}})), HasSubstr("one of several of segment 1"));
  EXPECT_THAT(why(Segmentation({{1, 0, none}, {1, 2, none}, {1, 5, none}}, {{1, "Liver"}})), HasSubstr("2 mm apart"));
  EXPECT_THAT(why(Segmentation({{1, 0, none}}, {{1, "Liver"}})), HasSubstr("a single slice"));
}

TEST(DicomObjects, FloatPixelsAreValues) {
  for (const SampleType type : {SampleType::kFloat32, SampleType::kFloat64}) {
    const TemporaryDirectory directory;
    DicomSpec spec = Frames(2, SampleType::kUint8, {{kTagBitsAllocated, type == SampleType::kFloat32 ? "32" : "64"}});
    for (const DicomTag tag : {kTagBitsStored, kTagHighBit, kTagPixelRepresentation}) spec.values.erase(tag);
    spec.shared = {{kOrientationSequence, kUpright}, {kMeasuresSequence, {{kTagPixelSpacing, "1\\1"}}}};
    for (int z = 0; z < 2; ++z) spec.per_frame.push_back({{kPositionSequence, {{kTagPosition, fmt::format("0\\0\\{}", z)}}}});
    WriteDicom(directory / "map", spec);
    std::vector<double> values;
    for (int i = 0; i < 24; ++i) values.push_back(0.125 * i - 1);
    const FileBytes pixels = EncodeSamples(type, values);
    const bool single = type == SampleType::kFloat32;
    WriteFile(directory / "map", ReadFile(directory / "map") + DicomElement(single ? 0x7fe00008 : 0x7fe00009, single ? "OF" : "OD",
                                                                            std::uint32_t(pixels.size()), pixels));
    EXPECT_EQ(DataValues(*MustRead(directory / "map").volume), values);
  }
}

// Icons of slices may be compressed, in a sequence of any kind.
TEST(DicomObjects, CompressedPixelsInASequenceArePassedOver) {
  constexpr std::uint32_t kOpen = 0xffffffff;
  const FileBytes end = DicomElement(0xfffee0dd, "", 0), item_end = DicomElement(0xfffee00d, "", 0);
  const FileBytes fragments =
      DicomElement(0x7fe00010, "OB", kOpen) + DicomElement(0xfffee000, "", 0) + DicomElement(0xfffee000, "", 6, "\xff\xd8zzz!") + end;
  const FileBytes open_item = DicomElement(0xfffee000, "", kOpen) + fragments + item_end;
  const FileBytes closed_item = DicomElement(0xfffee000, "", std::uint32_t(fragments.size()), fragments);
  const FileBytes icons[] = {DicomElement(0x00880200, "SQ", kOpen) + open_item + end,
                             DicomElement(0x00880200, "SQ", std::uint32_t(closed_item.size()), closed_item),
                             DicomElement(0x60031010, "SQ", kOpen) + closed_item + end,  // private
                             DicomElement(0x60031010, "OB", kOpen) + DicomElement(0xfffee000, "", 4, "abcd") + end,
                             DicomElement(0x60031010, "UN", kOpen) + DicomElement(0xfffee000, "", 4, "abcd") + end};
  for (const FileBytes& icon : icons) {
    const TemporaryDirectory directory;
    for (int z = 0; z < 2; ++z) {
      WriteDicom(directory / std::to_string(z), Slice(z, 7 + z));
      FileBytes file = ReadFile(directory / std::to_string(z));
      file.insert(file.find(DicomElement(0x7fe00010, "OW", 24)), icon);
      WriteFile(directory / std::to_string(z), file);
    }
    EXPECT_EQ(DataValues(*MustRead(directory.path()).volume).back(), 8);
  }
}

TEST(DicomObjects, FilesMayLackPreambleAndMetaInformation) {
  for (const DicomSyntax syntax : {DicomSyntax::kImplicit, DicomSyntax::kExplicit, DicomSyntax::kBigEndian}) {
    for (const bool keep_meta : {false, true}) {
      const TemporaryDirectory directory;
      for (int z = 0; z < 2; ++z) {
        DicomSpec spec = Slice(z, 300 + z);
        spec.syntax = syntax;
        WriteDicom(directory / std::to_string(z), spec);
        const FileBytes file = ReadFile(directory / std::to_string(z));
        WriteFile(directory / std::to_string(z), file.substr(keep_meta ? 132 : BeginOfDataSet(file)));
      }
      EXPECT_EQ(DataValues(*MustRead(directory.path()).volume).back(), 301) << int(syntax) << keep_meta;
    }
  }
}

TEST(DicomObjects, OtherFilesAreNotTakenForDicomWithoutAPreamble) {
  const TemporaryDirectory directory;
  const FileBytes files[] = {
      "", "\x08", FileBytes("\x08\0\x05\0", 4), FileBytes("\x08\0\x05\0\x04\0\0\0abc", 11), FileBytes(4000, '\x08'), FileBytes(4000, '\0')};
  for (const FileBytes& bytes : files) {
    WriteFile(directory / "file", bytes);
    EXPECT_FALSE(LooksLikeVolume(directory / "file"));
  }
}

TEST(DicomObjects, DeflatedDataSetsAreRead) {
  const TemporaryDirectory directory;
  const FileBytes uid = "1.2.840.10008.1.2.1.99";
  std::vector<double> values;
  for (int z = 0; z < 2; ++z) {
    // Larger than the stretch that is in memory, in front of the pixels and among them.
    DicomSpec spec = Slice(z, 0, {{kTagColumns, "200"}, {kTagRows, "150"}});
    std::vector<double> pixels;
    for (int i = 0; i < 200 * 150; ++i) pixels.push_back(i % 777 + z);
    spec.pixels = EncodeSamples(SampleType::kInt16, pixels);
    values.insert(values.end(), pixels.begin(), pixels.end());
    WriteDicom(directory / std::to_string(z), spec);
    const FileBytes file = ReadFile(directory / std::to_string(z));
    FileBytes data = file.substr(BeginOfDataSet(file));
    data.insert(data.find(DicomElement(0x00200011, "IS", 2)), DicomElement(0x00190010, "UN", 70000, FileBytes(70000, 'x')));
    const FileBytes syntax = DicomElement(0x00020010, "UI", std::uint32_t(uid.size()), uid);
    const FileBytes good = FileBytes(128, '\0') + "DICM" + syntax + PackBytes("deflate", data);
    WriteFile(directory / std::to_string(z), good);
    WriteFile(directory / "cut", good.substr(0, good.size() - 200));
    EXPECT_THAT(WhyNot(directory / "cut"), HasSubstr("truncated"));
    std::filesystem::remove(directory / "cut");
  }
  EXPECT_EQ(DataValues(*MustRead(directory.path()).volume), values);
}

// GDCM and libjpeg print what they think; nothing of it may reach the pixels, of this frame or of those that follow in the same process.
TEST(DicomObjects, WhatCodecsPrintBecomesAWarning) {
  const TemporaryDirectory directory;
  constexpr int kSlices = 9;  // one process has eight of them
  std::vector<double> values;
  DicomSpec spec = Frames(kSlices, SampleType::kUint8, {{kTagColumns, "16"}, {kTagRows, "16"}});
  spec.shared = {{kOrientationSequence, kUpright}, {kMeasuresSequence, {{kTagPixelSpacing, "1\\1"}}}};
  spec.frames_syntax = "1.2.840.10008.1.2.4.50";
  for (int z = 0; z < kSlices; ++z) {
    spec.per_frame.push_back({{kPositionSequence, {{kTagPosition, fmt::format("0\\0\\{}", z)}}}});
    WriteJpeg(directory / "slice.jpg", {16, 16, 1}, 1, FileBytes(256, char(20 * z)));
    FileBytes stream = ReadFile(directory / "slice.jpg");
    if (z == 1) stream.insert(stream.size() - 2, "abc");  // in front of the end marker
    spec.frames.push_back(stream);
    values.insert(values.end(), 256, 20 * z);
  }
  std::filesystem::remove(directory / "slice.jpg");
  WriteDicom(directory / "image", spec);
  testing::internal::CaptureStderr();
  const LoadedVolume loaded = MustRead(directory / "image");
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(DataValues(*loaded.volume), values);
  EXPECT_THAT(log, AllOf(HasSubstr("image: frame 2: its compressed pixels may be damaged; the codec says: Corrupt JPEG data")));
  EXPECT_EQ(std::ranges::count(log, '\n'), 1) << log;
}

}  // namespace
}  // namespace slabstream
