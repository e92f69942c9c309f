// TiffPagesArray: pictures of one size in a TIFF file as an array of the axes z, y, x, and where a pixel has several components, these.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "data/sources/chunked_array.h"
#include "data/sources/source_format.h"
#include "data/volume_io/tiff_file.h"

namespace slabstream {

// Open files at directories, which are used by one thread at a time: those that were used last.
class TiffPool {
 public:
  // `file`: whose directories they are.
  explicit TiffPool(std::unique_ptr<TiffFile> file) : file_(std::move(file)) {}

  struct Entry {
    std::uint64_t directory = 0;
    std::unique_ptr<TiffFile> file;
    bool is_new = true;  // nobody has used it
  };
  // Any thread. DataLoss: there is no such directory.
  Result<Entry> Take(std::uint64_t directory);
  void Return(Entry entry);

 private:
  const std::unique_ptr<TiffFile> file_;  // only opens others
  std::mutex mutex_;                      // guards what follows
  std::vector<Entry> entries_;            // the last used one last
};

class TiffPagesArray : public ChunkedArray {
 public:
  // `directories`: of the pages, along z. `picture`: the header of each. `name`: for messages.
  TiffPagesArray(std::string name, std::shared_ptr<TiffPool> pool, std::vector<std::uint64_t> directories, const RawHeader& picture,
                 const TiffChunks& chunks, SourceContext context);

  const ArrayShape& shape() const override { return state_->shape; }
  void ReadChunk(std::span<const std::uint64_t> index, ChunkDone done) override;

 private:
  // What a chunk under way needs, which may outlive the array.
  struct State {
    std::string name;
    std::shared_ptr<TiffPool> pool;
    std::vector<std::uint64_t> directories;
    RawHeader picture;
    TiffChunks chunks;
    ArrayShape shape;

    Result<std::optional<StoredChunk>> Read(std::size_t page, const TiffChunk& chunk) const;
    Status CheckPage(const std::string& page, TiffFile& file) const;
  };

  const std::shared_ptr<const State> state_;
  const SourceContext context_;
};

}  // namespace slabstream
