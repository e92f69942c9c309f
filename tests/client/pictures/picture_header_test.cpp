// Headers of pictures: those that we write, those of others, and damaged ones.
#include "client/pictures/picture_header.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>
#include <sstream>

#include "client/pictures/picture_writer.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string Big(std::uint32_t value) {
  return {char(value >> 24U), char(value >> 16U & 0xFFU), char(value >> 8U & 0xFFU), char(value & 0xFFU)};
}
std::string Little(std::uint32_t value) {
  return {char(value & 0xFFU), char(value >> 8U & 0xFFU), char(value >> 16U & 0xFFU), char(value >> 24U)};
}

std::string Chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  return Big(std::uint32_t(data.size())) + body +
         Big(std::uint32_t(::crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size())));
}
const std::string kPng("\x89PNG\r\n\x1a\n", 8), kExr("\x76\x2f\x31\x01\2\0\0\0", 8);
std::string Ihdr(std::uint32_t width, std::uint32_t height, char bits, char color) {
  return Chunk("IHDR", Big(width) + Big(height) + std::string{bits, color, 0, 0, 0});
}
const std::string kEnd = Chunk("IDAT", "") + Chunk("IEND", "");

std::string Attribute(const std::string& name, const std::string& type, const std::string& value) {
  return name + '\0' + type + '\0' + Little(std::uint32_t(value.size())) + value;
}
std::string Channel(const std::string& name, std::uint32_t type) { return name + '\0' + Little(type) + std::string(12, '\0'); }
std::string Window(std::uint32_t left, std::uint32_t top, std::uint32_t right, std::uint32_t bottom) {
  return Attribute("dataWindow", "box2i", Little(left) + Little(top) + Little(right) + Little(bottom));
}
const std::string kChannels = Attribute("channels", "chlist", Channel("A", 1) + Channel("Z", 2) + '\0');

class PictureHeaderTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return directory_ / name; }
  Result<PictureHeader> ReadBytes(const std::string& bytes) const {
    std::ofstream(Path("x.png"), std::ios::binary) << bytes;
    return ReadPictureHeader(Path("x.png"));
  }
  std::string Bytes(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(Path(name), std::ios::binary).rdbuf();
    return text.str();
  }
  // A picture that we write, with all that we put into its header.
  void WriteOurs(const std::string& name, PixelFormat format, int bits) const {
    PictureNotes notes;
    notes.geometry.unit = LengthUnit::kMillimetre;
    notes.geometry.pixel_size = 0.25;
    notes.record = R"({"a": "text with \u00e4"})";
    ASSERT_EQ(WritePicture(MakeLocalImage(format, {1, 1, 4, 3}), {6, 5}, Path(name), {.png_bits = bits}, notes), Status::Ok());
  }

  TemporaryDirectory directory_;
};

TEST_F(PictureHeaderTest, ReadsWhatWeWrite) {
  WriteOurs("a.png", PixelFormat::kRgba, 8);
  WriteOurs("b.png", PixelFormat::kRgba, 16);
  WriteOurs("c.exr", PixelFormat::kRgba, 8);
  WriteOurs("d.EXR", PixelFormat::kDepth, 8);
  for (const std::string name : {"a.png", "b.png", "c.exr", "d.EXR"}) {
    SCOPED_TRACE(name);
    EXPECT_TRUE(IsPicturePath(Path(name)));
    const Result<PictureHeader> header = ReadPictureHeader(Path(name));
    ASSERT_TRUE(header.ok()) << header.status().message();
    EXPECT_EQ(header->width, 6U);
    EXPECT_EQ(header->height, 5U);
    ASSERT_TRUE(header->pixel_mm.has_value());
    EXPECT_NEAR(*header->pixel_mm, 0.25, 1e-6);
    EXPECT_EQ(header->record, R"({"a": "text with \u00e4"})");
  }
  EXPECT_EQ(ReadPictureHeader(Path("a.png"))->sample_type, "uint8");
  EXPECT_EQ(ReadPictureHeader(Path("b.png"))->sample_type, "uint16");
  EXPECT_EQ(ReadPictureHeader(Path("c.exr"))->sample_type, "float");
  EXPECT_THAT(ReadPictureHeader(Path("a.png"))->channels, ElementsAre("R", "G", "B", "A"));
  EXPECT_THAT(ReadPictureHeader(Path("d.EXR"))->channels, ElementsAre("A", "B", "G", "R", "Z"));
}

TEST_F(PictureHeaderTest, ReadsPicturesOfOthers) {
  const Result<PictureHeader> png = ReadBytes(kPng + Ihdr(7, 9, 4, 3) + Chunk("pHYs", Big(300) + Big(300) + '\0') +
                                              Chunk("tEXt", std::string("slabstreamer\0no record", 22)) + kEnd);
  ASSERT_TRUE(png.ok()) << png.status().message();
  EXPECT_THAT(png->channels, ElementsAre("palette"));
  EXPECT_EQ(png->sample_type, "uint4");
  EXPECT_FALSE(png->pixel_mm.has_value()) << "of no unit";
  EXPECT_EQ(png->record, "");

  const Result<PictureHeader> exr = ReadBytes(kExr + kChannels + Window(0xFFFFFFFF, 2, 8, 2) + '\0');
  ASSERT_TRUE(exr.ok()) << exr.status().message();
  EXPECT_EQ(exr->width, 10U);  // from -1 to 8
  EXPECT_EQ(exr->height, 1U);
  EXPECT_EQ(exr->sample_type, "mixed");
}

TEST_F(PictureHeaderTest, DamageIsNamed) {
  std::string bad_sum = kPng + Ihdr(4, 4, 8, 6) + kEnd;
  bad_sum[20] ^= 1;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "neither a PNG nor an EXR"},
      {"GIF89a", "neither a PNG nor an EXR"},
      {kPng, "ends within its header"},
      {kPng + kEnd, "does not begin with one header chunk"},
      {kPng + Ihdr(4, 4, 8, 6) + Ihdr(4, 4, 8, 6) + kEnd, "does not begin with one header chunk"},
      {kPng + Ihdr(4, 4, 8, 6), "ends within its header"},
      {kPng + Ihdr(0, 4, 8, 6) + kEnd, "a side of 0 pixels"},
      {kPng + Ihdr(4, 0x80000000, 8, 6) + kEnd, "a side of 2147483648 pixels"},
      {kPng + Ihdr(4, 4, 4, 6) + kEnd, "colour type 6 with 4 bits"},
      {kPng + Ihdr(4, 4, 8, 5) + kEnd, "colour type 5 with 8 bits"},
      {kPng + Ihdr(4, 4, 0, 0) + kEnd, "colour type 0 with 0 bits"},
      {kPng + Chunk("IHDR", "abc") + kEnd, "header chunk is too short"},
      {bad_sum, "the checksum of chunk IHDR does not hold"},
      {kPng + Ihdr(4, 4, 8, 6) + Big(0xFFFFFFFF) + "tEXt", "ends within its header"},
      {kExr, "ends within its header"},
      {kExr + '\0', "no size or no channels"},
      {kExr + kChannels + '\0', "no size or no channels"},
      {kExr + Window(0, 0, 3, 3) + '\0', "no size or no channels"},
      {kExr + kChannels + Window(3, 0, 1, 3) + '\0', "its data window"},
      {kExr + kChannels + Window(0x80000000, 0, 0x7FFFFFFF, 3) + '\0', "its data window"},
      {kExr + Attribute("dataWindow", "box2i", "abc"), "its data window"},
      {kExr + Attribute("channels", "chlist", Channel("A", 3) + '\0'), "its list of channels"},
      {kExr + Attribute("channels", "chlist", Channel("A", 1)), "its list of channels"},
      {kExr + "x" + '\0' + "string" + '\0' + Little(0xFFFFFFFF) + "abc", "ends within its header"},
  };
  for (const auto& [bytes, message] : cases) {
    const Result<PictureHeader> header = ReadBytes(bytes);
    ASSERT_FALSE(header.ok()) << message;
    EXPECT_EQ(header.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(header.status().message(), testing::AllOf(HasSubstr("x.png"), HasSubstr(message)));
  }
  EXPECT_EQ(ReadPictureHeader(Path("missing.png")).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(ReadPictureHeader(directory_.path()).status().code(), StatusCode::kInvalidArgument);
}

// What begins like a header and ends too early is damaged; what is altered in any other way does no harm.
TEST_F(PictureHeaderTest, CutAndAlteredFilesDoNoHarm) {
  Random random(93);
  SCOPED_TRACE(random.trace());
  WriteOurs("a.png", PixelFormat::kRgba, 8);
  WriteOurs("b.exr", PixelFormat::kDepth, 8);
  for (const std::string name : {"a.png", "b.exr"}) {
    const std::string whole = Bytes(name);
    const std::size_t header = name == "a.png" ? whole.find("IDAT") - 4 : whole.find("slabstream\0") + 40;
    ASSERT_LT(header, whole.size());
    for (std::size_t size = 0; size < header; ++size) EXPECT_FALSE(ReadBytes(whole.substr(0, size)).ok()) << name << " " << size;
    for (int i = 0; i < 2000; ++i) {
      std::string altered = whole;
      for (int k = random.Integer(1, 4); k > 0; --k)
        altered[std::size_t(random.Integer(0, int(whole.size()) - 1))] = char(random.Integer(0, 255));
      const Result<PictureHeader> read = ReadBytes(altered);
      if (!read.ok()) {
        EXPECT_EQ(read.status().message().find('\n'), std::string::npos);
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
