// MemoryArray: a ChunkedArray whose elements are in memory, with the faults that stores have as inputs: chunks that are missing, damaged or
// too short, and chunks that arrive when the test says so.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <vector>

#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"

namespace slabstream {

class MemoryArray : public ChunkedArray {
 public:
  // `elements`: all of the array, last axis fastest. With a context chunks arrive on its threads, else before ReadChunk returns.
  MemoryArray(ArrayShape shape, std::vector<std::byte> elements, SourceContext context = nullptr);

  // Set these before the first read. Chunks by their numbers, last axis fastest.
  std::set<std::uint64_t> missing, damaged, short_ones;
  bool held = false;  // chunks arrive by LetGo alone

  const ArrayShape& shape() const override { return shape_; }
  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done, StillWanted wanted) override;

  std::uint64_t chunk_count() const;  // chunks of the array
  const std::byte* element(std::span<const std::uint64_t> at) const;
  std::uint64_t NumberOf(std::span<const std::uint64_t> index) const;  // the number of a chunk

  std::size_t held_chunks() const;
  bool LetGo(std::size_t which);             // the chunk asked for at this place among the held ones arrives; false: there are fewer
  std::vector<std::uint64_t> asked() const;  // numbers of chunks, in order
  std::uint64_t most_under_way() const { return counter_->most; }  // chunks at a time: from ReadChunk until their elements are let go

 private:
  struct Counter {
    std::mutex mutex;
    std::uint64_t now = 0, most = 0;
  };
  using UnderWay = std::shared_ptr<void>;  // counts as long as it lives
  UnderWay Count() const;
  Result<std::optional<StoredChunk>> Chunk(std::span<const std::uint64_t> index, UnderWay under_way) const;

  const ArrayShape shape_;
  const std::vector<std::byte> elements_;
  const SourceContext context_;
  const std::shared_ptr<Counter> counter_ = std::make_shared<Counter>();
  mutable std::mutex mutex_;  // guards what follows
  std::deque<std::function<void()>> held_;
  std::vector<std::uint64_t> asked_;
};

}  // namespace slabstream
