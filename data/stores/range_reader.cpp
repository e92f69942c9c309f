#include "data/stores/range_reader.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "common/files/file_descriptor.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {

Result<ByteSpan> BytesOfRange(const std::string& what, std::uint64_t size, const ByteRange& range, std::uint64_t most) {
  const std::uint64_t begin = range.from_end ? size - std::min(range.bytes, size) : std::min(range.begin, size);
  const std::uint64_t bytes = std::min(range.bytes, size - begin);
  if (bytes > most) return Status::ResourceExhausted(fmt::format("{}: has {} bytes, at most {} are read", what, bytes, most));
  return ByteSpan{begin, bytes};
}

Result<Bytes> ReadRange(int file, const std::string& what, const ByteRange& range, std::uint64_t most) {
  const auto failed = [&](int error) {
    return Status::Unavailable(fmt::format("{}: cannot be read: {}", what, std::generic_category().message(error)));
  };
  struct stat about {};
  if (::fstat(file, &about) != 0) return failed(errno);
  if (!S_ISREG(about.st_mode)) return Status::Unavailable(what + ": is no regular file");
  const Result<ByteSpan> span = BytesOfRange(what, std::uint64_t(about.st_size), range, most);
  if (!span.ok()) return span.status();
  UnwrittenVector<std::byte> bytes(span->bytes);
  const std::size_t read = ReadBytesAt(file, span->begin, bytes);
  if (read < bytes.size() && errno != 0) return failed(errno);
  bytes.resize(read);  // it may have become shorter
  return Bytes(std::move(bytes));
}

Status OpenFailure(const std::string& what, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR: return Status::NotFound(what + ": does not exist");
    case EXDEV:
    case ELOOP: return Status::Unavailable(what + ": a link that leads out of the folder is not followed without the option follow-links");
    default: return Status::Unavailable(fmt::format("{}: cannot be opened: {}", what, std::generic_category().message(error)));
  }
}

}  // namespace slabstream
