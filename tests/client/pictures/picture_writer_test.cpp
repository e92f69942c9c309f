// Files are read back with OpenImageIO, unconverted, and compared with what the format promises.
#include "client/pictures/picture_writer.h"
#include "client/pictures/picture_encoder.h"
#include "common/image/sample_codes.h"
#include "tests/support/full_disk.h"
#include "tests/support/temporary_directory.h"

#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct FileImage {
  OIIO::ImageSpec spec;
  std::vector<float> samples;  // width * height * channels; integers scaled to [0, 1]
  std::vector<float> At(int x, int y) const {
    const std::size_t n = std::size_t(spec.nchannels), begin = (std::size_t(y) * std::size_t(spec.width) + std::size_t(x)) * n;
    return {samples.begin() + std::ptrdiff_t(begin), samples.begin() + std::ptrdiff_t(begin + n)};
  }
};

FileImage Read(const std::string& path) {
  OIIO::ImageSpec as_stored;
  as_stored.attribute("oiio:UnassociatedAlpha", 1);  // or OpenImageIO multiplies by alpha
  const auto in = OIIO::ImageInput::open(path, &as_stored);
  if (!in) throw std::runtime_error(OIIO::geterror());
  FileImage image{in->spec(), {}};
  image.samples.resize(image.spec.image_pixels() * std::size_t(image.spec.nchannels));
  in->read_image(0, 0, 0, -1, OIIO::TypeDesc::FLOAT, image.samples.data());
  return image;
}

class ImageWriterTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return directory_ / name; }
  std::size_t FileCount() const {
    return std::size_t(std::distance(std::filesystem::directory_iterator(directory_.path()), std::filesystem::directory_iterator()));
  }

  TemporaryDirectory directory_;
};

// 6 x 4 pixels, of which (2, 1) and (3, 1) are set.
LocalImage TwoPixels(PixelFormat format) {
  LocalImage image = MakeLocalImage(format, {2, 1, 4, 2});
  image.rgba = {0.25F, 0.125F, 0, 0.5F, 1, 0.5F, 0.25F, 1};
  if (format == PixelFormat::kDepth) image.depth = {3.5F, std::numeric_limits<float>::infinity()};
  return image;
}
constexpr ImageSize kSize{6, 4};

TEST_F(ImageWriterTest, PngHoldsStraightAlphaWithoutATransferCurve) {
  ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("a.png"), {}), Status::Ok());
  const FileImage file = Read(Path("a.png"));
  EXPECT_EQ(file.spec.width, 6);
  EXPECT_EQ(file.spec.height, 4);
  EXPECT_EQ(file.spec.format, OIIO::TypeDesc::UINT8);
  const auto code = [](double value) { return float(std::lround(255 * value)) / 255.0F; };
  EXPECT_THAT(file.At(2, 1), ElementsAre(code(0.5), code(0.25), 0, code(0.5)));
  EXPECT_THAT(file.At(3, 1), ElementsAre(1, code(0.5), code(0.25), 1));
  EXPECT_THAT(file.At(2, 2), ElementsAre(0, 0, 0, 0));  // row 0 is the top one
}

TEST_F(ImageWriterTest, PngIsTheSameOfThePictureAndOfItsCodes) {
  const LocalImage floats = TwoPixels(PixelFormat::kRgba);
  StraightImage codes = MakeStraightImage(floats.bounds);
  StraightCodes(floats.rgba.data(), 2, codes.codes.data());
  const auto png = [](const PictureImage& image) { return PictureFile(PictureFileType::kPng, image, kSize, {}).value(); };
  EXPECT_EQ(png(codes), png(floats));
  // A background shows through where the picture is translucent, as far as its codes say it.
  const PictureFormat white{.background = {1, 1, 1, 1}};
  ASSERT_EQ(WritePicture(codes, kSize, Path("codes.png"), white), Status::Ok());
  ASSERT_EQ(WritePicture(floats, kSize, Path("floats.png"), white), Status::Ok());
  const FileImage of_codes = Read(Path("codes.png")), of_floats = Read(Path("floats.png"));
  ASSERT_EQ(of_codes.samples.size(), of_floats.samples.size());
  for (std::size_t i = 0; i < of_codes.samples.size(); ++i) EXPECT_NEAR(of_codes.samples[i], of_floats.samples[i], 1.01 / 255) << i;
}

TEST_F(ImageWriterTest, FilesAreTheSameOfCodesOverTheirBackground) {
  const PictureFormat format{.background = {1, 0.5F, 0.25F, 1}};
  const LocalImage floats = TwoPixels(PixelFormat::kRgba);
  StraightImage codes = MakeStraightImage(floats.bounds, {1, 0.5F, 0.25F, 1});
  StraightCodes(floats.rgba.data(), 2, codes.codes.data(), codes.behind);
  for (const PictureFileType type : {PictureFileType::kPng, PictureFileType::kJpeg}) {
    const auto file = [&](const PictureImage& image) { return PictureFile(type, image, kSize, format).value(); };
    EXPECT_EQ(file(codes), file(floats)) << int(type);
  }
}

TEST_F(ImageWriterTest, PngOf16BitsKeepsFinerSteps) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, 1, 1});
  image.rgba = {0.5F + 1.0F / 4096, 0.5F, 0, 1};
  ASSERT_EQ(WritePicture(image, {1, 1}, Path("a.png"), {.png_bits = 16}), Status::Ok());
  const FileImage file = Read(Path("a.png"));
  EXPECT_EQ(file.spec.format, OIIO::TypeDesc::UINT16);
  EXPECT_NEAR(file.At(0, 0)[0], 0.5 + 1.0 / 4096, 0.6 / 65535);
}

TEST_F(ImageWriterTest, ValuesAboveOneSaturate) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, 1, 1});
  image.rgba = {1.7F, 0.5F, 0, 1};
  ASSERT_EQ(WritePicture(image, {1, 1}, Path("a.png"), {}), Status::Ok());
  EXPECT_EQ(Read(Path("a.png")).At(0, 0)[0], 1);
}

TEST_F(ImageWriterTest, BackgroundIsPutBehindThePicture) {
  const PictureFormat format{.background = {0.2F, 0.4F, 0.6F, 1}};
  ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("a.exr"), format), Status::Ok());
  const FileImage file = Read(Path("a.exr"));
  const std::vector<float> over = file.At(2, 1);
  EXPECT_FLOAT_EQ(over[0], 0.25F + 0.5F * 0.2F);
  EXPECT_FLOAT_EQ(over[1], 0.125F + 0.5F * 0.4F);
  EXPECT_FLOAT_EQ(over[3], 1);
  EXPECT_FLOAT_EQ(file.At(0, 0)[2], 0.6F);
}

TEST_F(ImageWriterTest, ExrKeepsPremultipliedFloatsExactly) {
  LocalImage image = TwoPixels(PixelFormat::kRgba);
  image.rgba[0] = 1e-7F;
  ASSERT_EQ(WritePicture(image, kSize, Path("a.EXR"), {}), Status::Ok());
  const FileImage file = Read(Path("a.EXR"));
  EXPECT_EQ(file.spec.format, OIIO::TypeDesc::FLOAT);
  EXPECT_THAT(file.spec.channelnames, ElementsAre("R", "G", "B", "A"));
  EXPECT_THAT(file.At(2, 1), ElementsAre(1e-7F, 0.125F, 0, 0.5F));
}

TEST_F(ImageWriterTest, ExrOfADepthImageHasInfiniteDepthWhereNothingIsSeen) {
  ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kDepth), kSize, Path("a.exr"), {}), Status::Ok());
  const FileImage file = Read(Path("a.exr"));
  EXPECT_THAT(file.spec.channelnames, ElementsAre("R", "G", "B", "A", "Z"));
  EXPECT_EQ(file.At(2, 1)[4], 3.5F);
  EXPECT_EQ(file.At(0, 0)[4], std::numeric_limits<float>::infinity());
}

PictureNotes OfPatient(double pixel_mm) {
  PictureNotes notes;
  notes.geometry.world = World::kPatient;
  notes.geometry.unit = LengthUnit::kMillimetre;
  notes.geometry.pixel_size = pixel_mm;
  return notes;
}

std::string Bytes(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

TEST_F(ImageWriterTest, PngStatesTheSizeOfAPatientsPixels) {
  const auto chunk = [&](const PictureNotes& notes) -> std::vector<int> {
    EXPECT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("a.png"), {}, notes), Status::Ok());
    const std::string bytes = Bytes(Path("a.png"));
    const std::size_t at = bytes.find("pHYs");
    if (at == std::string::npos) return {};
    std::vector<int> values;
    for (std::size_t i = at - 4; i < at + 13; ++i) values.push_back(static_cast<unsigned char>(bytes[i]));
    return values;
  };
  // Length 9, the name, pixels a metre along x and y, the unit metre.
  EXPECT_THAT(chunk(OfPatient(0.5)), ElementsAre(0, 0, 0, 9, 'p', 'H', 'Y', 's', 0, 0, 0x07, 0xD0, 0, 0, 0x07, 0xD0, 1));
  EXPECT_THAT(chunk(OfPatient(1 / 1.9996)), ElementsAre(0, 0, 0, 9, 'p', 'H', 'Y', 's', 0, 0, 0x07, 0xD0, 0, 0, 0x07, 0xD0, 1));  // rounded
  EXPECT_THAT(chunk(OfPatient(1000)), ElementsAre(0, 0, 0, 9, 'p', 'H', 'Y', 's', 0, 0, 0, 1, 0, 0, 0, 1, 1));
  PictureNotes perspective = OfPatient(0.5);
  perspective.geometry.projection = Projection::kPerspective;
  PictureNotes unknown = OfPatient(0.5);
  unknown.geometry.unit = LengthUnit::kFile;
  for (const PictureNotes& none : {PictureNotes{}, perspective, unknown, OfPatient(1e4), OfPatient(1e-9), OfPatient(1e300)}) {
    EXPECT_TRUE(chunk(none).empty());
  }
}

TEST_F(ImageWriterTest, ExrStatesTheSizeOfAPatientsPixels) {
  ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("a.exr"), {}, OfPatient(0.5)), Status::Ok());
  const std::string bytes = Bytes(Path("a.exr"));
  const std::string name("xDensity\0float\0\4\0\0\0", 19);
  const std::size_t at = bytes.find(name);
  ASSERT_NE(at, std::string::npos);
  float density = 0;
  std::memcpy(&density, &bytes[at + name.size()], sizeof density);
  EXPECT_NEAR(density, 25.4 / 0.5, 1e-4);  // pixels an inch
}

TEST_F(ImageWriterTest, TheRecordIsTextThatOthersCanRead) {
  PictureNotes notes;
  notes.record = R"({"source": "B\u00fcro \"x\"", "empty": {}})";
  for (const std::string name : {"a.png", "a.exr", "a.jpg", "a.tif", "a.webp", "a.pdf"}) {
    ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path(name), {}, notes), Status::Ok());
    if (name == "a.webp" || name == "a.pdf") {
      const std::string once = Bytes(Path(name));
      ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path(name), {}, notes), Status::Ok());
      EXPECT_EQ(Bytes(Path(name)), once) << name;
      continue;
    }
    const FileImage file = Read(Path(name));
    const bool own_text = name == "a.png" || name == "a.exr";
    EXPECT_EQ(file.spec.get_string_attribute(own_text ? "slabstream" : "ImageDescription"), notes.record) << name;
    EXPECT_THAT(std::string(file.spec.get_string_attribute("Software")), testing::StartsWith("slabstream ")) << name;
    // The same request, the same bytes: no time, no host.
    const std::string before = Bytes(Path(name));
    ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path(name), {}, notes), Status::Ok());
    EXPECT_EQ(Bytes(Path(name)), before);
  }
}

TEST_F(ImageWriterTest, AnnotationsLieOverPictureAndBackground) {
  LocalImage image = MakeLocalImage(PixelFormat::kDepth, {0, 0, 200, 200});
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = i % 4 == 3 ? 0.5F : 0.0001F * float(i % 4999);
  std::fill(image.depth.begin(), image.depth.end(), 7.0F);
  PictureFormat format{.background = {0.2F, 0.4F, 0.6F, 1}};
  ASSERT_EQ(WritePicture(image, {200, 200}, Path("plain.exr"), format), Status::Ok());
  format.annotations.scale_bar = true;
  ASSERT_EQ(WritePicture(image, {200, 200}, Path("bar.exr"), format, OfPatient(1)), Status::Ok());
  const FileImage plain = Read(Path("plain.exr")), bar = Read(Path("bar.exr"));
  int changed = 0;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      EXPECT_EQ(bar.At(x, y)[4], 7) << "depths stay";
      if (bar.At(x, y) == plain.At(x, y)) continue;
      ++changed;
      EXPECT_TRUE(x > 100 && y > 160) << x << " " << y;
    }
  }
  EXPECT_GT(changed, 200);
  // 40 mm are wanted; the bar's own rows are white from end to end.
  int white = 0;
  for (int x = 0; x < 200; ++x) white += bar.At(x, 193) == std::vector<float>{1, 1, 1, 1, 7} ? 1 : 0;
  EXPECT_NEAR(white, 50, 2);
}

// Pixels of all values, some of them translucent.
LocalImage Noise(int side) {
  LocalImage noise = MakeLocalImage(PixelFormat::kRgba, {0, 0, side, side});
  for (std::size_t i = 0; i < noise.rgba.size(); i += 4) {
    const float alpha = i % 3 == 0 ? 1.0F : float(i * 40503U % 1000U) / 1000;
    for (std::size_t c = 0; c < 3; ++c) noise.rgba[i + c] = alpha * float((i + c) * 2654435761U % 1000U) / 1000;
    noise.rgba[i + 3] = alpha;
  }
  return noise;
}

// PNGs of the larger ones are compressed in several strips.
TEST_F(ImageWriterTest, TiffHoldsThePixelsOfThePng) {
  for (const int side : {1, 40, 600}) {
    const LocalImage noise = Noise(side);
    for (const int bits : {8, 16}) {
      ASSERT_EQ(WritePicture(noise, {side, side}, Path("a.png"), {.png_bits = bits}), Status::Ok());
      ASSERT_EQ(WritePicture(noise, {side, side}, Path("a.TIFF"), {.png_bits = bits}), Status::Ok());
      const FileImage png = Read(Path("a.png")), tiff = Read(Path("a.TIFF"));
      EXPECT_EQ(tiff.spec.format, bits == 16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8);
      EXPECT_EQ(tiff.spec.nchannels, 4);
      EXPECT_EQ(tiff.samples, png.samples);
    }
  }
}

// One colour, which no compression blurs.
LocalImage Plain(const std::array<float, 4>& color) {
  LocalImage plain = MakeLocalImage(PixelFormat::kRgba, {0, 0, 32, 32});
  for (std::size_t i = 0; i < plain.rgba.size(); ++i) plain.rgba[i] = color[i % 4];
  return plain;
}

TEST_F(ImageWriterTest, JpegLiesOverItsBackgroundAndThatOverBlack) {
  const LocalImage plain = Plain({0.25F, 0.1F, 0.3F, 0.5F});
  const auto expect = [&](const PictureFormat& format, const std::array<float, 3>& color) {
    ASSERT_EQ(WritePicture(plain, {32, 32}, Path("a.jpeg"), format), Status::Ok());
    const FileImage file = Read(Path("a.jpeg"));
    ASSERT_EQ(file.spec.nchannels, 3);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(file.At(9, 7)[c], color[c], 2.01 / 255) << c;
  };
  expect({}, {0.25F, 0.1F, 0.3F});
  expect({.background = {1, 0, 0.2F, 0.5F}}, {0.5F, 0.1F, 0.35F});
}

TEST_F(ImageWriterTest, WebpKeepsTransparency) {
  ASSERT_EQ(WritePicture(Plain({0.25F, 0.1F, 0.3F, 0.5F}), {32, 32}, Path("a.webp"), {}), Status::Ok());
  const std::string bytes = Bytes(Path("a.webp"));
  int width = 0, height = 0;
  std::uint8_t* const pixels = WebPDecodeRGBA(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), &width, &height);
  ASSERT_NE(pixels, nullptr);
  EXPECT_EQ(width, 32);
  EXPECT_EQ(height, 32);
  const std::array<int, 4> expected = {128, 51, 153, 128};
  for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(pixels[4 * 100 + c], expected[c], 4) << c;
  WebPFree(pixels);
  const Status large = CheckPictureFile("a.webp", {16384, 10});
  EXPECT_EQ(large, Status::InvalidArgument("--size 16384x10 is too large for .webp, which has at most 16383 pixels a side"));
  EXPECT_EQ(CheckPictureFile("a.png", {16384, 10}), Status::Ok());
}

TEST_F(ImageWriterTest, QualityIsThatOfJpegAndWebp) {
  const LocalImage noise = Noise(64);
  for (const std::string name : {"a.jpg", "a.webp"}) {
    ASSERT_EQ(WritePicture(noise, {64, 64}, Path(name), {.quality = 20}), Status::Ok());
    const auto coarse = std::filesystem::file_size(Path(name));
    ASSERT_EQ(WritePicture(noise, {64, 64}, Path(name), {.quality = 95}), Status::Ok());
    EXPECT_GT(std::filesystem::file_size(Path(name)), 1.5 * double(coarse)) << name;
  }
}

// As other programs read it; PDF and SVG: the size of the page.
TEST_F(ImageWriterTest, FilesStateThePixelsAnInch) {
  const PictureFormat format{.dots_per_inch = 300};
  for (const std::string name : {"a.png", "a.jpg", "a.tif", "a.exr"}) {
    ASSERT_EQ(WritePicture(Noise(32), {32, 32}, Path(name), format, OfPatient(0.5)), Status::Ok());
    const FileImage file = Read(Path(name));
    const std::string unit(file.spec.get_string_attribute("ResolutionUnit"));
    const double inch = unit.starts_with("in") || name == "a.exr" ? 1 : unit == "cm" ? 2.54 : unit == "m" ? 0.0254 : 0;
    EXPECT_NEAR(file.spec.get_float_attribute("XResolution") * inch, 300, 0.01) << name << " " << unit;
    EXPECT_NEAR(file.spec.get_float_attribute("YResolution") * inch, 300, 0.01) << name;
  }
  for (const std::string name : {"a.jpg", "a.webp"}) {  // Exif: 300 as a fraction
    ASSERT_EQ(WritePicture(Noise(32), {32, 32}, Path(name), format), Status::Ok());
    EXPECT_NE(Bytes(Path(name)).find(std::string("\xC0\xC6\x2D\x00\x10\x27\x00\x00", 8)), std::string::npos) << name;
  }
  ASSERT_EQ(WritePicture(Noise(300), {300, 300}, Path("a.pdf"), format), Status::Ok());
  EXPECT_NE(Bytes(Path("a.pdf")).find("/MediaBox [ 0 0 72 72 ]"), std::string::npos);
  ASSERT_EQ(WritePicture(Noise(300), {300, 300}, Path("a.svg"), format), Status::Ok());
  EXPECT_NE(Bytes(Path("a.svg")).find("width=\"72pt\" height=\"72pt\""), std::string::npos);
}

TEST_F(ImageWriterTest, PdfHasLettersAsTextAndSvgAsShapes) {
  const PictureFormat format{.background = {1, 1, 1, 1}, .annotations = {.scale_bar = true, .orientation_marker = true, .title = "Title"}};
  ASSERT_EQ(WritePicture(Noise(200), {200, 200}, Path("a.pdf"), format, OfPatient(0.5)), Status::Ok());
  const std::string pdf = Bytes(Path("a.pdf"));
  EXPECT_NE(pdf.find("/FontFile2"), std::string::npos) << "the font is in the file";
  EXPECT_NE(pdf.find("DejaVuSans-Bold"), std::string::npos);
  EXPECT_NE(pdf.find("/ToUnicode"), std::string::npos) << "text can be found and copied";
  EXPECT_EQ(pdf.find("CreationDate"), std::string::npos) << "the same request makes the same bytes";
  ASSERT_EQ(WritePicture(Noise(200), {200, 200}, Path("a.svg"), format, OfPatient(0.5)), Status::Ok());
  const std::string svg = Bytes(Path("a.svg"));
  EXPECT_NE(svg.find("<image"), std::string::npos);
  EXPECT_NE(svg.find("<path"), std::string::npos);
  EXPECT_EQ(svg.find("<text"), std::string::npos) << "which would need the font";
}

TEST_F(ImageWriterTest, AnImageWithoutPixelsIsAnEmptyPicture) {
  ASSERT_EQ(WritePicture(MakeLocalImage(PixelFormat::kRgba, {}), kSize, Path("a.png"), {}), Status::Ok());
  EXPECT_EQ(Read(Path("a.png")).samples, std::vector<float>(6 * 4 * 4, 0.0F));
}

TEST_F(ImageWriterTest, AFailureNamesThePathAndLeavesNothingBehind) {
  const Status ending = WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("a.gif"), {});
  EXPECT_EQ(ending.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(ending.message(), HasSubstr("a.gif"));

  const Status missing = WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("no/a.png"), {});
  EXPECT_EQ(missing.code(), StatusCode::kUnavailable);
  EXPECT_THAT(missing.message(), HasSubstr("no/a.png"));
  EXPECT_EQ(missing.message().find('\n'), std::string::npos);

  // A directory in the way: the picture is complete when the rename fails.
  std::filesystem::create_directories(Path("a.png/x"));
  const Status in_the_way = WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("a.png"), {});
  EXPECT_EQ(in_the_way.code(), StatusCode::kUnavailable);
  EXPECT_EQ(FileCount(), 1U);
}

TEST_F(ImageWriterTest, AnOlderPictureIsReplacedOnlyByAWholeOne) {
  std::ofstream(Path("a.png")) << "old";
  ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path("a.png"), {}), Status::Ok());
  EXPECT_EQ(Read(Path("a.png")).spec.width, 6);
  EXPECT_EQ(FileCount(), 1U);
}

// What `function` writes to standard error, if a pipe can hold it.
template <class Function>
std::string ErrorOutputOf(Function function) {
  int ends[2] = {-1, -1};
  CHECK_EQ(::pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  const int before = ::dup(STDERR_FILENO);
  ::dup2(ends[1], STDERR_FILENO);
  function();
  (void)std::fflush(stderr);
  ::dup2(before, STDERR_FILENO);
  std::string text(4096, '\0');
  text.resize(std::size_t(std::max<ssize_t>(::read(ends[0], text.data(), text.size()), 0)));
  for (const int descriptor : {ends[0], ends[1], before}) ::close(descriptor);
  return text;
}

TEST_F(ImageWriterTest, AFullDiskIsToldAndKeepsTheOlderPicture) {
  LocalImage noise = MakeLocalImage(PixelFormat::kRgba, {0, 0, 64, 64});
  for (std::size_t i = 0; i < noise.rgba.size(); ++i) noise.rgba[i] = float(i * 2654435761U % 1000U) / 1000;
  for (const std::string name : {"a.png", "a.exr", "a.jpg", "a.webp", "a.tif", "a.pdf", "a.svg"}) {
    ASSERT_EQ(WritePicture(noise, {64, 64}, Path(name), {}), Status::Ok());
    const auto whole = std::filesystem::file_size(Path(name));
    ASSERT_EQ(WritePicture(TwoPixels(PixelFormat::kRgba), kSize, Path(name), {}), Status::Ok());
    const auto bytes = std::filesystem::file_size(Path(name));
    // From the first byte to the last, which only closing writes.
    for (const std::uintmax_t limit : {std::uintmax_t{0}, whole / 2, whole - 1}) {
      Status status;
      const std::string printed = ErrorOutputOf([&] {  // libpng would like to
        status = OnFullDisk(limit, [&] { return WritePicture(noise, {64, 64}, Path(name), {}); });
      });
      EXPECT_EQ(printed, "");
      EXPECT_EQ(status, Status::Unavailable("cannot write '" + Path(name) + "': File too large")) << limit;
      EXPECT_EQ(std::filesystem::file_size(Path(name)), bytes);
    }
  }
  EXPECT_EQ(FileCount(), 7U);
}

TEST(PictureEncoderTest, APictureIsGivenUpAtAnyRow) {
  constexpr int kSide = 384;  // PNG: several strips
  std::vector<std::uint8_t> codes(std::size_t{4} * kSide * 2);
  for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = std::uint8_t(i * i * 31 >> 3);  // hard to pack: many buffers are filled
  for (const PictureFileType type : {PictureFileType::kPng, PictureFileType::kJpeg, PictureFileType::kWebp}) {
    const EncodedFormat format{.type = type, .width = kSide, .height = kSide, .quality = 100};
    const auto encode = [&](int row_count, int write_count) {
      const auto rows = [&](int begin, int end, const WriteRow& write) {
        for (int y = begin; y < std::min(end, row_count); ++y) {
          if (!write(y, codes.data() + 4 * (y * y % kSide))) return false;
        }
        return end <= row_count;
      };
      return OwnPictureEncoder(type)(format, rows, [&](std::int64_t, std::span<const std::byte>) { return write_count-- > 0; });
    };
    for (int rows = 0; rows < kSide; rows += 5) EXPECT_EQ(encode(rows, 1 << 20), kBytesNotTaken) << int(type) << ' ' << rows;
    EXPECT_EQ(encode(kSide, 0), kBytesNotTaken) << int(type);
    EXPECT_EQ(encode(kSide, 1 << 20), std::nullopt) << int(type);
  }
}

TEST_F(ImageWriterTest, AFrameOfAMovieLiesOverItsBackgroundAndThatOverBlack) {
  const LocalImage image = TwoPixels(PixelFormat::kRgba);
  const auto frame = [&](const StraightColor& background) {
    return MovieFrame(ComposedPicture::Make(image, {6, 4}, {.background = background}, PictureGeometry{}).value());
  };
  const auto pixel = [](const std::vector<std::byte>& bytes, std::size_t x, std::size_t y) {
    const std::size_t at = 3 * (6 * y + x);
    return std::vector<int>{int(bytes[at]), int(bytes[at + 1]), int(bytes[at + 2])};
  };
  const std::vector<std::byte> black = frame({});
  ASSERT_EQ(black.size(), 6U * 4 * 3);
  EXPECT_THAT(pixel(black, 0, 0), ElementsAre(0, 0, 0));
  EXPECT_THAT(pixel(black, 2, 1), ElementsAre(64, 32, 0));
  EXPECT_THAT(pixel(black, 3, 1), ElementsAre(255, 128, 64));
  const std::vector<std::byte> coloured = frame({1, 0, 0.5F, 1}), veiled = frame({1, 1, 1, 0.5F});
  EXPECT_THAT(pixel(coloured, 5, 3), ElementsAre(255, 0, 128));
  EXPECT_THAT(pixel(coloured, 2, 1), ElementsAre(191, 32, 64));
  EXPECT_THAT(pixel(coloured, 3, 1), ElementsAre(255, 128, 64));
  EXPECT_THAT(pixel(veiled, 0, 0), ElementsAre(128, 128, 128));
}

}  // namespace
}  // namespace slabstream
