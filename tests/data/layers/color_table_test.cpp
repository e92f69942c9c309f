// Colour tables of labels: each format by an example as its program writes it, and damaged ones.
#include "data/layers/color_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "common/files/files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

LabelColor OfBytes(int r, int g, int b) { return {float(r) / 255, float(g) / 255, float(b) / 255}; }

// Red 10, green 20, blue 30 for value 7; red 255 for value 200; black elsewhere.
std::string ByteLut() {
  std::string lut(768, '\0');
  lut[7] = 10;
  lut[256 + 7] = 20;
  lut[512 + 7] = 30;
  lut[200] = char(255);
  return lut;
}

constexpr char kItkSnap[] =
    "################################################\n"
    "# ITK-SnAP Label Description File\n"
    "# IDX   -R-  -G-  -B-  -A--  VIS MSH  LABEL\n"
    "################################################\n"
    "    0     0    0    0        0  0  0    \"Clear Label\"\n"
    "    1   255    0    0        1  1  1    \"Left lung\"\n"
    "   12     0  128  255        0.5  1  1    \"#2 of two\"\n";
constexpr char kFreeSurfer[] =
    "#$Id: FreeSurferColorLUT.txt $\n"
    "\n"
    "#No. Label Name:                            R   G   B   A\r\n"
    "\n"
    "0   Unknown                                 0   0   0   0\r\n"
    "2   Left-Cerebral-White-Matter              245 245 245 0\n"
    "14175 wm_rh_S_temporal_transverse           221 60  60\n";
constexpr char kFsl[] =
    "1\t0.00000\t0.93333\t0.5\tFrontal Pole\n"
    "2 1 0 0\n";
constexpr char kParaView[] = R"([{
  "Name": "regions",
  "IndexedColors": [1, 0, 0, 0, 1, 0, 0, 0, 0.5],
  "Annotations": ["4", "four", "2.0", "two", "9", "nine", "11", "eleven"]
}])";

ColorTable Parsed(std::string_view file) {
  Result<ColorTable> table = ParseColorTable(file, "table");
  EXPECT_TRUE(table.ok()) << table.status().message();
  return table.ok() ? *std::move(table) : ColorTable{};
}

TEST(ColorTable, ReadsBytesOfRedGreenAndBlue) {
  const ColorTable table = Parsed(ByteLut());
  EXPECT_EQ(table.entries.size(), 2U) << "black is no colour";
  EXPECT_EQ(table.entries.at(7).color, OfBytes(10, 20, 30));
  EXPECT_EQ(table.entries.at(200).color, OfBytes(255, 0, 0));
}

TEST(ColorTable, ReadsItkSnap) {
  const ColorTable table = Parsed(kItkSnap);
  EXPECT_EQ(table.entries.at(1), (ColorTable::Entry{OfBytes(255, 0, 0), "Left lung"}));
  EXPECT_EQ(table.entries.at(12).color, OfBytes(0, 128, 255));
}

TEST(ColorTable, ReadsFreeSurfer) {
  const ColorTable table = Parsed(kFreeSurfer);
  EXPECT_EQ(table.entries.at(2), (ColorTable::Entry{OfBytes(245, 245, 245), "Left-Cerebral-White-Matter"}));
  EXPECT_EQ(table.entries.at(14175), (ColorTable::Entry{OfBytes(221, 60, 60), "wm_rh_S_temporal_transverse"}));
}

TEST(ColorTable, ReadsFsl) {
  const ColorTable table = Parsed(kFsl);
  EXPECT_EQ(table.entries.at(1), (ColorTable::Entry{{0, 0.93333F, 0.5F}, "Frontal Pole"}));
  EXPECT_EQ(table.entries.at(2), (ColorTable::Entry{{1, 0, 0}, ""}));
}

TEST(ColorTable, ReadsParaViewWhoseColoursComeOverAndOverAgain) {
  const ColorTable table = Parsed(kParaView);
  EXPECT_EQ(table.entries.at(4), (ColorTable::Entry{{1, 0, 0}, "four"}));
  EXPECT_EQ(table.entries.at(2), (ColorTable::Entry{{0, 1, 0}, "two"}));
  EXPECT_EQ(table.entries.at(9), (ColorTable::Entry{{0, 0, 0.5F}, "nine"}));
  EXPECT_EQ(table.entries.at(11), (ColorTable::Entry{{1, 0, 0}, "eleven"}));
  const ColorTable sequence = Parsed(R"({"IndexedColors": [1, 0, 0, 0, 1, 0]})");
  EXPECT_TRUE(sequence.entries.empty());
  EXPECT_EQ(sequence.sequence, (std::vector<LabelColor>{{1, 0, 0}, {0, 1, 0}}));
}

TEST(ColorTable, BadOnesEndInOneLineThatNamesWhatIsWrong) {
  const std::string itk_snap = kItkSnap, many(kMaxColorTableEntries, ' ');
  std::string long_sequence = R"({"IndexedColors": [)";
  for (std::size_t i = 0; i < 3 * kMaxColorTableEntries + 3; ++i) long_sequence += i == 0 ? "0" : ",0";
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"", "not a table of label colours"},
      {std::string(767, '\0'), "not a table of label colours"},
      {"no table at all\n", "not a table of label colours"},
      {itk_snap + "3 1 2 3 1 1 1\n", "line 8: must be VALUE RED GREEN BLUE OPACITY"},
      {itk_snap + "-3 1 2 3 1 1 1 \"x\"\n", "line 8: the label '-3' is not a whole number"},
      {itk_snap + "3 256 2 3 1 1 1 \"x\"\n", "line 8: the colour '256' is not a number in [0, 255]"},
      {itk_snap + "1 25 2 3 1 1 1 \"x\"\n", "line 8: label 1 is given before"},
      {std::string(kFreeSurfer) + "5 name 1 2\n", "line 8: must be VALUE NAME RED GREEN BLUE"},
      {std::string(kFreeSurfer) + "99999999999999999999 name 1 2 3 0\n", "line 8: the label '99999999999999999999'"},
      {std::string(kFsl) + "3 nan 0 0\n", "line 3: the colour 'nan'"},
      {std::string(kFsl) + "3 1.1 0 0\n", "line 3: the colour '1.1' is not a number in [0, 1]"},
      {std::string(kFsl) + "3 1\n", "line 3: must be VALUE RED GREEN BLUE NAME"},
      {"[", "not JSON"},
      {"[]", "the array is empty"},
      {"{}", "without IndexedColors"},
      {R"({"IndexedColors": [1, 0]})", "3 numbers a colour"},
      {R"({"IndexedColors": [1, 0, 2]})", "IndexedColors[2] is not a number in [0, 1]"},
      {R"({"IndexedColors": [1, 0, "x"]})", "IndexedColors[2]"},
      {R"({"IndexedColors": [1, 0, 0], "Annotations": ["1"]})", "2 texts a label"},
      {R"({"IndexedColors": [1, 0, 0], "Annotations": ["1.5", "x"]})", "Annotations[0] is not a whole number"},
      {R"({"IndexedColors": [1, 0, 0], "Annotations": ["1", 2]})", "Annotations[1] is not a text"},
      {R"({"IndexedColors": [1, 0, 0], "Annotations": ["1", "a", "1", "b"]})", "label 1 is given before"},
      {long_sequence + "]}", "1 to 65536 colours"},
      {std::string(100000, '['), "values nest more than 64 deep"},
  };
  for (const auto& [file, why] : bad) {
    const Result<ColorTable> table = ParseColorTable(file, "a/table");
    ASSERT_FALSE(table.ok()) << why;
    EXPECT_EQ(table.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(table.status().message(), HasSubstr(why));
    EXPECT_THAT(table.status().message(), testing::StartsWith("a/table: "));
    EXPECT_EQ(table.status().message().find('\n'), std::string::npos);
  }
}

// Whatever the bytes are, they are a table or end in one line.
TEST(ColorTable, AlteredFilesDoNoHarm) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (const std::string& good : {ByteLut(), std::string(kItkSnap), std::string(kFreeSurfer), std::string(kFsl), std::string(kParaView)}) {
    for (std::size_t length = 0; length < good.size(); ++length) (void)ParseColorTable(good.substr(0, length), "cut");
    for (int i = 0; i < 500; ++i) {
      std::string altered = good;
      for (int changes = 1 + i % 4; changes > 0; --changes)
        altered[std::size_t(random.Real(0, 1) * double(good.size() - 1))] = char(random.Real(0, 255));
      const Result<ColorTable> table = ParseColorTable(altered, "altered");
      if (!table.ok()) {
        EXPECT_EQ(table.status().message().find('\n'), std::string::npos);
        continue;
      }
      for (const auto& [value, entry] : table->entries) {
        for (const float channel : entry.color) ASSERT_TRUE(channel >= 0 && channel <= 1);
      }
    }
  }
}

TEST(ColorTable, FilesAreReadWithinALimit) {
  const TemporaryDirectory directory;
  EXPECT_EQ(ReadColorTable(directory / "none.lut").status().code(), StatusCode::kNotFound);
  ASSERT_TRUE(WriteTextFile(directory / "long.txt", std::string(kMaxColorTableBytes + 1, '#')).ok());
  EXPECT_EQ(ReadColorTable(directory / "long.txt").status().code(), StatusCode::kResourceExhausted);
  ASSERT_TRUE(WriteTextFile(directory / "snap.txt", kItkSnap).ok());
  EXPECT_TRUE(ReadColorTable(directory / "snap.txt").ok());
}

TEST(StandardColor, IsUnlikeThatOfItsNeighbours) {
  for (std::uint32_t value = 1; value < 200; ++value) {
    const LabelColor color = StandardColor(value);
    EXPECT_EQ(color, StandardColor(value));
    for (const float channel : color) EXPECT_TRUE(channel >= 0 && channel <= 1);
    for (std::uint32_t other = value + 1; other < value + 8; ++other) {
      float difference = 0;
      for (std::size_t i = 0; i < 3; ++i) difference = std::max(difference, std::abs(color.at(i) - StandardColor(other).at(i)));
      EXPECT_GT(difference, 0.1F) << value << " and " << other;
    }
  }
}

}  // namespace
}  // namespace slabstream
