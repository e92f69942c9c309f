// TiffPagesArray: pictures of one size in TIFF files as an array of the axes z, y, x, and where a pixel has several components, these.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/volume_io/tiff_file.h"

namespace slabstream {

// Where a picture is.
struct TiffPlace {
  std::size_t file = 0;         // in the pool
  std::uint64_t directory = 0;  // its place there
  std::int64_t plane = 0;       // TiffChunk::plane
};

// Open files at directories, which are used by one thread at a time: those that were used last.
class TiffPool {
 public:
  // `files`: their paths.
  explicit TiffPool(std::vector<std::string> files) : files_(std::move(files)) {}

  struct Entry {
    std::size_t number = 0;  // the file's number
    std::uint64_t directory = 0;
    std::unique_ptr<TiffFile> file;
    bool is_new = true;  // nobody has used it
  };
  // Any thread. Errors of TiffFile::Open.
  Result<Entry> Take(const TiffPlace& place);
  void Return(Entry entry);

 private:
  const std::vector<std::string> files_;
  std::mutex mutex_;            // guards what follows
  std::vector<Entry> entries_;  // the last used one last
};

class TiffPagesArray : public ChunkedArray {
 public:
  // `places`: of the pictures, along z. `picture`: the header of each. `name`: for messages.
  TiffPagesArray(std::string name, std::shared_ptr<TiffPool> pool, std::vector<TiffPlace> places, const RawHeader& picture,
                 const TiffChunks& chunks, SourceContext context);

  const ArrayShape& shape() const override { return state_->shape; }
  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done) override;

 private:
  // What a chunk under way needs, which may outlive the array.
  struct State {
    std::string name;
    std::shared_ptr<TiffPool> pool;
    std::vector<TiffPlace> places;
    RawHeader picture;
    TiffChunks chunks;
    ArrayShape shape;

    Result<std::optional<StoredChunk>> Read(std::size_t slice, const TiffChunk& chunk) const;
    Status CheckPage(const std::string& page, TiffFile& file) const;
  };

  const std::shared_ptr<const State> state_;
  const SourceContext context_;
};

}  // namespace slabstream
