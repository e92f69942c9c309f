// A deflated stream within a file, decompressed from its beginning on.
//
// One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <span>
#include <vector>

namespace slabstream {

class InflateReader {
 public:
  // What is around the deflated bytes: the header and checksum of gzip or zlib, whichever the first bytes say; or nothing.
  enum class Wrapping { kGzipOrZlib, kNone };

  // `file` is open, outlives this, and is read from `offset` on.
  InflateReader(std::ifstream& file, std::int64_t offset, Wrapping wrapping);
  ~InflateReader();

  // Returns the bytes written to `out`: fewer than its size only at the end of the stream or of the file, or if the stream is damaged.
  // Members of a gzip file that follow each other make one stream.
  std::size_t Read(std::span<std::byte> out);
  // Reads the rest of the stream; true if it is sound, checksum included. Call it when everything wanted has been read.
  bool EndsWell();

  bool damaged() const { return damaged_; }

 private:
  struct Stream;
  bool Refill();
  bool NextMember();

  std::ifstream& file_;
  const Wrapping wrapping_;
  std::vector<char> input_;
  std::unique_ptr<Stream> stream_;
  bool ended_ = false, damaged_ = false;
};

}  // namespace slabstream
