#include "data/cell_store/record_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <system_error>

namespace slabstream {
namespace {

Status Failed(const std::string& path, const char* what, int error) {
  return Status::Unavailable(fmt::format("cannot {} '{}': {}", what, path, std::generic_category().message(error)));
}

}  // namespace

Result<RecordFile> RecordFile::Create(const std::string& path, std::size_t record_bytes) {
  constexpr unsigned kMode = 0600;
  ::unlink(path.c_str());  // what is there may be the file of another store, too
  FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, kMode));
  if (file.number() < 0) return Failed(path, "write", errno);
  return RecordFile(path, std::move(file), record_bytes, 0, {});
}

Result<RecordFile> RecordFile::Open(const std::string& path, std::size_t record_bytes, std::uint64_t records,
                                    std::vector<std::uint64_t> digests) {
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) return Failed(path, "read", errno);
  return RecordFile(path, std::move(file), record_bytes, records, std::move(digests));
}

Status RecordFile::WriteBlock(std::span<const std::byte> block) {
  auto at = off_t(digests_.size() * block_bytes());
  digests_.push_back(XXH3_64bits(block.data(), block.size()));
  while (!block.empty()) {
    const ssize_t count = ::pwrite(file_->number(), block.data(), block.size(), at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Failed(path_, "write", count < 0 ? errno : ENOSPC);
    block = block.subspan(std::size_t(count));
    at += count;
  }
  return Status::Ok();
}

Status RecordFile::Append(std::span<const std::byte> records) {
  records_ += records.size() / record_bytes_;
  while (!records.empty()) {
    if (unwritten_.empty() && records.size() >= block_bytes()) {
      if (Status status = WriteBlock(records.first(block_bytes())); !status.ok()) return status;
      records = records.subspan(block_bytes());
      continue;
    }
    const std::size_t count = std::min(block_bytes() - unwritten_.size(), records.size());
    unwritten_.insert(unwritten_.end(), records.begin(), records.begin() + std::ptrdiff_t(count));
    records = records.subspan(count);
    if (unwritten_.size() < block_bytes()) continue;
    if (Status status = WriteBlock(unwritten_); !status.ok()) return status;
    unwritten_.clear();
  }
  return Status::Ok();
}

Status RecordFile::Flush() {
  if (unwritten_.empty()) return Status::Ok();
  const Status status = WriteBlock(unwritten_);
  unwritten_ = {};
  return status;
}

Status RecordFile::ReadBlock(std::uint64_t block, std::vector<std::byte>& out) const {
  if (block == digests_.size()) {
    out = unwritten_;
    return Status::Ok();
  }
  const std::uint64_t first = block * kBlockRecords;
  out.resize(std::size_t(std::min<std::uint64_t>(kBlockRecords, records_ - first)) * record_bytes_);
  if (ReadBytesAt(file_->number(), first * record_bytes_, out) != out.size()) {
    if (errno != 0) return Failed(path_, "read", errno);
    return Status::DataLoss(fmt::format("'{}' is truncated at record {} of {}", path_, first, records_));
  }
  if (XXH3_64bits(out.data(), out.size()) == digests_[block]) return Status::Ok();
  return Status::DataLoss(fmt::format("'{}' is damaged: records {} to {} are not those that were written", path_, first,
                                      first + out.size() / record_bytes_ - 1));
}

Status RecordFile::Read(std::uint64_t begin, std::span<std::byte> out) const {
  std::vector<std::byte> block;
  while (!out.empty()) {
    if (Status status = ReadBlock(begin / kBlockRecords, block); !status.ok()) return status;
    const std::size_t skipped = std::size_t(begin % kBlockRecords) * record_bytes_;
    const std::span part = std::span(block).subspan(skipped, std::min(block.size() - skipped, out.size()));
    std::ranges::copy(part, out.begin());
    out = out.subspan(part.size());
    begin += part.size() / record_bytes_;
  }
  return Status::Ok();
}

Status RecordFile::ReadSome(std::span<const std::uint32_t> numbers, std::span<std::byte> out) const {
  std::vector<std::byte> block;
  std::byte* to = out.data();
  std::uint64_t at_hand = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint32_t number : numbers) {
    if (number / kBlockRecords != at_hand) {
      at_hand = number / kBlockRecords;
      if (Status status = ReadBlock(at_hand, block); !status.ok()) return status;
    }
    std::memcpy(to, block.data() + (number % kBlockRecords) * record_bytes_, record_bytes_);
    to += record_bytes_;
  }
  return Status::Ok();
}

}  // namespace slabstream
