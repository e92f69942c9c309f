// Part of an open file.
#pragma once

#include <cstdint>
#include <string>

#include "data/stores/store.h"

namespace slabstream {

// Which bytes of an object of `size` bytes a range means.
struct ByteSpan {
  std::uint64_t begin = 0, bytes = 0;
};
// ResourceExhausted, naming `what`: more than `most`.
Result<ByteSpan> BytesOfRange(const std::string& what, std::uint64_t size, const ByteRange& range, std::uint64_t most);

// Reads a regular file. Fewer bytes if it ends before the range does. Unavailable: it cannot be read, or is no regular file;
// ResourceExhausted: as BytesOfRange. Messages begin with `what`.
Result<Bytes> ReadRange(int file, const std::string& what, const ByteRange& range, std::uint64_t most);

// Why a file cannot be opened: NotFound or Unavailable.
Status OpenFailure(const std::string& what, int error);

}  // namespace slabstream
