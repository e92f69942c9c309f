// TiffFile: an open TIFF file at one of its directories, which describes a picture: a page, or a smaller picture of one. libtiff decodes.
// Errors name the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "data/volume_io/slice_stack.h"

struct tiff;  // libtiff's

namespace slabstream {

class TiffInput;

struct TiffPage {
  std::int64_t number = 0;                  // among all directories of the file's chain, from 0
  std::uint64_t offset = 0;                 // where its directory is in the file
  std::vector<std::uint64_t> smaller = {};  // where the page's pictures at lower resolutions are, in the file's order
};

// How a picture is cut into parts that are decoded on their own: tiles, or rows of some strips each.
struct TiffChunks {
  std::int32_t width = 0, height = 0;  // pixels; those of tiles may reach beyond the picture, rows end with it
  std::int32_t strip = 0;              // rows of a strip; 0: there are tiles
  bool separate = false;               // each component has chunks of its own; else a chunk has the components of each pixel together

  bool tiled() const { return strip == 0; }
  friend bool operator==(const TiffChunks&, const TiffChunks&) = default;
};
struct TiffChunk {
  std::int32_t column = 0, row = 0;  // which, counted from the upper left
  int component = 0;                 // the component, if components have chunks of their own
  // The picture, if several follow the directory's own one without directories of theirs (CheckPlanes): 0 is its own.
  std::int64_t plane = 0;
};

// One thread at a time.
class TiffFile : public SliceFile {
 public:
  // At its first page, or at the directory with this offset. NotFound: there is no such file. InvalidArgument: it is no TIFF. DataLoss:
  // there is no such directory.
  static Result<std::unique_ptr<TiffFile>> Open(const std::string& path, std::uint64_t directory = 0);
  ~TiffFile() override;

  // All pages from this one on, and goes to the last one. DataLoss: the chain of pages is broken.
  Result<std::vector<TiffPage>> ReadPages();

  std::string Description() const;  // the text of this page, "" if there is none
  // A resolution, in pixels per unit; 0: not stated. ResolutionUnit: 0 not stated, 1 none, 2 inch, 3 cm.
  double XResolution() const;
  double YResolution() const;
  int ResolutionUnit() const;
  // Whether the file goes on to the end of the directory at `offset`, where it says whether there is another one.
  bool HoldsDirectory(std::uint64_t offset) const;
  std::uint64_t size() const;  // the file's size in bytes
  bool big_endian() const;
  // A field of this page that libtiff does not know; empty: there is none, or its type is another one. Bytes are as in the file. Lives as
  // long as the page is the open one.
  std::span<const std::byte> Bytes(unsigned tag) const;
  std::span<const std::uint32_t> Numbers(unsigned tag) const;

  // Its notes say what of the picture is not applied, such as a colour map. InvalidArgument: a compression, a kind of colours or a type
  // that is not supported.
  Result<RawHeader> ReadHeader() override;
  // Reads the plane that was set last (CheckPlanes), at first 0.
  Status ReadSamples(const RawHeader& header, std::byte* out) override;
  void SetPlane(std::int64_t plane) { plane_ = plane; }

  // Whether `count` pictures lie one behind the other, the first of them this page's. So ImageJ writes stacks above 4 GiB: with one
  // directory. InvalidArgument: they are compressed, in tiles, or not in one piece. DataLoss: the file ends before the last one.
  Status CheckPlanes(const RawHeader& header, std::int64_t count) const;

  // `header`: of this directory. DataLoss: sizes that contradict each other.
  Result<TiffChunks> ReadChunks(const RawHeader& header) const;
  // Decodes a part into `out`: a whole tile, or all rows that there are. Returns the bytes that the file has for it. DataLoss.
  Result<std::uint64_t> ReadChunk(const RawHeader& header, const TiffChunks& chunks, const TiffChunk& chunk, std::span<std::byte> out);

  Status Refused(const std::string& why) const;

 private:
  TiffFile(std::string path, TiffInput input);
  Status Failed(StatusCode code, const std::string& why) const;
  Status Damaged() const;

  unsigned Bits() const;                                                 // bits of a sample in the file
  std::size_t RowBytes(std::int64_t samples) const;                      // bytes of so many samples in the file
  Status CheckCompression() const;                                       // InvalidArgument, naming it
  Status CheckColours(int components, std::vector<std::string>& notes);  // `components` and `notes` are RawHeader's
  // The bytes of a chunk before samples are unpacked; of another plane than the directory's own.
  Result<std::uint64_t> ReadStored(const TiffChunks& chunks, const TiffChunk& chunk, std::size_t row_bytes, std::span<std::byte> out);
  Result<std::uint64_t> ReadBehind(const RawHeader& header, const TiffChunks& chunks, const TiffChunk& chunk, std::size_t row_bytes,
                                   std::span<std::byte> out) const;

  const std::string path_;
  std::int64_t plane_ = 0;
  const std::unique_ptr<TiffInput> input_;        // its address is the handle's
  const std::unique_ptr<std::string> complaint_;  // its address is the handler's
  struct Close {
    void operator()(tiff* handle) const;
  };
  std::unique_ptr<tiff, Close> tiff_;
};

}  // namespace slabstream
