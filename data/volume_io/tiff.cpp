// TIFF: a multi-page file, or a folder of files, one a slice.
//
// TIFF states no distance between slices, and its resolution is meant for print: spacing is 1 along x and z, and along y the ratio of the
// two resolutions. OME-TIFF states the size of voxels in its description.
#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "common/volume/memory_budget.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/ome_header.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

// Keeps what libtiff complains about first; the rest are consequences.
int KeepFirst(TIFF*, void* complaint, const char*, const char* format, va_list arguments) {
  std::string& text = *static_cast<std::string*>(complaint);
  if (text.empty()) {
    std::array<char, 256> buffer{};
    (void)std::vsnprintf(buffer.data(), buffer.size(), format, arguments);
    text = buffer.data();
  }
  return 1;  // handled: nothing goes to stderr
}

int Ignore(TIFF*, void*, const char*, const char*, va_list) { return 1; }

// An open file at one of its pages. Errors name the file.
class TiffFile : public SliceFile {
 public:
  explicit TiffFile(std::string path) : path_(std::move(path)) {
    TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
    TIFFOpenOptionsSetErrorHandlerExtR(options, KeepFirst, complaint_.get());
    TIFFOpenOptionsSetWarningHandlerExtR(options, Ignore, nullptr);
    tiff_.reset(TIFFOpenExt(path_.c_str(), "rm", options));  // m: no memory mapping, since a shrinking file would raise a signal
    TIFFOpenOptionsFree(options);
  }

  bool is_open() const { return tiff_ != nullptr; }
  Status Failed(StatusCode code, const std::string& why) const {
    return {code, path_ + ": " + why + (complaint_->empty() ? "" : ": " + *complaint_)};
  }
  Status Damaged() const { return Failed(StatusCode::kDataLoss, "truncated or damaged"); }
  Status Refused(const std::string& why) const { return Failed(StatusCode::kInvalidArgument, why); }
  Status NotTiff() const { return Refused("not a TIFF volume"); }

  // Counts the pages to the end of the chain, and goes back to the first one; a broken chain is an error.
  Result<std::int64_t> CountPages() {
    std::int64_t pages = 1;
    while (TIFFReadDirectory(tiff_.get()) != 0) {
      if (++pages > kMaxVolumes) break;
    }
    if (!complaint_->empty()) return Failed(StatusCode::kDataLoss, "truncated or damaged after page " + std::to_string(pages));
    page_ = 0;
    if (TIFFSetDirectory(tiff_.get(), 0) == 0) return Damaged();
    return pages;
  }
  // Pages are taken in order: `page` is not before the present one.
  Status GoToPage(std::int64_t page) {
    for (; page_ < page; ++page_) {
      if (TIFFReadDirectory(tiff_.get()) == 0) return Damaged();
    }
    return Status::Ok();
  }

  // Which of the file's `pages` are the volume's slices, by the first page. Errors of ReadOmeHeader.
  Result<PageOrder> ReadPageOrder(std::int64_t pages, const ReadOptions& options) const;

  // Of this page. InvalidArgument: a palette, planes for each component, or a type that is not supported.
  Result<RawHeader> ReadHeader() override;
  Status ReadSamples(const RawHeader& header, std::byte* out) override;

 private:
  template <class T>
  T Field(ttag_t tag, T if_absent) const {
    T value = if_absent;
    return TIFFGetFieldDefaulted(tiff_.get(), tag, &value) != 0 ? value : if_absent;
  }
  Status ReadTiles(const RawHeader& header, std::byte* out);

  std::string path_;
  std::int64_t page_ = 0;
  std::unique_ptr<std::string> complaint_ = std::make_unique<std::string>();  // its address is the handler's
  struct Close {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
  };
  std::unique_ptr<TIFF, Close> tiff_;
};

std::size_t PixelBytes(const RawHeader& header) { return BytesPerSample(header.type) * std::size_t(header.components); }

std::optional<SampleType> ToSampleType(unsigned bits, unsigned format) {
  const bool is_unsigned = format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_VOID;
  const char* kind = is_unsigned ? "uint" : format == SAMPLEFORMAT_INT ? "int" : format == SAMPLEFORMAT_IEEEFP ? "float" : "";
  return SampleTypeNamed(kind + std::to_string(bits));
}

Result<PageOrder> TiffFile::ReadPageOrder(std::int64_t pages, const ReadOptions& options) const {
  const std::string description = Field<const char*>(TIFFTAG_IMAGEDESCRIPTION, "");
  if (IsOmeHeader(description)) return ReadOmeHeader(path_, description, pages, options);
  if (options.time) return Refused("time is for OME-TIFF files that state several times; this one does not");
  return PageOrder{.count = pages};
}

Result<RawHeader> TiffFile::ReadHeader() {
  const auto samples = Field<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1),
             photometric = Field<std::uint16_t>(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  const bool grey = photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE;
  if (samples < 1 || samples > kMaxComponents || (!grey && photometric != PHOTOMETRIC_RGB)) {
    return Refused(fmt::format("a colour image of {} samples a pixel, kind {}, must be grey or RGB", samples, photometric));
  }
  if (samples > 1 && Field<std::uint16_t>(TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) != PLANARCONFIG_CONTIG) {
    return Refused("components in planes of their own are not supported");
  }
  const auto bits = Field<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1), format = Field<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const std::optional<SampleType> type = ToSampleType(bits, format);
  if (!type) {
    return Refused(fmt::format(
        "samples of {} bits and format {} are not supported, integers of 8 to 64 bits and floats of 32 and 64 bits are", bits, format));
  }
  const auto width = Field<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0), height = Field<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
  RawHeader header{.components = samples, .type = *type};
  if (Status status = SetSize(header, path_, {double(width), double(height), 1}, {}); !status.ok()) return status;
  const auto x_resolution = Field<float>(TIFFTAG_XRESOLUTION, 0), y_resolution = Field<float>(TIFFTAG_YRESOLUTION, 0);
  if (x_resolution > 0 && y_resolution > 0) header.steps[1].y = double(x_resolution) / double(y_resolution);
  return header;
}

Status TiffFile::ReadSamples(const RawHeader& header, std::byte* out) {
  if (TIFFIsTiled(tiff_.get()) != 0) return ReadTiles(header, out);
  const std::size_t row_bytes = std::size_t(header.size.x) * PixelBytes(header);
  // libtiff writes whole scanlines, and computes their length itself.
  if (std::size_t(TIFFScanlineSize64(tiff_.get())) != row_bytes) return Damaged();
  for (std::int32_t y = 0; y < header.size.y; ++y) {
    if (TIFFReadScanline(tiff_.get(), out + std::size_t(y) * row_bytes, std::uint32_t(y), 0) < 0) return Damaged();
  }
  return Status::Ok();
}

Status TiffFile::ReadTiles(const RawHeader& header, std::byte* out) {
  const auto tile_width = Field<std::uint32_t>(TIFFTAG_TILEWIDTH, 0), tile_height = Field<std::uint32_t>(TIFFTAG_TILELENGTH, 0);
  const std::size_t pixel_bytes = PixelBytes(header);
  const std::uint64_t tile_bytes = TIFFTileSize64(tiff_.get());
  const std::uint32_t side_limit = std::uint32_t{kMaxVolumeSide} + 1;
  if (tile_width == 0 || tile_height == 0 || tile_width > side_limit || tile_height > side_limit ||
      tile_bytes != std::uint64_t{tile_width} * tile_height * pixel_bytes) {
    return Damaged();
  }
  if (Status status = CheckFitsMemory(std::int64_t(tile_bytes), path_ + ": one tile"); !status.ok()) return status;
  std::vector<std::byte> tile(tile_bytes);
  const auto width = std::uint32_t(header.size.x), height = std::uint32_t(header.size.y);
  for (std::uint32_t y = 0; y < height; y += tile_height) {
    for (std::uint32_t x = 0; x < width; x += tile_width) {
      if (TIFFReadTile(tiff_.get(), tile.data(), x, y, 0, 0) < 0) return Damaged();
      const std::size_t run_bytes = std::min(tile_width, width - x) * pixel_bytes;
      for (std::uint32_t row = 0; row < std::min(tile_height, height - y); ++row) {
        std::memcpy(out + ((std::size_t(y) + row) * width + x) * pixel_bytes, tile.data() + std::size_t(row) * tile_width * pixel_bytes,
                    run_bytes);
      }
    }
  }
  return Status::Ok();
}

Result<std::unique_ptr<SliceFile>> OpenSliceFile(const std::string& path) {
  auto file = std::make_unique<TiffFile>(path);
  if (!file->is_open()) return file->NotTiff();
  const Result<std::int64_t> pages = file->CountPages();
  if (!pages.ok()) return pages.status();
  if (*pages != 1) return file->Refused(fmt::format("has {} pages, must have 1 in a folder of slices", *pages));
  return std::unique_ptr<SliceFile>(std::move(file));
}

Result<RawVolume> ReadPages(const std::string& path, const ReadOptions& options) {
  TiffFile file(path);
  if (!file.is_open()) return file.NotTiff();
  Result<RawHeader> first = file.ReadHeader();
  if (!first.ok()) return first.status();
  const Result<std::int64_t> pages = file.CountPages();
  if (!pages.ok()) return pages.status();
  const Result<PageOrder> order = file.ReadPageOrder(*pages, options);
  if (!order.ok()) return order.status();
  if (order->spacing) {
    first->steps = StepsOf(*order->spacing);
    first->unit = LengthUnit::kMicrometre;
  }
  if (order->count == 1) return Status::InvalidArgument(path + ": has 2 dimensions, must have 3 (a page for each slice)");
  ReadOptions rest = options;
  if (order->of_channel) rest.channel.reset();
  Result<RawVolume> raw = TakeMemoryForSlices(path, *first, order->count, BytesOfFile(path), rest);
  for (std::int64_t slice = 0; raw.ok() && slice < order->count; ++slice) {
    const std::int64_t page = order->first + slice * order->step;
    if (Status status = file.GoToPage(page); !status.ok()) return status;
    if (Status status = ReadSlice(file, fmt::format("{}: page {}", path, page + 1), slice, *raw, options); !status.ok()) return status;
  }
  return raw;
}

std::vector<std::string_view> Endings() { return {".tif", ".tiff"}; }

// A folder of slices.
bool Recognises(const std::string& path, const ReadOptions&) { return !SlicesIn(path, Endings()).empty(); }

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const std::vector<std::string> slices = SlicesIn(path, Endings());
  if (slices.empty()) return ReadPages(path, options);
  if (options.time) return Status::InvalidArgument(path + ": time is for OME-TIFF files, not for a folder of slices");
  return ReadSliceStack(path, slices, OpenSliceFile, options);
}

}  // namespace

VolumeFormat Tiff() {
  return {.name = "TIFF",
          .endings = Endings(),
          .also = "a folder of .tif slices",
          .recognises = Recognises,
          .options = {"time", "channel", "spacing"},
          .read = Read};
}

}  // namespace slabstream
