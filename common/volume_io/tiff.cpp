// TIFF: a multi-page file, or a directory of files, one a slice.
//
// TIFF states no distance between slices, and its resolution is meant for print: spacing is 1 along x and z, and along y the ratio of the
// two resolutions.
#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "common/volume/memory_budget.h"
#include "common/volume_io/raw_volume.h"
#include "common/volume_io/text_header.h"

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
class TiffFile {
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

  // Counts the pages to the end of the chain; a broken chain is an error.
  Result<std::int64_t> CountPages() {
    std::int64_t pages = 1;
    while (TIFFReadDirectory(tiff_.get()) != 0) {
      if (++pages > kMaxVolumeSide) break;
    }
    if (!complaint_->empty()) return Failed(StatusCode::kDataLoss, "truncated or damaged after page " + std::to_string(pages));
    return pages;
  }
  Status GoToFirstPage() { return TIFFSetDirectory(tiff_.get(), 0) != 0 ? Status::Ok() : Damaged(); }
  Status GoToNextPage() { return TIFFReadDirectory(tiff_.get()) != 0 ? Status::Ok() : Damaged(); }

  // Size (along z: 1), type and spacing of this page. InvalidArgument unless it has one sample a pixel of a type that is supported.
  Result<RawHeader> ReadPageHeader() const;

  // Reads the samples of this page, with its own `header`, in this machine's byte order. DataLoss: truncated or damaged.
  Status ReadPage(const RawHeader& header, std::byte* out);

 private:
  template <class T>
  T Field(ttag_t tag, T if_absent) const {
    T value = if_absent;
    return TIFFGetFieldDefaulted(tiff_.get(), tag, &value) != 0 ? value : if_absent;
  }
  Status ReadTiles(const RawHeader& header, std::byte* out);

  std::string path_;
  std::unique_ptr<std::string> complaint_ = std::make_unique<std::string>();  // its address is the handler's
  struct Close {
    void operator()(TIFF* tiff) const { TIFFClose(tiff); }
  };
  std::unique_ptr<TIFF, Close> tiff_;
};

std::optional<SampleType> ToSampleType(unsigned bits, unsigned format) {
  const bool is_unsigned = format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_VOID;
  const char* kind = is_unsigned ? "uint" : format == SAMPLEFORMAT_INT ? "int" : format == SAMPLEFORMAT_IEEEFP ? "float" : "";
  return SampleTypeNamed(kind + std::to_string(bits));
}

Result<RawHeader> TiffFile::ReadPageHeader() const {
  const auto samples = Field<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL, 1);
  if (samples != 1 || Field<std::uint16_t>(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == PHOTOMETRIC_PALETTE) {
    return Refused(fmt::format("a colour image ({} samples a pixel or a palette), must have 1 sample", samples));
  }
  const auto bits = Field<std::uint16_t>(TIFFTAG_BITSPERSAMPLE, 1), format = Field<std::uint16_t>(TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const std::optional<SampleType> type = ToSampleType(bits, format);
  if (!type) {
    return Refused(fmt::format(
        "samples of {} bits and format {} are not supported, integers of 8 to 64 bits and floats of 32 and 64 bits are", bits, format));
  }
  const auto width = Field<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0), height = Field<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0);
  const Result<Index3> size = ToSize(path_, {double(width), double(height), 1});
  if (!size.ok()) return size.status();

  RawHeader header{.size = *size, .type = *type};
  const auto x_resolution = Field<float>(TIFFTAG_XRESOLUTION, 0), y_resolution = Field<float>(TIFFTAG_YRESOLUTION, 0);
  if (x_resolution > 0 && y_resolution > 0) header.steps[1].y = double(x_resolution) / double(y_resolution);
  return header;
}

Status TiffFile::ReadPage(const RawHeader& header, std::byte* out) {
  if (TIFFIsTiled(tiff_.get()) != 0) return ReadTiles(header, out);
  const std::size_t row_bytes = std::size_t(header.size.x) * BytesPerSample(header.type);
  // libtiff writes whole scanlines, and computes their length itself.
  if (std::size_t(TIFFScanlineSize64(tiff_.get())) != row_bytes) return Damaged();
  for (std::int32_t y = 0; y < header.size.y; ++y) {
    if (TIFFReadScanline(tiff_.get(), out + std::size_t(y) * row_bytes, std::uint32_t(y), 0) < 0) return Damaged();
  }
  return Status::Ok();
}

Status TiffFile::ReadTiles(const RawHeader& header, std::byte* out) {
  const auto tile_width = Field<std::uint32_t>(TIFFTAG_TILEWIDTH, 0), tile_height = Field<std::uint32_t>(TIFFTAG_TILELENGTH, 0);
  const std::size_t sample_bytes = BytesPerSample(header.type);
  const std::uint64_t tile_bytes = TIFFTileSize64(tiff_.get());
  const std::uint32_t side_limit = std::uint32_t{kMaxVolumeSide} + 1;
  if (tile_width == 0 || tile_height == 0 || tile_width > side_limit || tile_height > side_limit ||
      tile_bytes != std::uint64_t{tile_width} * tile_height * sample_bytes) {
    return Damaged();
  }
  if (Status status = CheckFitsMemory(std::int64_t(tile_bytes), path_ + ": one tile"); !status.ok()) return status;
  std::vector<std::byte> tile(tile_bytes);
  const auto width = std::uint32_t(header.size.x), height = std::uint32_t(header.size.y);
  for (std::uint32_t y = 0; y < height; y += tile_height) {
    for (std::uint32_t x = 0; x < width; x += tile_width) {
      if (TIFFReadTile(tiff_.get(), tile.data(), x, y, 0, 0) < 0) return Damaged();
      const std::size_t run_bytes = std::min(tile_width, width - x) * sample_bytes;
      for (std::uint32_t row = 0; row < std::min(tile_height, height - y); ++row) {
        std::memcpy(out + ((std::size_t(y) + row) * width + x) * sample_bytes, tile.data() + std::size_t(row) * tile_width * sample_bytes,
                    run_bytes);
      }
    }
  }
  return Status::Ok();
}

// Takes memory for a whole volume of pages like `page`, after checking that files of that many bytes can hold it.
Result<RawVolume> Allocate(const std::string& path, const RawHeader& page, std::int64_t pages, std::int64_t file_bytes,
                           const ReadOptions& options) {
  const Result<Index3> size = ToSize(path, {double(page.size.x), double(page.size.y), double(pages)});
  if (!size.ok()) return size.status();
  RawVolume raw{page, {}};
  raw.header.size = *size;
  const std::int64_t needed = raw.header.sample_bytes();
  // More than LZW (1400), deflate (1032) and LZMA (7000) reach; a file that claims more is damaged.
  constexpr std::int64_t kMaxRatio = 8192;
  if (needed / kMaxRatio > file_bytes) {
    return Status::DataLoss(
        fmt::format("{}: truncated: the header speaks of {} bytes of samples, the file has {}", path, needed, file_bytes));
  }
  if (Status status = CheckFitsMemory(needed, path); !status.ok()) return status;
  if (!options.headers_only) raw.bytes.resize(std::size_t(needed));
  return raw;
}

std::int64_t FileBytes(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  return error ? 0 : std::int64_t(bytes);
}

// Reads the current page of `file` as slice number `slice` of the volume. `name`: of the page, for messages.
Status ReadSlice(TiffFile& file, const std::string& name, std::int64_t slice, RawVolume& volume, const ReadOptions& options) {
  const Result<RawHeader> page = file.ReadPageHeader();
  if (!page.ok()) return page.status();
  const RawHeader& wanted = volume.header;
  if (page->size.x != wanted.size.x || page->size.y != wanted.size.y || page->type != wanted.type) {
    return Status::InvalidArgument(fmt::format("{} is {} x {} {}, must be {} x {} {} like the first one", name, page->size.x, page->size.y,
                                               ToString(page->type), wanted.size.x, wanted.size.y, ToString(wanted.type)));
  }
  return options.headers_only ? Status::Ok() : file.ReadPage(*page, volume.bytes.data() + slice * page->sample_bytes());
}

Result<RawVolume> ReadPages(const std::string& path, const ReadOptions& options) {
  TiffFile file(path);
  if (!file.is_open()) return file.NotTiff();
  const Result<RawHeader> first = file.ReadPageHeader();
  if (!first.ok()) return first.status();
  const Result<std::int64_t> pages = file.CountPages();
  if (!pages.ok()) return pages.status();
  if (*pages == 1) return Status::InvalidArgument(path + ": has 2 dimensions, must have 3 (a page for each slice)");
  Result<RawVolume> raw = Allocate(path, *first, *pages, FileBytes(path), options);
  for (std::int64_t page = 0; raw.ok() && page < *pages; ++page) {
    if (Status status = page == 0 ? file.GoToFirstPage() : file.GoToNextPage(); !status.ok()) return status;
    if (Status status = ReadSlice(file, fmt::format("{}: page {}", path, page + 1), page, *raw, options); !status.ok()) return status;
  }
  return raw;
}

Result<RawVolume> ReadSlices(const std::string& directory, const std::vector<std::string>& paths, const ReadOptions& options) {
  std::int64_t file_bytes = 0;
  for (const std::string& path : paths) file_bytes += FileBytes(path);
  std::optional<RawVolume> raw;
  for (std::size_t slice = 0; slice < paths.size(); ++slice) {
    TiffFile file(paths[slice]);
    if (!file.is_open()) return file.NotTiff();
    if (!raw) {
      const Result<RawHeader> first = file.ReadPageHeader();
      if (!first.ok()) return first.status();
      Result<RawVolume> allocated = Allocate(directory, *first, std::int64_t(paths.size()), file_bytes, options);
      if (!allocated.ok()) return allocated;
      raw = *std::move(allocated);
    }
    if (Status status = ReadSlice(file, paths[slice], std::int64_t(slice), *raw, options); !status.ok()) return status;
    const Result<std::int64_t> pages = file.CountPages();
    if (!pages.ok()) return pages.status();
    if (*pages != 1) return file.Refused(fmt::format("has {} pages, must have 1 in a directory of slices", *pages));
  }
  return *std::move(raw);
}

// A key that sorts numbers inside names by value, s2 before s10: each becomes a 0, the count of its digits, and its digits.
std::string NaturalKey(const std::string& name) {
  std::string key;
  for (std::size_t i = 0; i < name.size();) {
    const std::size_t number = std::min(name.find_first_of("0123456789", i), name.size());
    key.append(name, i, number - i);
    i = std::min(name.find_first_not_of("0123456789", number), name.size());
    const std::size_t digits = std::min(name.find_first_not_of('0', number), i);
    if (number < i) key.append({'0', char(i - digits)}).append(name, digits, i - digits);
  }
  return key;
}

}  // namespace

std::vector<std::string> TiffFilesIn(const std::string& directory) {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(directory, error)) {
    const std::string ending = ToLower(entry.path().extension().string());
    if ((ending == ".tif" || ending == ".tiff") && entry.is_regular_file(error)) paths.push_back(entry.path().string());
  }
  std::ranges::sort(paths, {}, [](const std::string& path) { return std::pair(NaturalKey(path), path); });
  return paths;
}

Result<RawVolume> ReadTiff(const std::string& path, const ReadOptions& options) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return ReadPages(path, options);
  const std::vector<std::string> slices = TiffFilesIn(path);
  if (slices.empty()) return Status::InvalidArgument(path + ": a directory without TIFF files is not a volume");
  return ReadSlices(path, slices, options);
}

}  // namespace slabstream
