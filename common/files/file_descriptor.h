// FileDescriptor: closes what it owns.
#pragma once

#include <unistd.h>

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

}  // namespace slabstream
