#include "data/volume_io/payload.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <new>
#include <vector>

namespace slabstream {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;  // bytes
constexpr std::size_t kStep = std::size_t{1} << 22;   // bytes of samples that are read at a time where progress is counted

Status Truncated(const Payload& payload, std::int64_t expected, std::int64_t found) {
  return Status::DataLoss(
      fmt::format("{}: truncated: the header speaks of {} bytes of samples, the file has {}", payload.file.string(), expected, found));
}

Status Damaged(const Payload& payload) { return Status::DataLoss(payload.file.string() + ": the compressed samples are damaged"); }

// Decompresses a file from an offset on. Members of a gzip file that follow each other make one stream.
class InflateReader {
 public:
  InflateReader(std::ifstream& file, std::int64_t offset) : file_(file), input_(kBlock) {
    file_.seekg(offset);
    constexpr int kLargestWindow = 15, kDetectHeader = 32;  // zlib's inflateInit2: tell gzip from zlib by the header
    if (inflateInit2(&stream_, kLargestWindow + kDetectHeader) != Z_OK) throw std::bad_alloc();
  }
  ~InflateReader() { inflateEnd(&stream_); }
  InflateReader(const InflateReader&) = delete;
  InflateReader& operator=(const InflateReader&) = delete;

  // Returns the bytes written to `out`: fewer than its size only at the end of the stream or of the file, or if the stream is damaged.
  std::size_t Read(std::span<std::byte> out) {
    std::size_t done = 0;
    while (done < out.size() && !damaged_) {
      if (stream_.avail_in == 0 && !Refill()) break;
      if (ended_ && !NextMember()) break;
      const std::size_t room = std::min(out.size() - done, std::size_t{1} << 30);  // zlib counts in 32 bits
      stream_.next_out = reinterpret_cast<Bytef*>(out.data() + done);
      stream_.avail_out = uInt(room);
      const int code = inflate(&stream_, Z_NO_FLUSH);
      done += room - stream_.avail_out;
      ended_ = code == Z_STREAM_END;
      damaged_ = code != Z_OK && code != Z_STREAM_END;
    }
    return done;
  }

  // Reads the rest of the stream; true if it is sound, checksum included. Call it when everything wanted has been read.
  bool EndsWell() {
    std::vector<std::byte> rest(kBlock);
    while (!ended_ && Read(rest) == rest.size()) {
    }
    return ended_ && !damaged_;
  }

  bool damaged() const { return damaged_; }

 private:
  bool Refill() {
    file_.read(input_.data(), std::streamsize(input_.size()));
    stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
    stream_.avail_in = uInt(file_.gcount());
    return stream_.avail_in > 0;
  }
  // What follows the end of a stream is another gzip member, or padding, which is ignored.
  bool NextMember() {
    constexpr Bytef kGzipMagic = 0x1f;
    if (*stream_.next_in != kGzipMagic) return false;
    ended_ = false;
    return inflateReset(&stream_) == Z_OK;
  }

  std::ifstream& file_;
  std::vector<char> input_;
  z_stream stream_{};
  bool ended_ = false, damaged_ = false;
};

// Reads `out` by `read`, which returns how many bytes there were. Returns how many there were in all.
template <class Read>
std::size_t ReadInSteps(std::span<std::byte> out, ReadProgress* progress, Read read) {
  if (progress == nullptr) return read(out);
  std::size_t done = 0;
  while (done < out.size()) {
    const std::span<std::byte> step = out.subspan(done, std::min(kStep, out.size() - done));
    const std::size_t found = read(step);
    done += found;
    progress->Add(std::int64_t(found));
    if (found < step.size()) break;
  }
  return done;
}

Status ReadCompressed(const Payload& payload, std::ifstream& file, std::span<std::byte> out, Extent extent, ReadProgress* progress) {
  InflateReader reader(file, payload.offset);
  std::vector<std::byte> skipped(kBlock);
  for (std::int64_t left = payload.skip; left > 0;) {
    const std::size_t wanted = std::min(skipped.size(), std::size_t(left));
    if (reader.Read(std::span(skipped).first(wanted)) != wanted) {
      return reader.damaged() ? Damaged(payload) : Truncated(payload, std::int64_t(out.size()), 0);
    }
    left -= std::int64_t(wanted);
  }
  const std::size_t found = ReadInSteps(out, progress, [&](std::span<std::byte> step) { return reader.Read(step); });
  if (reader.damaged()) return Damaged(payload);
  if (found != out.size()) return Truncated(payload, std::int64_t(out.size()), std::int64_t(found));
  return extent == Extent::kStart || reader.EndsWell() ? Status::Ok() : Damaged(payload);
}

}  // namespace

bool BeginsLikeGzip(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return file.get() == 0x1f && file.get() == 0x8b;
}

Status CheckHolds(const Payload& payload, std::int64_t bytes) {
  std::error_code error;
  const auto file_bytes = std::filesystem::file_size(payload.file, error);
  if (error) return Status::NotFound(payload.file.string() + ": " + error.message());
  const std::int64_t data_bytes = std::max<std::int64_t>(0, std::int64_t(file_bytes) - payload.offset);
  if (!payload.compressed) return data_bytes >= bytes ? Status::Ok() : Truncated(payload, bytes, data_bytes);
  if (data_bytes >= (payload.skip + bytes) / kMaxDeflateRatio) return Status::Ok();
  return Status::DataLoss(fmt::format("{}: truncated: the header speaks of {} bytes of samples, which {} compressed bytes cannot hold",
                                      payload.file.string(), bytes, data_bytes));
}

Status ReadPayload(const Payload& payload, std::span<std::byte> out, Extent extent, ReadProgress* progress) {
  std::ifstream file(payload.file, std::ios::binary);
  if (!file) return Status::NotFound(payload.file.string() + ": cannot be opened for reading");
  if (payload.compressed) return ReadCompressed(payload, file, out, extent, progress);
  file.seekg(payload.offset);
  const std::size_t found = ReadInSteps(out, progress, [&](std::span<std::byte> step) {
    file.read(reinterpret_cast<char*>(step.data()), std::streamsize(step.size()));
    return std::size_t(file.gcount());
  });
  return found == out.size() ? Status::Ok() : Truncated(payload, std::int64_t(out.size()), std::int64_t(found));
}

}  // namespace slabstream
