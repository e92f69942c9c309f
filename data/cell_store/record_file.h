// RecordFile: a file of records of one size, which are appended and then read by their numbers. It keeps a digest of each block of
// kBlockRecords records, so whoever opens the file later sees whether it is what was written.
//
// Copies read the same file.
//
// Errors name the path: Unavailable (cannot be made, written or read, as where the disk is full), DataLoss (other bytes than were written,
// or fewer). One thread at a time appends, and reads what is appended; after Flush any thread reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "common/base/status.h"
#include "common/files/file_descriptor.h"

namespace slabstream {

inline constexpr std::size_t kBlockRecords = 4096;

class RecordFile {
 public:
  static Result<RecordFile> Create(const std::string& path, std::size_t record_bytes);
  // `digests`: of its blocks. All that is read is compared with them.
  static Result<RecordFile> Open(const std::string& path, std::size_t record_bytes, std::uint64_t records,
                                 std::vector<std::uint64_t> digests);

  std::uint64_t size() const { return records_; }
  Status Append(std::span<const std::byte> records);
  Status Flush();  // after the last record
  const std::vector<std::uint64_t>& digests() const { return digests_; }

  // Fills `out` with the records from `begin` on.
  Status Read(std::uint64_t begin, std::span<std::byte> out) const;
  // Those of ascending numbers.
  Status ReadSome(std::span<const std::uint32_t> numbers, std::span<std::byte> out) const;

 private:
  RecordFile(std::string path, FileDescriptor file, std::size_t record_bytes, std::uint64_t records, std::vector<std::uint64_t> digests)
      : path_(std::move(path)),
        file_(std::make_shared<const FileDescriptor>(std::move(file))),
        record_bytes_(record_bytes),
        records_(records),
        digests_(std::move(digests)) {}

  std::size_t block_bytes() const { return kBlockRecords * record_bytes_; }
  Status WriteBlock(std::span<const std::byte> block);
  // A block, or what there is of the last one.
  Status ReadBlock(std::uint64_t block, std::vector<std::byte>& out) const;

  std::string path_;
  std::shared_ptr<const FileDescriptor> file_;  // copies share it
  std::size_t record_bytes_;
  std::uint64_t records_;
  std::vector<std::uint64_t> digests_;
  std::vector<std::byte> unwritten_;  // less than a block
};

// The same of records of one type.
template <class T>
class Records {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  static Result<Records> Create(const std::string& path) { return Of(RecordFile::Create(path, sizeof(T))); }
  static Result<Records> Open(const std::string& path, std::uint64_t records, std::vector<std::uint64_t> digests) {
    return Of(RecordFile::Open(path, sizeof(T), records, std::move(digests)));
  }

  std::uint64_t size() const { return file_.size(); }
  Status Append(std::span<const T> records) { return file_.Append(std::as_bytes(records)); }
  Status Append(const T& record) { return Append(std::span(&record, 1)); }
  Status Flush() { return file_.Flush(); }
  const std::vector<std::uint64_t>& digests() const { return file_.digests(); }
  Status Read(std::uint64_t begin, std::span<T> out) const { return file_.Read(begin, std::as_writable_bytes(out)); }
  Status ReadSome(std::span<const std::uint32_t> numbers, std::span<T> out) const {
    return file_.ReadSome(numbers, std::as_writable_bytes(out));
  }

 private:
  explicit Records(RecordFile file) : file_(std::move(file)) {}
  static Result<Records> Of(Result<RecordFile> file) { return file.ok() ? Result<Records>(Records(*std::move(file))) : file.status(); }

  RecordFile file_;
};

}  // namespace slabstream
