// All elements of a ChunkedArray, read chunk by chunk as its users do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/status.h"
#include "data/sources/chunked_array.h"

namespace slabstream {

inline Result<std::optional<StoredChunk>> ReadChunkNow(ChunkedArray& array, std::span<const std::uint64_t> index) {
  std::promise<Result<std::optional<StoredChunk>>> end;
  auto read = end.get_future();
  array.ReadChunk(index, [&end](Result<std::optional<StoredChunk>> chunk) { end.set_value(std::move(chunk)); });
  return read.get();
}

// Advances to the next of all positions below `counts`, the last axis fastest. False: that was the last one.
inline bool NextIndex(std::vector<std::uint64_t>& index, std::span<const std::uint64_t> counts) {
  for (std::size_t axis = counts.size(); axis-- > 0;) {
    if (++index[axis] < counts[axis]) return true;
    index[axis] = 0;
  }
  return false;
}

// The last axis varies fastest.
inline Result<std::vector<std::byte>> ReadArray(ChunkedArray& array) {
  const ArrayShape& shape = array.shape();
  const std::size_t axes = shape.size.size(), each = BytesPerSample(shape.type);
  CHECK_EQ(shape.chunk.size(), axes);
  CHECK_EQ(shape.fill.size(), each);
  std::uint64_t count = 1;
  std::vector<std::uint64_t> chunks(axes);
  for (std::size_t axis = 0; axis < axes; ++axis) {
    count *= shape.size[axis];
    chunks[axis] = (shape.size[axis] - 1) / shape.chunk[axis] + 1;
  }
  std::vector<std::byte> elements(count * each);
  std::vector<std::uint64_t> index(axes, 0);
  do {
    const Result<std::optional<StoredChunk>> chunk = ReadChunkNow(array, index);
    if (!chunk.ok()) return chunk.status();
    std::vector<std::uint64_t> stored(axes), inside(axes), at(axes, 0);  // elements of the chunk as it is stored; those in the array
    std::uint64_t bytes = each;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      inside[axis] = std::min(shape.chunk[axis], shape.size[axis] - index[axis] * shape.chunk[axis]);
      stored[axis] = shape.cut_at_end ? inside[axis] : shape.chunk[axis];
      bytes *= stored[axis];
    }
    if (*chunk) CHECK_EQ((*chunk)->elements.size(), bytes);
    do {
      std::uint64_t from = 0, to = 0;
      for (std::size_t axis = 0; axis < axes; ++axis) {
        from = from * stored[axis] + at[axis];
        to = to * shape.size[axis] + index[axis] * shape.chunk[axis] + at[axis];
      }
      const std::span<const std::byte> element =
          *chunk ? (*chunk)->elements.span().subspan(from * each, each) : std::span<const std::byte>(shape.fill);
      std::copy(element.begin(), element.end(), elements.begin() + std::ptrdiff_t(to * each));
    } while (NextIndex(at, inside));
  } while (NextIndex(index, chunks));
  return elements;
}

}  // namespace slabstream
