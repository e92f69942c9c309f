#include "data/volume_io/payload.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
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

}  // namespace

// Decompresses a file from an offset on. Members of a gzip file that follow each other make one stream.
class PayloadStream::InflateReader {
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

PayloadStream::PayloadStream(const Payload& payload, std::int64_t bytes) : payload_(payload), expected_(bytes) {}
PayloadStream::~PayloadStream() = default;

Status PayloadStream::Truncated() const { return slabstream::Truncated(payload_, expected_, found_); }

Status PayloadStream::Open() {
  file_.open(payload_.file, std::ios::binary);
  if (!file_) return Status::NotFound(payload_.file.string() + ": cannot be opened for reading");
  if (!payload_.compressed) {
    file_.seekg(payload_.offset);
    return Status::Ok();
  }
  inflate_ = std::make_unique<InflateReader>(file_, payload_.offset);
  std::vector<std::byte> skipped(kBlock);
  for (std::int64_t left = payload_.skip; left > 0;) {
    const std::size_t wanted = std::min(skipped.size(), std::size_t(left));
    if (inflate_->Read(std::span(skipped).first(wanted)) != wanted) return inflate_->damaged() ? Damaged(payload_) : Truncated();
    left -= std::int64_t(wanted);
  }
  return Status::Ok();
}

Status PayloadStream::Read(std::span<std::byte> out) {
  std::size_t found = 0;
  if (inflate_) {
    found = inflate_->Read(out);
    if (inflate_->damaged()) return Damaged(payload_);
  } else {
    file_.read(reinterpret_cast<char*>(out.data()), std::streamsize(out.size()));
    found = std::size_t(file_.gcount());
  }
  found_ += std::int64_t(found);
  return found == out.size() ? Status::Ok() : Truncated();
}

Status PayloadStream::Finish() { return !inflate_ || inflate_->EndsWell() ? Status::Ok() : Damaged(payload_); }

Status ReadPayload(const Payload& payload, std::span<std::byte> out, Extent extent, ReadProgress* progress) {
  PayloadStream stream(payload, std::int64_t(out.size()));
  if (Status status = stream.Open(); !status.ok()) return status;
  const std::size_t step = progress == nullptr ? std::max<std::size_t>(out.size(), 1) : kStep;
  for (std::size_t done = 0; done < out.size(); done += step) {
    const std::span<std::byte> part = out.subspan(done, std::min(step, out.size() - done));
    if (Status status = stream.Read(part); !status.ok()) return status;
    if (progress != nullptr) progress->Add(std::int64_t(part.size()));
  }
  return extent == Extent::kStart ? Status::Ok() : stream.Finish();
}

}  // namespace slabstream
