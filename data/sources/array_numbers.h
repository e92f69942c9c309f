// The elements of a box of an array as numbers: what is read of arrays that hold no voxels, such as the points and cells of a grid.
//
// Any thread, but for what waits: not on one that decodes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "data/sources/chunked_array.h"
#include "data/volume_io/converted_samples.h"

namespace slabstream {

// A box of an array: the first element along each axis, and how many there are, at least one each. It lies inside the array.
struct ArrayBox {
  std::vector<std::uint64_t> begin, count;
};

// Its elements, the last axis fastest, in this machine's byte order. Calls `done` once, perhaps before this returns. ResourceExhausted,
// naming `named`: they do not fit the memory. Errors of ChunkedArray::ReadChunk.
using ElementsDone = std::function<void(Result<AlignedVector<std::byte>>)>;
void ReadElements(const std::string& named, const std::shared_ptr<ChunkedArray>& array, const ArrayBox& box, ElementsDone done);
// Waits.
Result<AlignedVector<std::byte>> ReadElements(const std::string& named, const std::shared_ptr<ChunkedArray>& array, const ArrayBox& box);

template <class T>
Result<AlignedVector<T>> ReadNumbers(const std::string& named, const std::shared_ptr<ChunkedArray>& array, const ArrayBox& box) {
  const Result<AlignedVector<std::byte>> elements = ReadElements(named, array, box);
  return elements.ok() ? Result(Converted<T>(array->shape().type, *elements)) : elements.status();
}

}  // namespace slabstream
