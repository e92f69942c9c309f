// Bytes as writers of chunked volumes pack them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace slabstream {

// The names that files give to codecs: "gzip", "zlib", "deflate" (without a header), "zstd", "blosc" (with zstd and a shuffle), "lz4",
// "crc32c", "bzip2", "xz", "brotli"; "lz4 block", bare, and "lz4 java", in its frame. "": as they are.
std::string PackBytes(const std::string& codec, const std::string& bytes, std::size_t element_bytes = 1);

// shuffle: 0 none, 1 of bytes, 2 of bits. `inner`: "blosclz", "lz4", "lz4hc", "snappy", "zlib", "zstd". "": this libblosc does not have it.
std::string PackBlosc(const std::string& inner, int shuffle, std::size_t element_bytes, const std::string& bytes);

// A frame that does not say how many bytes it holds.
std::string PackZstdStream(const std::string& bytes);

// Shuffles elements of so many bytes.
std::string ShuffledBytes(const std::string& bytes, std::size_t element_bytes);
// Bit by bit, in blocks of so many elements, a multiple of 8.
std::string BitshuffledBytes(const std::string& bytes, std::size_t element_bytes, std::size_t block_elements);
// Blocks of so many bytes, each packed by a codec, in the frame of filters of HDF5. `bitshuffle`: of elements of so many bytes; 0: none.
std::string PackBlocks(const std::string& codec, const std::string& bytes, std::size_t block_bytes, std::size_t bitshuffle);
std::string SwappedBytes(const std::string& bytes, std::size_t element_bytes);

}  // namespace slabstream
