// TiffFile: an open TIFF file at one of its directories, which describes a picture: a page, or a smaller picture of one. libtiff decodes.
// Errors name the file.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "data/volume_io/ome_header.h"
#include "data/volume_io/slice_stack.h"

struct tiff;  // libtiff's

namespace slabstream {

// Places of directories in the file.
struct TiffPage {
  std::uint64_t offset = 0;
  std::vector<std::uint64_t> smaller = {};  // pictures of the page at lower resolutions, in the file's order
};

// How a picture is cut into parts that are decoded on their own: tiles, or rows of some strips each.
struct TiffChunks {
  std::int32_t width = 0, height = 0;  // pixels; those of tiles may reach beyond the picture, rows end with it
  std::int32_t strip = 0;              // rows of a strip; 0: there are tiles

  bool tiled() const { return strip == 0; }
  friend bool operator==(const TiffChunks&, const TiffChunks&) = default;
};
struct TiffChunk {
  std::int32_t column = 0, row = 0;  // which, counted from the upper left
};

// One thread at a time.
class TiffFile : public SliceFile {
 public:
  // At its first page. NotFound: there is no such file. InvalidArgument: it is no TIFF.
  static Result<std::unique_ptr<TiffFile>> Open(const std::string& path);
  ~TiffFile() override;
  // The same open file at another directory; may be used beside this one. DataLoss: there is none.
  Result<std::unique_ptr<TiffFile>> At(std::uint64_t directory) const;

  // All pages from this one on, and goes to the last one. DataLoss: the chain of pages is broken.
  Result<std::vector<TiffPage>> ReadPages();
  // Which of the file's `pages` are the volume's slices, by this page, the first one. Errors of ReadOmeHeader.
  Result<PageOrder> ReadPageOrder(std::int64_t pages, const ReadOptions& options) const;

  // InvalidArgument: a palette, planes for each component, or a type that is not supported.
  Result<RawHeader> ReadHeader() override;
  Status ReadSamples(const RawHeader& header, std::byte* out) override;

  // `header`: of this directory. DataLoss: sizes that contradict each other.
  Result<TiffChunks> ReadChunks(const RawHeader& header) const;
  // Decodes a part into `out`: a whole tile, or all rows that there are. Returns the bytes that the file has for it. DataLoss.
  Result<std::uint64_t> ReadChunk(const RawHeader& header, const TiffChunks& chunks, const TiffChunk& chunk, std::span<std::byte> out);

  Status Refused(const std::string& why) const;

 private:
  struct Input;

  TiffFile(std::string path, Input input);
  Status Failed(StatusCode code, const std::string& why) const;
  Status Damaged() const;

  const std::string path_;
  const std::unique_ptr<Input> input_;            // its address is the handle's
  const std::unique_ptr<std::string> complaint_;  // its address is the handler's
  struct Close {
    void operator()(tiff* handle) const;
  };
  std::unique_ptr<tiff, Close> tiff_;
};

}  // namespace slabstream
