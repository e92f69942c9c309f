// FileDescriptor: closes what it owns. Reading from one.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace slabstream {

class FileDescriptor {
 public:
  explicit FileDescriptor(int number = -1) : number_(number) {}  // negative: none
  FileDescriptor(FileDescriptor&& other) noexcept : number_(other.Release()) {}
  FileDescriptor& operator=(FileDescriptor&&) = delete;
  ~FileDescriptor() {
    if (number_ >= 0) ::close(number_);
  }

  int number() const { return number_; }
  int Release() { return std::exchange(number_, -1); }

 private:
  int number_;
};

// Reads from byte `begin` on until `out` is full, the file ends or reading fails. How many bytes that were; errno is 0 unless it failed.
inline std::size_t ReadBytesAt(int file, std::uint64_t begin, std::span<std::byte> out) {
  std::size_t done = 0;
  errno = 0;
  while (done < out.size()) {
    const ssize_t count = ::pread(file, out.data() + done, out.size() - done, off_t(begin + done));
    if (count < 0 && errno == EINTR) continue;
    errno = count < 0 ? errno : 0;
    if (count <= 0) break;
    done += std::size_t(count);
  }
  return done;
}

}  // namespace slabstream
