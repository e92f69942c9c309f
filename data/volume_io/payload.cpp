#include "data/volume_io/payload.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace slabstream {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;  // bytes that are skipped at a time
constexpr std::size_t kStep = std::size_t{1} << 22;   // bytes of samples that are read at a time where progress is counted

Status TruncatedFile(const std::filesystem::path& file, std::int64_t expected, std::int64_t found) {
  return Status::DataLoss(
      fmt::format("{}: truncated: the header speaks of {} bytes of samples, the file has {}", file.string(), expected, found));
}

Status CheckPartHolds(const PayloadPlace& place, Compression compression, std::int64_t bytes) {
  std::error_code error;
  const auto file_bytes = std::filesystem::file_size(place.file, error);
  if (error) return Status::NotFound(place.file.string() + ": " + error.message());
  const std::int64_t data_bytes = std::max<std::int64_t>(0, std::int64_t(file_bytes) - place.offset);
  if (compression == Compression::kNone) return data_bytes >= bytes ? Status::Ok() : TruncatedFile(place.file, bytes, data_bytes);
  if (data_bytes >= (place.skip + bytes) / MaxRatio(compression)) return Status::Ok();
  return Status::DataLoss(fmt::format("{}: truncated: the header speaks of {} bytes of samples, which {} compressed bytes cannot hold",
                                      place.file.string(), bytes, data_bytes));
}

// Of `bytes` of samples those in the first file.
std::int64_t FirstBytes(const Payload& payload, std::int64_t bytes) {
  return payload.part_bytes > 0 ? std::min(bytes, payload.part_bytes - payload.passed) : bytes;
}

}  // namespace

std::vector<std::filesystem::path> Payload::FilesBeside(const std::filesystem::path& path) const {
  std::vector<std::filesystem::path> files;
  if (file != path) files.push_back(file);
  for (const PayloadPlace& next : more) files.push_back(next.file);
  return files;
}

void Payload::Pass(std::int64_t bytes) {
  if (part_bytes > 0) {
    const auto parts = std::min(std::size_t(bytes / part_bytes), more.size());
    if (parts > 0) std::tie(file, offset, skip) = std::tie(more[parts - 1].file, more[parts - 1].offset, more[parts - 1].skip);
    more.erase(more.begin(), more.begin() + std::ptrdiff_t(parts));
    bytes -= std::int64_t(parts) * part_bytes;
    passed = bytes;
  }
  Skip(bytes);
}

Status CheckHolds(const Payload& payload, std::int64_t bytes) {
  const std::int64_t first = FirstBytes(payload, bytes);
  Status status = CheckPartHolds(payload.place(), payload.compression, first);
  std::int64_t left = bytes - first;
  for (auto place = payload.more.begin(); status.ok() && left > 0 && place != payload.more.end(); ++place, left -= payload.part_bytes) {
    status = CheckPartHolds(*place, payload.compression, std::min(left, payload.part_bytes));
  }
  return status;
}

PayloadStream::PayloadStream(const Payload& payload, std::int64_t bytes) : payload_(payload), left_(bytes) {}
PayloadStream::~PayloadStream() = default;

Status PayloadStream::Truncated() const { return TruncatedFile(name_, part_bytes_, found_); }
Status PayloadStream::Damaged() const { return Status::DataLoss(name_.string() + ": the compressed samples are damaged"); }

Status PayloadStream::Open() { return OpenPart(payload_.place(), FirstBytes(payload_, left_)); }

Status PayloadStream::OpenPart(const PayloadPlace& place, std::int64_t bytes) {
  name_ = place.file;
  part_bytes_ = bytes;
  found_ = 0;
  decompressor_.reset();
  file_ = std::ifstream(place.file, std::ios::binary);
  if (!file_) return Status::NotFound(name_.string() + ": cannot be opened for reading");
  if (!payload_.compressed()) {
    file_.seekg(place.offset);
    return Status::Ok();
  }
  decompressor_ = Decompressor::Make(payload_.compression, file_, place.offset);
  std::vector<std::byte> skipped(kBlock);
  for (std::int64_t left = place.skip; left > 0;) {
    const std::size_t wanted = std::min(skipped.size(), std::size_t(left));
    if (decompressor_->Read(std::span(skipped).first(wanted)) != wanted) return decompressor_->damaged() ? Damaged() : Truncated();
    left -= std::int64_t(wanted);
  }
  return Status::Ok();
}

Status PayloadStream::Read(std::span<std::byte> out) {
  while (!out.empty()) {
    if (found_ == part_bytes_) {
      if (next_part_ == payload_.more.size()) return Truncated();
      if (Status status = Finish(); !status.ok()) return status;
      if (Status status = OpenPart(payload_.more[next_part_++], std::min(left_, payload_.part_bytes)); !status.ok()) return status;
    }
    const std::span<std::byte> part = out.first(std::min(out.size(), std::size_t(part_bytes_ - found_)));
    if (Status status = ReadPart(part); !status.ok()) return status;
    out = out.subspan(part.size());
    left_ -= std::int64_t(part.size());
  }
  return Status::Ok();
}

Status PayloadStream::ReadPart(std::span<std::byte> out) {
  std::size_t found = 0;
  if (decompressor_) {
    found = decompressor_->Read(out);
    if (decompressor_->damaged()) return Damaged();
  } else {
    file_.read(reinterpret_cast<char*>(out.data()), std::streamsize(out.size()));
    found = std::size_t(file_.gcount());
  }
  found_ += std::int64_t(found);
  return found == out.size() ? Status::Ok() : Truncated();
}

Status PayloadStream::Finish() { return !decompressor_ || decompressor_->EndsWell() ? Status::Ok() : Damaged(); }

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
