// The codecs that formats of chunked volumes share, each in a file of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "data/codecs/codec.h"

namespace slabstream {

using SharedCodec = std::shared_ptr<const ChunkCodec>;

// RFC 1952, of one or more members; RFC 1950.
SharedCodec GzipCodec();
SharedCodec ZlibCodec();
// RFC 8878, of one or more frames.
SharedCodec ZstdCodec();
// A chunk of Blosc 1, with any of its inner codecs and shuffles.
SharedCodec BloscCodec();
// A block of LZ4 behind the number of its decoded bytes (32 bits, little endian), as numcodecs writes it.
SharedCodec Lz4Codec();
// A bare block of LZ4, which does not tell how many bytes it holds, as VTK writes it.
SharedCodec Lz4BlockCodec();
// Blocks of LZ4 in the frame of lz4-java, as N5 writes them.
SharedCodec Lz4JavaCodec();
// Streams of bzip2 and xz, one or more, and a stream of brotli (RFC 7932), none of which tells how many bytes it holds.
SharedCodec Bzip2Codec();
SharedCodec XzCodec();
SharedCodec BrotliCodec();
// What LibLZF makes of bytes, as h5py writes it. It does not tell how many there are.
SharedCodec LzfCodec();
// Four bytes behind the others, or in front of them: their checksum, little endian. DataLoss unless it is theirs.
enum class Checksum : std::uint8_t { kCrc32c, kCrc32, kAdler32 };  // RFC 3720, 1952 and 1950
SharedCodec ChecksumCodec(Checksum checksum, bool in_front = false);
inline SharedCodec Crc32cCodec() { return ChecksumCodec(Checksum::kCrc32c); }
// Elements of so many bytes (1, 2, 4 or 8) in the other byte order.
SharedCodec SwapBytesCodec(std::size_t element_bytes);
// The first byte of each element, then the second one of each, and so on. `element_bytes` is at least 1.
SharedCodec ShuffleCodec(std::size_t element_bytes);
// The first bit of each element, then the second one of each, and so on, in blocks of so many elements (a multiple of 8, above 0); fewer
// than 8 elements at the end are as they were. `element_bytes` is at least 1.
SharedCodec BitshuffleCodec(std::size_t element_bytes, std::size_t block_elements);
// Blocks that are packed one by one in the frame of the LZ4 filter of HDF5, and of its bitshuffle filter, which shuffles before it packs.
struct BlockFormat {
  SharedCodec packing;  // packs one block
  bool bitshuffle = false;
  std::size_t element_bytes = 1;  // bytes of an element of what is shuffled
};
SharedCodec BlocksCodec(const BlockFormat& format);

std::uint32_t Crc32c(std::span<const std::byte> bytes);

}  // namespace slabstream
