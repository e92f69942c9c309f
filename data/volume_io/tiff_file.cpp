#include "data/volume_io/tiff_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <tiffio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>

#include "common/base/file_descriptor.h"
#include "common/volume/memory_budget.h"

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

std::size_t PixelBytes(const RawHeader& header) { return BytesPerSample(header.type) * std::size_t(header.components); }

std::optional<SampleType> ToSampleType(unsigned bits, unsigned format) {
  const bool is_unsigned = format == SAMPLEFORMAT_UINT || format == SAMPLEFORMAT_VOID;
  const char* kind = is_unsigned ? "uint" : format == SAMPLEFORMAT_INT ? "int" : format == SAMPLEFORMAT_IEEEFP ? "float" : "";
  return SampleTypeNamed(kind + std::to_string(bits));
}

template <class T>
T Field(TIFF* tiff, ttag_t tag, T if_absent) {
  T value = if_absent;
  return TIFFGetFieldDefaulted(tiff, tag, &value) != 0 ? value : if_absent;
}

// Where a file says that its first directory is: bytes of its header.
struct FirstDirectory {
  std::uint64_t begin = 0;
  std::array<std::byte, 8> bytes{};
  std::size_t count = 0;  // of bytes; 0: the file's own ones
};

}  // namespace

// What libtiff reads: the file, but for the place of its first directory, so that any directory may be the first one. libtiff's own way to
// a directory walks through all others.
struct TiffFile::Input {
  std::shared_ptr<const FileDescriptor> file;
  std::uint64_t size = 0;
  FirstDirectory first = {};
  std::uint64_t at = 0;

  static Input& Of(thandle_t handle) { return *static_cast<Input*>(handle); }

  std::size_t ReadAt(std::uint64_t begin, std::byte* out, std::size_t bytes) const {
    std::size_t done = 0;
    while (done < bytes && begin + done < size) {
      const ssize_t got = ::pread(file->number(), out + done, bytes - done, off_t(begin + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      done += std::size_t(got);
    }
    for (std::size_t i = 0; i < first.count; ++i) {
      const std::uint64_t place = first.begin + i;
      if (place >= begin && place < begin + done) out[place - begin] = first.bytes[i];
    }
    return done;
  }

  static tmsize_t Read(thandle_t handle, void* out, tmsize_t bytes) {
    Input& input = Of(handle);
    const std::size_t done = input.ReadAt(input.at, static_cast<std::byte*>(out), std::size_t(bytes));
    input.at += done;
    return tmsize_t(done);
  }
  static tmsize_t Write(thandle_t, void*, tmsize_t) { return -1; }
  static toff_t Seek(thandle_t handle, toff_t to, int from) {
    Input& input = Of(handle);
    input.at = from == SEEK_CUR ? input.at + to : from == SEEK_END ? input.size + to : to;
    return input.at;
  }
  static int Close(thandle_t) { return 0; }
  static toff_t Size(thandle_t handle) { return Of(handle).size; }

  // Makes the directory at `offset` the first one.
  void SetFirst(std::uint64_t offset) {
    constexpr std::byte kBig{43};  // BigTIFF's number, 42 is TIFF's
    std::array<std::byte, 4> start{};
    first = {};
    ReadAt(0, start.data(), start.size());
    const bool little = start[0] == std::byte{'I'}, big = start[little ? 2 : 3] == kBig;
    first = {big ? 8U : 4U, std::bit_cast<std::array<std::byte, 8>>(offset), big ? 8U : 4U};
    if (!little) std::reverse(first.bytes.begin(), first.bytes.begin() + std::ptrdiff_t(first.count));
  }
};

void TiffFile::Close::operator()(tiff* handle) const { TIFFClose(handle); }

TiffFile::TiffFile(std::string path, Input input)
    : path_(std::move(path)), input_(std::make_unique<Input>(std::move(input))), complaint_(std::make_unique<std::string>()) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, KeepFirst, complaint_.get());
  TIFFOpenOptionsSetWarningHandlerExtR(options, Ignore, nullptr);
  tiff_.reset(TIFFClientOpenExt(path_.c_str(), "rm", input_.get(), Input::Read, Input::Write, Input::Seek, Input::Close, Input::Size,
                                nullptr, nullptr, options));
  TIFFOpenOptionsFree(options);
}
TiffFile::~TiffFile() = default;

Result<std::unique_ptr<TiffFile>> TiffFile::Open(const std::string& path) {
  auto descriptor = std::make_shared<const FileDescriptor>(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat state {};
  if (descriptor->number() < 0 || ::fstat(descriptor->number(), &state) != 0) {
    return Status::NotFound(fmt::format("{}: cannot be opened for reading: {}", path, std::generic_category().message(errno)));
  }
  std::unique_ptr<TiffFile> file(new TiffFile(path, {.file = std::move(descriptor), .size = std::uint64_t(state.st_size)}));
  if (file->tiff_ == nullptr) return file->Refused("not a TIFF volume");
  return file;
}

Result<std::unique_ptr<TiffFile>> TiffFile::At(std::uint64_t directory) const {
  Input input = *input_;
  input.at = 0;
  input.SetFirst(directory);
  std::unique_ptr<TiffFile> file(new TiffFile(path_, std::move(input)));
  if (file->tiff_ == nullptr) return file->Damaged();
  return file;
}

Status TiffFile::Failed(StatusCode code, const std::string& why) const {
  return {code, path_ + ": " + why + (complaint_->empty() ? "" : ": " + *complaint_)};
}
Status TiffFile::Damaged() const { return Failed(StatusCode::kDataLoss, "truncated or damaged"); }
Status TiffFile::Refused(const std::string& why) const { return Failed(StatusCode::kInvalidArgument, why); }

Result<std::vector<TiffPage>> TiffFile::ReadPages() {
  std::vector<TiffPage> pages;
  std::int64_t count = 0;
  do {
    const std::uint64_t offset = TIFFCurrentDirOffset(tiff_.get());
    // A smaller picture of the page before it.
    const bool reduced = (Field<std::uint32_t>(tiff_.get(), TIFFTAG_SUBFILETYPE, 0) & FILETYPE_REDUCEDIMAGE) != 0;
    if (reduced && !pages.empty()) {
      pages.back().smaller.push_back(offset);
    } else {
      std::uint16_t smaller = 0;
      const std::uint64_t* offsets = nullptr;
      pages.push_back({.offset = offset});
      if (TIFFGetField(tiff_.get(), TIFFTAG_SUBIFD, &smaller, &offsets) != 0) pages.back().smaller.assign(offsets, offsets + smaller);
    }
    ++count;
  } while (count <= kMaxVolumes && TIFFReadDirectory(tiff_.get()) != 0);
  if (!complaint_->empty()) return Failed(StatusCode::kDataLoss, "truncated or damaged after page " + std::to_string(count));
  return pages;
}

Result<PageOrder> TiffFile::ReadPageOrder(std::int64_t pages, const ReadOptions& options) const {
  const std::string description = Field<const char*>(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, "");
  if (IsOmeHeader(description)) return ReadOmeHeader(path_, description, pages, options);
  if (options.time) return Refused("time is for OME-TIFF files that state several times; this one does not");
  return PageOrder{.count = pages};
}

Result<RawHeader> TiffFile::ReadHeader() {
  const auto samples = Field<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLESPERPIXEL, 1),
             photometric = Field<std::uint16_t>(tiff_.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  const bool grey = photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE;
  if (samples < 1 || samples > kMaxComponents || (!grey && photometric != PHOTOMETRIC_RGB)) {
    return Refused(fmt::format("a colour image of {} samples a pixel, kind {}, must be grey or RGB", samples, photometric));
  }
  if (samples > 1 && Field<std::uint16_t>(tiff_.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) != PLANARCONFIG_CONTIG) {
    return Refused("components in planes of their own are not supported");
  }
  const auto bits = Field<std::uint16_t>(tiff_.get(), TIFFTAG_BITSPERSAMPLE, 1),
             format = Field<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const std::optional<SampleType> type = ToSampleType(bits, format);
  if (!type) {
    return Refused(fmt::format(
        "samples of {} bits and format {} are not supported, integers of 8 to 64 bits and floats of 32 and 64 bits are", bits, format));
  }
  const auto width = Field<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGEWIDTH, 0),
             height = Field<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGELENGTH, 0);
  RawHeader header{.components = samples, .type = *type};
  if (Status status = SetSize(header, path_, {double(width), double(height), 1}, {}); !status.ok()) return status;
  const auto x_resolution = Field<float>(tiff_.get(), TIFFTAG_XRESOLUTION, 0),
             y_resolution = Field<float>(tiff_.get(), TIFFTAG_YRESOLUTION, 0);
  if (x_resolution > 0 && y_resolution > 0) header.steps[1].y = double(x_resolution) / double(y_resolution);
  return header;
}

Result<TiffChunks> TiffFile::ReadChunks(const RawHeader& header) const {
  const std::size_t pixel_bytes = PixelBytes(header), row_bytes = std::size_t(header.size.x) * pixel_bytes;
  if (TIFFIsTiled(tiff_.get()) == 0) {
    // libtiff writes whole rows, and computes their length itself.
    if (std::size_t(TIFFScanlineSize64(tiff_.get())) != row_bytes) return Damaged();
    constexpr std::size_t kEnough = std::size_t{256} << 10;  // bytes
    const auto height = std::uint64_t(header.size.y);
    const std::uint64_t strip = std::clamp<std::uint64_t>(Field<std::uint32_t>(tiff_.get(), TIFFTAG_ROWSPERSTRIP, 0), 1, height);
    const std::uint64_t strips = std::max<std::uint64_t>(kEnough / (strip * row_bytes), 1);
    return TiffChunks{.width = header.size.x, .height = std::int32_t(std::min(strips * strip, height)), .strip = std::int32_t(strip)};
  }
  const auto width = Field<std::uint32_t>(tiff_.get(), TIFFTAG_TILEWIDTH, 0),
             height = Field<std::uint32_t>(tiff_.get(), TIFFTAG_TILELENGTH, 0);
  const std::uint32_t side_limit = std::uint32_t{kMaxVolumeSide} + 1;
  if (width == 0 || height == 0 || width > side_limit || height > side_limit ||
      TIFFTileSize64(tiff_.get()) != std::uint64_t{width} * height * pixel_bytes) {
    return Damaged();
  }
  return TiffChunks{.width = std::int32_t(width), .height = std::int32_t(height)};
}

Result<std::uint64_t> TiffFile::ReadChunk(const RawHeader& header, const TiffChunks& chunks, const TiffChunk& chunk,
                                          std::span<std::byte> out) {
  const auto x = std::uint32_t(chunk.column * chunks.width), y = std::uint32_t(chunk.row * chunks.height);
  if (chunks.tiled()) {
    const std::uint32_t tile = TIFFComputeTile(tiff_.get(), x, y, 0, 0);
    if (TIFFReadEncodedTile(tiff_.get(), tile, out.data(), tmsize_t(out.size())) != tmsize_t(out.size())) return Damaged();
    return TIFFGetStrileByteCount(tiff_.get(), tile);
  }
  std::uint64_t stored_bytes = 0;
  const std::size_t row_bytes = std::size_t(header.size.x) * PixelBytes(header), strip_bytes = std::size_t(chunks.strip) * row_bytes;
  for (std::uint32_t strip = y / std::uint32_t(chunks.strip); !out.empty(); ++strip) {
    const std::size_t bytes = std::min(strip_bytes, out.size());
    if (TIFFReadEncodedStrip(tiff_.get(), strip, out.data(), tmsize_t(bytes)) != tmsize_t(bytes)) return Damaged();
    stored_bytes += TIFFGetStrileByteCount(tiff_.get(), strip);
    out = out.subspan(bytes);
  }
  return stored_bytes;
}

Status TiffFile::ReadSamples(const RawHeader& header, std::byte* out) {
  const Result<TiffChunks> chunks = ReadChunks(header);
  if (!chunks.ok()) return chunks.status();
  const std::size_t pixel_bytes = PixelBytes(header), row_bytes = std::size_t(header.size.x) * pixel_bytes;
  const std::size_t tile_row_bytes = std::size_t(chunks->width) * pixel_bytes;
  std::vector<std::byte> tile;
  if (chunks->tiled()) {
    const std::size_t bytes = std::size_t(chunks->height) * tile_row_bytes;
    if (Status status = CheckFitsMemory(std::int64_t(bytes), path_ + ": one tile"); !status.ok()) return status;
    tile.resize(bytes);
  }
  for (std::int32_t y = 0, row = 0; y < header.size.y; y += chunks->height, ++row) {
    const auto rows = std::size_t(std::min(chunks->height, header.size.y - y));
    std::byte* const to = out + std::size_t(y) * row_bytes;
    for (std::int32_t x = 0, column = 0; x < header.size.x; x += chunks->width, ++column) {
      const auto read = ReadChunk(header, *chunks, {column, row}, chunks->tiled() ? std::span(tile) : std::span(to, rows * row_bytes));
      if (!read.ok()) return read.status();
      if (!chunks->tiled()) continue;
      const std::size_t run_bytes = std::size_t(std::min(chunks->width, header.size.x - x)) * pixel_bytes;
      for (std::size_t i = 0; i < rows; ++i) {
        std::memcpy(to + i * row_bytes + std::size_t(x) * pixel_bytes, tile.data() + i * tile_row_bytes, run_bytes);
      }
    }
  }
  return Status::Ok();
}

}  // namespace slabstream
