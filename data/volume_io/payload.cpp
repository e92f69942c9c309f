#include "data/volume_io/payload.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "data/volume_io/inflate_reader.h"

namespace slabstream {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;  // bytes that are skipped at a time
constexpr std::size_t kStep = std::size_t{1} << 22;   // bytes of samples that are read at a time where progress is counted

Status Truncated(const Payload& payload, std::int64_t expected, std::int64_t found) {
  return Status::DataLoss(
      fmt::format("{}: truncated: the header speaks of {} bytes of samples, the file has {}", payload.file.string(), expected, found));
}

Status Damaged(const Payload& payload) { return Status::DataLoss(payload.file.string() + ": the compressed samples are damaged"); }

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
  inflate_ = std::make_unique<InflateReader>(file_, payload_.offset,
                                             payload_.wrapped ? InflateReader::Wrapping::kGzipOrZlib : InflateReader::Wrapping::kNone);
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
