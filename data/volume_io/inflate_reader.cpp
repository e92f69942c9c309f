#include "data/volume_io/inflate_reader.h"

#include <zlib.h>

#include <algorithm>
#include <new>

namespace slabstream {

constexpr std::size_t kBlock = std::size_t{1} << 16;  // bytes

struct InflateReader::Stream : z_stream {};

InflateReader::InflateReader(std::ifstream& file, std::int64_t offset, Wrapping wrapping)
    : file_(file), wrapping_(wrapping), input_(kBlock), stream_(std::make_unique<Stream>()) {
  file_.seekg(offset);
  constexpr int kLargestWindow = 15, kDetectHeader = 32;  // zlib's inflateInit2: tell gzip from zlib by the header; negative: no header
  const int window = wrapping == Wrapping::kNone ? -kLargestWindow : kLargestWindow + kDetectHeader;
  if (inflateInit2(stream_.get(), window) != Z_OK) throw std::bad_alloc();
}

InflateReader::~InflateReader() { inflateEnd(stream_.get()); }

std::size_t InflateReader::Read(std::span<std::byte> out) {
  std::size_t done = 0;
  while (done < out.size() && !damaged_) {
    if (stream_->avail_in == 0 && !Refill()) break;
    if (ended_ && !NextMember()) break;
    const std::size_t room = std::min(out.size() - done, std::size_t{1} << 30);  // zlib counts in 32 bits
    stream_->next_out = reinterpret_cast<Bytef*>(out.data() + done);
    stream_->avail_out = uInt(room);
    const int code = inflate(stream_.get(), Z_NO_FLUSH);
    done += room - stream_->avail_out;
    ended_ = code == Z_STREAM_END;
    damaged_ = code != Z_OK && code != Z_STREAM_END;
  }
  return done;
}

bool InflateReader::EndsWell() {
  std::vector<std::byte> rest(kBlock);
  while (!ended_ && Read(rest) == rest.size()) {
  }
  return ended_ && !damaged_;
}

bool InflateReader::Refill() {
  file_.read(input_.data(), std::streamsize(input_.size()));
  stream_->next_in = reinterpret_cast<Bytef*>(input_.data());
  stream_->avail_in = uInt(file_.gcount());
  return stream_->avail_in > 0;
}

// What follows the end of a stream is another gzip member, or padding, which is ignored.
bool InflateReader::NextMember() {
  constexpr Bytef kGzipMagic = 0x1f;
  if (wrapping_ == Wrapping::kNone || *stream_->next_in != kGzipMagic) return false;
  ended_ = false;
  return inflateReset(stream_.get()) == Z_OK;
}

}  // namespace slabstream
