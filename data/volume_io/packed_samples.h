// PackedSamples: samples of a file that are written in base64, or packed in blocks one by one, or both, as VTK's XML files have them. The
// blocks follow each other, so any part of the samples lies in one range of the file.
//
// Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/memory/bytes.h"

namespace slabstream {

class ChunkCodec;

struct PackedSamples {
  struct Range {
    std::uint64_t begin = 0, bytes = 0;
  };

  std::string name;                           // the name of the file and of the samples, for messages
  std::uint64_t begin = 0;                    // byte of the file; of base64: the first one of four letters
  bool base64 = false;                        // letters follow each other, without blanks
  std::uint64_t before = 0;                   // bytes that the first four letters have before the samples
  std::uint64_t bytes = 0;                    // of all samples, decoded
  std::shared_ptr<const ChunkCodec> codec{};  // of each block; null: they are not compressed
  std::uint64_t block_bytes = 1;              // decoded, of each block but the last one, which has the rest; above 0
  std::vector<std::uint64_t> block_ends{};    // the end of each block, in packed bytes behind the beginning of the first one
  bool big_endian = false;

  // Where a block lies, in packed bytes behind the beginning of the first one.
  Range PlaceOf(std::size_t block) const;
  // What of the file must be read for the decoded bytes `part`, which are not empty and lie inside.
  Range Stored(const Range& part) const;
  // The decoded bytes of `part`, in the file's byte order. `stored`: the bytes of Stored(part). DataLoss, naming the block: damaged.
  Result<Bytes> Decode(Bytes stored, const Range& part) const;
  // The decoded bytes of a block. Errors of Decode.
  Result<Bytes> DecodeBlock(std::size_t block, Bytes packed) const;

 private:
  Range Packed(const Range& part) const;
};

}  // namespace slabstream
