// The pixels of a TIFF directory.
#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstring>

#include "common/volume/memory_budget.h"
#include "data/volume_io/tiff_field.h"
#include "data/volume_io/tiff_file.h"
#include "data/volume_io/tiff_input.h"

namespace slabstream {
namespace {

// `out`: uint8 or uint16, as `bits` need.
void Unpack(const std::byte* in, unsigned bits, std::byte* out, std::size_t count) {
  std::uint32_t buffer = 0;
  unsigned held = 0;  // bits of it
  for (std::size_t i = 0; i < count; ++i) {
    for (; held < bits; held += 8) buffer = buffer << 8 | std::to_integer<std::uint32_t>(*in++);
    held -= bits;
    const auto sample = std::uint16_t(buffer >> held & ((1U << bits) - 1));
    std::memcpy(out, &sample, bits < 8 ? 1 : 2);  // little endian
    out += bits < 8 ? 1 : 2;
  }
}

// Samples of each pixel that a chunk holds together.
int Together(const RawHeader& header, const TiffChunks& chunks) { return chunks.separate ? 1 : header.components; }

}  // namespace

unsigned TiffFile::Bits() const { return Field<std::uint16_t>(tiff_.get(), TIFFTAG_BITSPERSAMPLE, 1); }

std::size_t TiffFile::RowBytes(std::int64_t samples) const { return (std::size_t(samples) * Bits() + 7) / 8; }

Status TiffFile::CheckPlanes(const RawHeader& header, std::int64_t count) const {
  const bool plain =
      Field<std::uint16_t>(tiff_.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_NONE && TIFFIsTiled(tiff_.get()) == 0 &&
      (header.components == 1 || Field<std::uint16_t>(tiff_.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_CONTIG);
  const std::uint64_t first = TIFFGetStrileOffset(tiff_.get(), 0);
  std::uint64_t end = first;
  for (std::uint32_t strip = 0; plain && strip < TIFFNumberOfStrips(tiff_.get()); ++strip) {
    if (TIFFGetStrileOffset(tiff_.get(), strip) != end) break;
    end += TIFFGetStrileByteCount(tiff_.get(), strip);
  }
  const std::uint64_t plane_bytes = RowBytes(std::int64_t{header.size.x} * header.components) * std::uint64_t(header.size.y);
  if (!plain || end - first != plane_bytes) {
    return Refused(fmt::format("one page for {} pictures, which must then be uncompressed and in one piece", count));
  }
  const std::uint64_t held = first < size() ? (size() - first) / plane_bytes : 0;
  if (held >= std::uint64_t(count)) return Status::Ok();
  return Status::DataLoss(fmt::format("{}: truncated: its description speaks of {} pictures, the file holds {}", path_, count, held));
}

Result<TiffChunks> TiffFile::ReadChunks(const RawHeader& header) const {
  const bool separate =
      header.components > 1 && Field<std::uint16_t>(tiff_.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_SEPARATE;
  const int together = separate ? 1 : header.components;
  if (TIFFIsTiled(tiff_.get()) == 0) {
    const std::size_t row_bytes = RowBytes(std::int64_t{header.size.x} * together);
    // libtiff writes whole rows, and computes their length itself.
    if (std::size_t(TIFFScanlineSize64(tiff_.get())) != row_bytes) return Damaged();
    constexpr std::size_t kEnough = std::size_t{256} << 10;  // bytes
    const auto height = std::uint64_t(header.size.y);
    const std::uint64_t strip = std::clamp<std::uint64_t>(Field<std::uint32_t>(tiff_.get(), TIFFTAG_ROWSPERSTRIP, 0), 1, height);
    const std::uint64_t strips = std::max<std::uint64_t>(kEnough / (strip * row_bytes), 1);
    return TiffChunks{.width = header.size.x,
                      .height = std::int32_t(std::min(strips * strip, height)),
                      .strip = std::int32_t(strip),
                      .separate = separate};
  }
  const auto width = Field<std::uint32_t>(tiff_.get(), TIFFTAG_TILEWIDTH, 0),
             height = Field<std::uint32_t>(tiff_.get(), TIFFTAG_TILELENGTH, 0);
  const std::uint32_t side_limit = std::uint32_t{kMaxVolumeSide} + 1;
  if (width == 0 || height == 0 || width > side_limit || height > side_limit ||
      TIFFTileSize64(tiff_.get()) != height * RowBytes(std::int64_t{width} * together)) {
    return Damaged();
  }
  return TiffChunks{.width = std::int32_t(width), .height = std::int32_t(height), .separate = separate};
}

Result<std::uint64_t> TiffFile::ReadStored(const TiffChunks& chunks, const TiffChunk& chunk, std::size_t row_bytes,
                                           std::span<std::byte> out) {
  const auto x = std::uint32_t(chunk.column * chunks.width), y = std::uint32_t(chunk.row * chunks.height);
  const auto component = std::uint16_t(chunk.component);
  if (chunks.tiled()) {
    const std::uint32_t tile = TIFFComputeTile(tiff_.get(), x, y, 0, component);
    if (TIFFReadEncodedTile(tiff_.get(), tile, out.data(), tmsize_t(out.size())) != tmsize_t(out.size())) return Damaged();
    return TIFFGetStrileByteCount(tiff_.get(), tile);
  }
  std::uint64_t stored_bytes = 0;
  const std::size_t strip_bytes = std::size_t(chunks.strip) * row_bytes;
  for (std::uint32_t strip = TIFFComputeStrip(tiff_.get(), y, component); !out.empty(); ++strip) {
    const std::size_t bytes = std::min(strip_bytes, out.size());
    if (TIFFReadEncodedStrip(tiff_.get(), strip, out.data(), tmsize_t(bytes)) != tmsize_t(bytes)) return Damaged();
    stored_bytes += TIFFGetStrileByteCount(tiff_.get(), strip);
    out = out.subspan(bytes);
  }
  return stored_bytes;
}

Result<std::uint64_t> TiffFile::ReadBehind(const RawHeader& header, const TiffChunks& chunks, const TiffChunk& chunk, std::size_t row_bytes,
                                           std::span<std::byte> out) const {
  const std::uint64_t row =
      std::uint64_t(chunk.plane) * std::uint64_t(header.size.y) + std::uint64_t(chunk.row) * std::uint64_t(chunks.height);
  if (input_->ReadAt(TIFFGetStrileOffset(tiff_.get(), 0) + row * row_bytes, out.data(), out.size()) != out.size()) return Damaged();
  if (TIFFIsByteSwapped(tiff_.get()) != 0 && !IsPacked(Bits())) SwapByteOrder(header.type, out);
  return out.size();
}

Result<std::uint64_t> TiffFile::ReadChunk(const RawHeader& header, const TiffChunks& chunks, const TiffChunk& chunk,
                                          std::span<std::byte> out) {
  const std::size_t row_samples = std::size_t(chunks.width) * std::size_t(Together(header, chunks)),
                    row_bytes = RowBytes(std::int64_t(row_samples));
  const auto read = [&](std::span<std::byte> to) {
    return chunk.plane == 0 ? ReadStored(chunks, chunk, row_bytes, to) : ReadBehind(header, chunks, chunk, row_bytes, to);
  };
  if (!IsPacked(Bits())) return read(out);
  const std::size_t out_row_bytes = row_samples * BytesPerSample(header.type), rows = out.size() / out_row_bytes;
  std::vector<std::byte> packed(rows * row_bytes);
  Result<std::uint64_t> stored = read(packed);
  for (std::size_t row = 0; stored.ok() && row < rows; ++row) {
    Unpack(packed.data() + row * row_bytes, Bits(), out.data() + row * out_row_bytes, row_samples);
  }
  return stored;
}

Status TiffFile::ReadSamples(const RawHeader& header, std::byte* out) {
  const Result<TiffChunks> chunks = ReadChunks(header);
  if (!chunks.ok()) return chunks.status();
  const std::size_t sample_bytes = BytesPerSample(header.type), pixel_bytes = sample_bytes * std::size_t(header.components);
  const std::size_t part_bytes = sample_bytes * std::size_t(Together(header, *chunks));  // of a pixel in a chunk
  const std::size_t row_bytes = std::size_t(header.size.x) * pixel_bytes, chunk_row_bytes = std::size_t(chunks->width) * part_bytes;
  const bool in_place = !chunks->tiled() && !chunks->separate;  // chunks are rows of the picture
  std::vector<std::byte> buffer;
  if (!in_place) {
    const std::size_t bytes = std::size_t(chunks->height) * chunk_row_bytes;
    if (Status status = CheckFitsMemory(std::int64_t(bytes), path_ + ": one tile"); !status.ok()) return status;
    buffer.resize(bytes);
  }
  for (int component = 0; component < (chunks->separate ? header.components : 1); ++component) {
    for (std::int32_t y = 0, row = 0; y < header.size.y; y += chunks->height, ++row) {
      const auto rows = std::size_t(std::min(chunks->height, header.size.y - y));
      for (std::int32_t x = 0, column = 0; x < header.size.x; x += chunks->width, ++column) {
        std::byte* const to = out + std::size_t(y) * row_bytes + std::size_t(x) * pixel_bytes + std::size_t(component) * sample_bytes;
        const std::span<std::byte> decoded = in_place          ? std::span(to, rows * row_bytes)
                                             : chunks->tiled() ? std::span(buffer)
                                                               : std::span(buffer).first(rows * chunk_row_bytes);
        const auto read = ReadChunk(header, *chunks, {column, row, component, plane_}, decoded);
        if (!read.ok()) return read.status();
        if (in_place) continue;
        const auto pixels = std::size_t(std::min(chunks->width, header.size.x - x));
        for (std::size_t i = 0; i < rows; ++i) {
          const std::byte* const from = buffer.data() + i * chunk_row_bytes;
          if (part_bytes == pixel_bytes) {
            std::memcpy(to + i * row_bytes, from, pixels * pixel_bytes);
          } else {
            for (std::size_t k = 0; k < pixels; ++k) std::memcpy(to + i * row_bytes + k * pixel_bytes, from + k * part_bytes, part_bytes);
          }
        }
      }
    }
  }
  return Status::Ok();
}

}  // namespace slabstream
