#include "client/image_io/image_writer.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/image_io/composed_picture.h"
#include "common/base/check.h"
#include "common/base/files.h"
#include "common/base/version.h"

namespace slabstream {
namespace {

enum class FileType { kPng, kExr, kOther };

FileType TypeOf(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return ending == ".png" ? FileType::kPng : ending == ".exr" ? FileType::kExr : FileType::kOther;
}

template <class Code>
void ToStraightCodes(std::span<const float> premultiplied, std::span<Code> codes) {
  for (std::size_t i = 0; i < codes.size(); i += 4) {
    const float alpha = premultiplied[i + 3];
    for (std::size_t c = 0; c < 3; ++c) codes[i + c] = alpha > 0 ? SampleCode<Code>(premultiplied[i + c] / alpha) : Code(0);
    codes[i + 3] = SampleCode<Code>(alpha);
  }
}

// Calls write(y, row) for each row, in the file's own sample layout. Stops at the first failure.
template <class Write>
bool WritePngRows(const ComposedPicture& picture, int bits, Write write) {
  const bool deep = bits == 16;
  std::vector<float> rgba(4 * std::size_t(picture.size().width));
  std::vector<std::uint8_t> codes8(deep ? 0 : rgba.size());
  std::vector<std::uint16_t> codes16(deep ? rgba.size() : 0);
  for (int y = 0; y < picture.size().height; ++y) {
    picture.Row(y, rgba, {});
    ToStraightCodes<std::uint8_t>(rgba, codes8);
    ToStraightCodes<std::uint16_t>(rgba, codes16);
    if (!(deep ? write(y, static_cast<const void*>(codes16.data())) : write(y, codes8.data()))) return false;
  }
  return true;
}

template <class Write>
bool WriteExrRows(const ComposedPicture& picture, Write write) {
  const bool with_depth = picture.has_depth();
  const std::size_t width = std::size_t(picture.size().width);
  std::vector<float> rgba(4 * width), depth(with_depth ? width : 0), rgbaz(with_depth ? 5 * width : 0);
  for (int y = 0; y < picture.size().height; ++y) {
    picture.Row(y, rgba, depth);
    for (std::size_t x = 0; x < depth.size(); ++x) {
      std::copy_n(&rgba[4 * x], 4, &rgbaz[5 * x]);
      rgbaz[5 * x + 4] = depth[x];
    }
    if (!write(y, static_cast<const void*>(with_depth ? rgbaz.data() : rgba.data()))) return false;
  }
  return true;
}

// PNG: in pixels a metre; OpenImageIO cuts what it calculates off to whole ones, so they are rounded here. EXR: in pixels an inch.
void StatePixelSize(const PictureGeometry& geometry, bool png, OIIO::ImageSpec& spec) {
  if (geometry.unit != LengthUnit::kMillimetre || geometry.projection == Projection::kPerspective) return;
  constexpr double kMillimetresAMetre = 1000, kMillimetresAnInch = 25.4;
  constexpr double kMost = 1 << 24;  // whole numbers up to this have floats of their own
  const double density = png ? std::round(kMillimetresAMetre / geometry.pixel_size) : kMillimetresAnInch / geometry.pixel_size;
  if (!(density >= (png ? 1 : 1 / kMost) && density <= kMost)) return;
  spec.attribute("ResolutionUnit", png ? "m" : "in");
  spec.attribute("XResolution", float(density));
  spec.attribute("YResolution", float(density));
}

// Takes an encoder's bytes, which may come in any order.
class Sink : public OIIO::Filesystem::IOProxy {
 public:
  Sink() : IOProxy("", Write) {}
  virtual bool ok() const = 0;

  const char* proxytype() const override { return "slabstream"; }
  std::size_t write(const void* bytes, std::size_t size) override {
    const std::size_t written = pwrite(bytes, size, m_pos);
    m_pos += std::int64_t(written);
    return written;
  }
};

// Into a file. OutputFile reports failures, because encoders do so unreliably.
class FileSink : public Sink {
 public:
  explicit FileSink(OutputFile& file) : file_(file) {}
  bool ok() const override { return file_.ok(); }
  std::size_t pwrite(const void* bytes, std::size_t size, std::int64_t offset) override {
    file_.WriteAt(offset, {static_cast<const std::byte*>(bytes), size});
    return file_.ok() ? size : 0;
  }

 private:
  OutputFile& file_;
};

class MemorySink : public Sink {
 public:
  bool ok() const override { return true; }
  std::size_t pwrite(const void* bytes, std::size_t size, std::int64_t offset) override {
    const std::size_t end = std::size_t(offset) + size;
    if (bytes_.size() < end) bytes_.resize(end);
    std::memcpy(&bytes_[std::size_t(offset)], bytes, size);
    return size;
  }
  std::vector<std::byte> Take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

OIIO::ImageSpec SpecOf(const ComposedPicture& picture, const PictureFormat& format, const PictureNotes& notes, bool png) {
  CHECK(format.png_bits == 8 || format.png_bits == 16);
  const OIIO::TypeDesc sample = !png ? OIIO::TypeDesc::FLOAT : format.png_bits == 16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8;
  const bool with_depth = !png && picture.has_depth();
  OIIO::ImageSpec spec(picture.size().width, picture.size().height, with_depth ? 5 : 4, sample);
  spec.channelnames = {"R", "G", "B", "A"};
  if (with_depth) spec.channelnames.push_back("Z");
  spec.alpha_channel = 3;
  spec.z_channel = with_depth ? 4 : -1;
  if (png) {
    // Samples are passed in their final form: no division by alpha and no transfer curve on the way.
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("png:compressionLevel", 1);  // the default, 6, takes 1.7 times as long to render 60 pictures of a head, 8 % smaller
  } else {
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("compression", "zip");
    spec.attribute("DateTime", "");  // else the library puts the time there, and no two files are the same
  }
  StatePixelSize(notes.geometry, png, spec);
  if (!notes.record.empty()) {
    spec.attribute("Software", fmt::format("slabstream {}", Version()));
    spec.attribute(kRecordName, notes.record);
  }
  return spec;
}

// nullopt: done; else the encoder's reason.
std::optional<std::string> Encode(const ComposedPicture& picture, const PictureFormat& format, const PictureNotes& notes, bool png,
                                  Sink& sink) {
  OIIO::ImageSpec spec = SpecOf(picture, format, notes, png);
  OIIO::Filesystem::IOProxy* proxy = &sink;
  spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  const std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(png ? "png" : "openexr");
  if (!out) return OIIO::geterror();
  if (!out->open(png ? "picture.png" : "picture.exr", spec)) return out->geterror();
  const auto write = [&](int y, const void* row) { return sink.ok() && out->write_scanline(y, 0, spec.format, row); };
  const bool written = png ? WritePngRows(picture, format.png_bits, write) : WriteExrRows(picture, write);
  const bool closed = out->close();
  if (!written || !closed) return out->geterror();
  return std::nullopt;
}

std::string FirstLine(const std::string& reason) {
  const std::string line = reason.substr(0, reason.find('\n'));
  return line.empty() ? "unknown reason" : line;
}

}  // namespace

Status CheckPicturePath(const std::string& path) {
  if (TypeOf(path) != FileType::kOther) return Status::Ok();
  return Status::InvalidArgument(fmt::format("output '{}' must end in .png or .exr", path));
}

Status WritePicture(const LocalImage& image, ImageSize size, const std::string& path, const PictureFormat& format,
                    const PictureNotes& notes) {
  if (Status status = CheckPicturePath(path); !status.ok()) return status;
  const Result<ComposedPicture> picture = ComposedPicture::Make(image, size, format, notes.geometry);
  if (!picture.ok()) return picture.status();
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file.ok()) return file.status();
  FileSink sink(*file);
  const std::optional<std::string> failure = Encode(*picture, format, notes, TypeOf(path) == FileType::kPng, sink);
  if (!failure) return file->Finish();
  if (Status status = file->Close(); !status.ok()) return status;  // reports a full disk rather than the encoder's message about it
  return Status::Unavailable(fmt::format("cannot write '{}': {}", path, FirstLine(*failure)));
}

Result<std::vector<std::byte>> PngFile(const LocalImage& image, ImageSize size, const PictureFormat& format, const PictureNotes& notes) {
  const Result<ComposedPicture> picture = ComposedPicture::Make(image, size, format, notes.geometry);
  if (!picture.ok()) return picture.status();
  MemorySink sink;
  if (const auto failure = Encode(*picture, format, notes, true, sink)) {
    return Status::Internal(fmt::format("cannot encode a PNG: {}", FirstLine(*failure)));
  }
  return sink.Take();
}

}  // namespace slabstream
