#include "client/pictures/picture_writer.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "client/pictures/ink.h"
#include "client/pictures/picture_encoder.h"
#include "common/base/check.h"
#include "common/base/version.h"
#include "common/files/files.h"

namespace slabstream {
namespace {

// Calls write(y, row) for each of the rows, in the file's own sample layout. Stops at the first failure.
template <class Code>
bool WriteStraightRows(const ComposedPicture& picture, int begin, int end, const WriteRow& write) {
  const auto width = std::size_t(picture.size().width);
  std::vector<Code> codes(4 * width);
  for (int y = begin; y < end; ++y) {
    picture.StraightRow(y, codes);
    if (!write(y, codes.data())) return false;
  }
  return true;
}

bool WriteExrRows(const ComposedPicture& picture, int begin, int end, const WriteRow& write) {
  const bool with_depth = picture.has_depth();
  const std::size_t width = std::size_t(picture.size().width);
  std::vector<float> rgba(4 * width), depth(with_depth ? width : 0), rgbaz(with_depth ? 5 * width : 0);
  for (int y = begin; y < end; ++y) {
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

// In pixels a metre. nullopt: nobody asked for one, and pixels do not all have the same size, or none that is known.
std::optional<double> PixelDensity(const PictureGeometry& geometry, const PictureFormat& format, PictureFileType type) {
  if (format.dots_per_inch) return *format.dots_per_inch / kMetresAnInch;
  if (geometry.unit != LengthUnit::kMillimetre || geometry.projection == Projection::kPerspective) return std::nullopt;
  if (type == PictureFileType::kPdf || type == PictureFileType::kSvg) return std::nullopt;  // pages are no patients
  constexpr double kMillimetresAMetre = 1000;
  constexpr double kMost = 1 << 24;  // whole numbers up to this have floats of their own
  const double density = kMillimetresAMetre / geometry.pixel_size;
  if (type == PictureFileType::kPng) return std::round(density) >= 1 && density <= kMost ? std::optional(density) : std::nullopt;
  const double per_inch = density * kMetresAnInch;
  return per_inch >= 1 / kMost && per_inch <= kMost ? std::optional(density) : std::nullopt;
}

// What the module exports. The first call loads it. It lies beside the program or where programs are installed (CMAKE_BUILD_RPATH).
Result<void*> ModuleEntry() {
  static const Result<void*> loaded = []() -> Result<void*> {
    void* const module = dlopen("libslabstream-pictures.so", RTLD_NOW | RTLD_LOCAL);
    void* const entry = module == nullptr ? nullptr : dlsym(module, kPictureEncoderEntry);
    if (entry == nullptr) {
      return Status::Unavailable(
          fmt::format("only .png, .jpg and .webp can be written: {} (libslabstream-pictures.so, which deploy/build makes, belongs "
                      "beside the program and needs libopenimageio2.4 and libcairo2)",
                      dlerror()));
    }
    return entry;
  }();
  return loaded;
}

Status FindEncoder(PictureFileType type, PictureEncoder& encoder) {
  encoder = OwnPictureEncoder(type);
  if (encoder != nullptr) return Status::Ok();
  const Result<void*> entry = ModuleEntry();
  if (entry.ok()) encoder = reinterpret_cast<PictureEncoderEntry>(*entry)(type);
  return entry.status();
}

// A picture that is ready to be encoded.
struct Prepared {
  PictureEncoder encoder;
  ComposedPicture picture;
  EncodedFormat encoded;
  std::vector<Mark> marks;  // those of `encoded`
};

// Errors of PictureFile but those of CheckPictureSize.
Result<Prepared> Prepare(PictureFileType type, const PictureImage& image, ImageSize size, PictureFormat format, const PictureNotes& notes) {
  CHECK(format.png_bits == 8 || format.png_bits == 16);
  PictureEncoder encoder = nullptr;
  if (Status status = FindEncoder(type, encoder); !status.ok()) return status;
  if (type == PictureFileType::kJpeg) format = WithoutTransparency(format);
  EncodedFormat encoded{.type = type,
                        .width = size.width,
                        .height = size.height,
                        .bits = type == PictureFileType::kPng || type == PictureFileType::kTiff ? format.png_bits : 8,
                        .with_depth = type == PictureFileType::kExr && image.has_depth(),
                        .quality = format.quality,
                        .density = PixelDensity(notes.geometry, format, type),
                        .software = fmt::format("slabstream {}", Version()),
                        .record_name = kRecordName,
                        .record = notes.record};
  if (type == PictureFileType::kPdf || type == PictureFileType::kSvg) {
    Result<std::vector<Mark>> marks = MarksOf(format, size, PanesOf(notes), notes.key);
    if (!marks.ok()) return marks.status();
    if (!marks->empty()) {
      Result<std::string> font = AnnotationFont();
      if (!font.ok()) return font.status();
      encoded.font = *std::move(font);
    }
    const auto over = std::ranges::find(*marks, false, &Mark::under);
    Result<ComposedPicture> below = ComposedPicture::WithMarks(image, size, format.background, {marks->begin(), over});
    if (!below.ok()) return below.status();
    Prepared prepared{encoder, *std::move(below), std::move(encoded), {over, marks->end()}};
    prepared.encoded.marks = prepared.marks;
    return prepared;
  }
  Result<ComposedPicture> picture = ComposedPicture::Make(image, size, format, PanesOf(notes), notes.key);
  if (!picture.ok()) return picture.status();
  return Prepared{encoder, *std::move(picture), std::move(encoded), {}};
}

// nullopt: done; else the encoder's reason.
std::optional<std::string> Encode(const Prepared& prepared, const WriteBytes& write) {
  const auto rows = [&](int begin, int end, const WriteRow& write_row) {
    if (prepared.encoded.type == PictureFileType::kExr) return WriteExrRows(prepared.picture, begin, end, write_row);
    return prepared.encoded.bits == 8 ? WriteStraightRows<std::uint8_t>(prepared.picture, begin, end, write_row)
                                      : WriteStraightRows<std::uint16_t>(prepared.picture, begin, end, write_row);
  };
  return prepared.encoder(prepared.encoded, rows, write);
}

WriteBytes ToMemory(std::vector<std::byte>& file) {
  return [&file](std::int64_t offset, std::span<const std::byte> bytes) {
    file.resize(std::max(file.size(), std::size_t(offset) + bytes.size()));
    std::ranges::copy(bytes, file.begin() + offset);
    return true;
  };
}

std::string FirstLine(const std::string& reason) {
  const std::string line = reason.substr(0, reason.find('\n'));
  return line.empty() ? "unknown reason" : line;
}

}  // namespace

bool FileHoldsStraight8(const std::string& path, const PictureFormat& format) {
  return PictureFileTypeOf(path) == PictureFileType::kPng && HoldsStraight8(format);
}

Status CheckCanWritePicture(const std::string& path) {
  const Status status = CheckPicturePath(path);
  PictureEncoder encoder = nullptr;
  return status.ok() ? FindEncoder(*PictureFileTypeOf(path), encoder) : status;
}

Status WritePicture(const PictureImage& image, ImageSize size, const std::string& path, const PictureFormat& format,
                    const PictureNotes& notes) {
  if (Status status = CheckPictureFile(path, size); !status.ok()) return status;
  const Result<Prepared> prepared = Prepare(*PictureFileTypeOf(path), image, size, format, notes);
  if (!prepared.ok()) return prepared.status();
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file.ok()) return file.status();
  // OutputFile reports failures, because encoders do so unreliably.
  const auto write = [&](std::int64_t offset, std::span<const std::byte> bytes) {
    file->WriteAt(offset, bytes);
    return file->ok();
  };
  const std::optional<std::string> failure = Encode(*prepared, write);
  if (!failure) return file->Finish();
  if (Status status = file->Close(); !status.ok()) return status;  // reports a full disk rather than the encoder's message about it
  return Status::Unavailable(fmt::format("cannot write '{}': {}", path, FirstLine(*failure)));
}

Result<std::vector<std::byte>> PictureFile(PictureFileType type, const PictureImage& image, ImageSize size, const PictureFormat& format,
                                           const PictureNotes& notes) {
  if (Status status = CheckPictureSize(type, size); !status.ok()) return status;
  const Result<Prepared> prepared = Prepare(type, image, size, format, notes);
  if (!prepared.ok()) return prepared.status();
  std::vector<std::byte> file;
  if (const auto failure = Encode(*prepared, ToMemory(file))) {
    return Status::Internal(fmt::format("cannot encode the picture: {}", FirstLine(*failure)));
  }
  return file;
}

std::optional<std::vector<std::byte>> EncodePart(PictureFileType type, const ComposedPicture& picture, const PixelBounds& bounds,
                                                 int quality, const std::atomic<bool>& given_up) {
  const EncodedFormat format{.type = type, .width = bounds.width(), .height = bounds.height(), .quality = quality, .quickly = true};
  const auto rows = [&](int begin, int end, const WriteRow& write) {
    std::vector<std::uint8_t> codes(4 * std::size_t(picture.size().width));
    for (int y = bounds.y_begin + begin; y < bounds.y_begin + end; ++y) {
      if (given_up.load(std::memory_order_relaxed)) return false;
      if (type == PictureFileType::kJpeg) {
        picture.OpaqueRow(y, codes);
      } else {
        picture.StraightRow(y, codes);
      }
      if (!write(y - bounds.y_begin, codes.data() + 4 * std::size_t(bounds.x_begin))) return false;
    }
    return true;
  };
  std::vector<std::byte> bytes;
  if (OwnPictureEncoder(type)(format, rows, ToMemory(bytes))) return std::nullopt;  // memory takes all bytes: `rows` gave up
  return bytes;
}

}  // namespace slabstream
