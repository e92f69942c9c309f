// A compressed file, read from an offset on as the bytes that were packed. gzip, zlib and bzip2; members of a file that follow each other
// make one stream.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>

namespace slabstream {

// kDeflate: gzip or zlib, whichever its first bytes say. kBareDeflate: deflated bytes alone, without a header or a checksum.
enum class Compression : std::uint8_t { kNone, kDeflate, kBareDeflate, kBzip2 };

// By the first bytes of the file: gzip and bzip2; zlib has none that tell it.
Compression CompressionOf(const std::filesystem::path& file);

// The most bytes that one compressed byte can stand for.
//   kDeflate, kBareDeflate   zlib's technical notes
//   kBzip2                   a block holds 900000 bytes, of which 5 stand for up to 259, in at least 32 bytes
std::int64_t MaxRatio(Compression compression);
inline constexpr std::int64_t kMaxDeflateRatio = 1032;

// One thread at a time.
class Decompressor {
 public:
  // `file` must outlive what is made. Throws std::bad_alloc.
  static std::unique_ptr<Decompressor> Make(Compression compression, std::ifstream& file, std::int64_t offset);
  virtual ~Decompressor() = default;

  // Returns the bytes written to `out`: fewer than its size only at the end of the stream or of the file, or if the stream is damaged.
  virtual std::size_t Read(std::span<std::byte> out) = 0;
  virtual bool damaged() const = 0;
  // Reads the rest of the stream; true if it is sound, checksum included. Call it when everything wanted has been read.
  virtual bool EndsWell() = 0;
};

}  // namespace slabstream
