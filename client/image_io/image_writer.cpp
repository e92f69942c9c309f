#include "client/image_io/image_writer.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "client/image_io/composed_picture.h"
#include "client/picture_encoder/picture_encoder.h"
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

// Calls write(y, row) for each row, in the file's own sample layout. Stops at the first failure.
template <class Code>
bool WritePngRows(const ComposedPicture& picture, const PictureEncoder::WriteRow& write) {
  const auto width = std::size_t(picture.size().width);
  std::vector<Code> codes(4 * width);
  for (int y = 0; y < picture.size().height; ++y) {
    picture.StraightRow(y, codes);
    if (!write(y, codes.data())) return false;
  }
  return true;
}

bool WriteExrRows(const ComposedPicture& picture, const PictureEncoder::WriteRow& write) {
  const bool with_depth = picture.has_depth();
  const std::size_t width = std::size_t(picture.size().width);
  std::vector<float> rgba(4 * width), depth(with_depth ? width : 0), rgbaz(with_depth ? 5 * width : 0);
  for (int y = 0; y < picture.size().height; ++y) {
    picture.Row(y, rgba, depth);
    for (std::size_t x = 0; x < depth.size(); ++x) {
      std::copy_n(&rgba[4 * x], 4, &rgbaz[5 * x]);
      rgbaz[5 * x + 4] = depth[x];
    }
    if (!write(y, with_depth ? rgbaz.data() : rgba.data())) return false;
  }
  return true;
}

std::span<const PictureGeometry> PanesOf(const PictureNotes& notes) {
  return notes.panes.empty() ? std::span(&notes.geometry, 1) : std::span(notes.panes);
}

// PNG: in pixels a metre; OpenImageIO cuts what it calculates off to whole ones, so they are rounded here. EXR: in pixels an inch. nullopt:
// pixels do not all have the same size, or none that is known.
std::optional<double> PixelDensity(const PictureGeometry& geometry, bool png) {
  if (geometry.unit != LengthUnit::kMillimetre || geometry.projection == Projection::kPerspective) return std::nullopt;
  constexpr double kMillimetresAMetre = 1000, kMillimetresAnInch = 25.4;
  constexpr double kMost = 1 << 24;  // whole numbers up to this have floats of their own
  const double density = png ? std::round(kMillimetresAMetre / geometry.pixel_size) : kMillimetresAnInch / geometry.pixel_size;
  if (!(density >= (png ? 1 : 1 / kMost) && density <= kMost)) return std::nullopt;
  return density;
}

// Loads the module at the first call. It lies beside the program or where programs are installed (CMAKE_BUILD_RPATH).
Result<const PictureEncoder*> FindEncoder() {
  static const Result<const PictureEncoder*> encoder = []() -> Result<const PictureEncoder*> {
    void* const module = dlopen("libslabstream-pictures.so", RTLD_NOW | RTLD_LOCAL);
    void* const entry = module == nullptr ? nullptr : dlsym(module, kPictureEncoderEntry);
    if (entry == nullptr) {
      return Status::Unavailable(fmt::format(
          "pictures cannot be written: {} (libslabstream-pictures.so belongs beside the program and needs libopenimageio2.4)", dlerror()));
    }
    return reinterpret_cast<PictureEncoderEntry>(entry)();
  }();
  return encoder;
}

// nullopt: done; else the encoder's reason.
std::optional<std::string> Encode(const ComposedPicture& picture, const PictureFormat& format, const PictureNotes& notes, bool png,
                                  const PictureEncoder::WriteBytes& write) {
  CHECK(format.png_bits == 8 || format.png_bits == 16);
  const Result<const PictureEncoder*> encoder = FindEncoder();
  if (!encoder.ok()) return encoder.status().message();
  const EncodedFormat encoded{.png = png,
                              .width = picture.size().width,
                              .height = picture.size().height,
                              .bits = format.png_bits,
                              .with_depth = !png && picture.has_depth(),
                              .density = PixelDensity(notes.geometry, png),
                              .software = fmt::format("slabstream {}", Version()),
                              .record_name = kRecordName,
                              .record = notes.record};
  const auto rows = [&](const PictureEncoder::WriteRow& write_row) {
    if (!png) return WriteExrRows(picture, write_row);
    return format.png_bits == 8 ? WritePngRows<std::uint8_t>(picture, write_row) : WritePngRows<std::uint16_t>(picture, write_row);
  };
  return (*encoder)->Encode(encoded, rows, write);
}

std::string FirstLine(const std::string& reason) {
  const std::string line = reason.substr(0, reason.find('\n'));
  return line.empty() ? "unknown reason" : line;
}

}  // namespace

bool FileHoldsStraight8(const std::string& path, const PictureFormat& format) {
  return TypeOf(path) == FileType::kPng && HoldsStraight8(format);
}

Status CheckPicturePath(const std::string& path) {
  if (TypeOf(path) != FileType::kOther) return Status::Ok();
  return Status::InvalidArgument(fmt::format("output '{}' must end in .png or .exr", path));
}

Status CheckCanWritePicture(const std::string& path) {
  const Status status = CheckPicturePath(path);
  return status.ok() ? FindEncoder().status() : status;
}

Status WritePicture(const PictureImage& image, ImageSize size, const std::string& path, const PictureFormat& format,
                    const PictureNotes& notes) {
  if (Status status = CheckPicturePath(path); !status.ok()) return status;
  const Result<ComposedPicture> picture = ComposedPicture::Make(image, size, format, PanesOf(notes), notes.key);
  if (!picture.ok()) return picture.status();
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file.ok()) return file.status();
  // OutputFile reports failures, because encoders do so unreliably.
  const auto write = [&](std::int64_t offset, std::span<const std::byte> bytes) {
    file->WriteAt(offset, bytes);
    return file->ok();
  };
  const std::optional<std::string> failure = Encode(*picture, format, notes, TypeOf(path) == FileType::kPng, write);
  if (!failure) return file->Finish();
  if (Status status = file->Close(); !status.ok()) return status;  // reports a full disk rather than the encoder's message about it
  return Status::Unavailable(fmt::format("cannot write '{}': {}", path, FirstLine(*failure)));
}

Result<std::vector<std::byte>> PngFile(const PictureImage& image, ImageSize size, const PictureFormat& format, const PictureNotes& notes) {
  const Result<ComposedPicture> picture = ComposedPicture::Make(image, size, format, PanesOf(notes), notes.key);
  if (!picture.ok()) return picture.status();
  std::vector<std::byte> file;
  const auto write = [&](std::int64_t offset, std::span<const std::byte> bytes) {
    file.resize(std::max(file.size(), std::size_t(offset) + bytes.size()));
    std::ranges::copy(bytes, file.begin() + offset);
    return true;
  };
  if (const auto failure = Encode(*picture, format, notes, true, write)) {
    return Status::Internal(fmt::format("cannot encode a PNG: {}", FirstLine(*failure)));
  }
  return file;
}

}  // namespace slabstream
