// SealedMemory: memory of a process that other processes of the same host may map for reading. It has no name in any file system: it goes
// with the last process that has it open. It keeps its size, so no reader is ended by a page that is gone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "common/base/status.h"
#include "common/files/file_descriptor.h"

namespace slabstream {

// Key of the space in which process ids and their descriptors can be looked up: the running kernel and the process id namespace. Two
// processes with different keys cannot open each other's memory. 0: unknown, for instance without /proc.
std::uint64_t SharedMemoryScope();

class SealedMemory {
 public:
  // Of this process, to be written; it reads as 0 at first, and is taken where it is written. Unavailable: the system has none to give.
  static Result<SealedMemory> Create(std::size_t bytes);
  // That of another process, or of this one, for reading. NotFound: there is no such process or file. Unavailable: it may not be opened.
  // InvalidArgument: there is something else, or of another size. Never opens, reads or waits for anything else.
  static Result<SealedMemory> Open(std::uint32_t pid, std::uint32_t file_descriptor, std::size_t least_bytes, std::size_t most_bytes);
  SealedMemory(SealedMemory&& other) noexcept
      : file_(std::move(other.file_)), base_(std::exchange(other.base_, nullptr)), bytes_(other.bytes_) {}
  SealedMemory& operator=(SealedMemory&&) = delete;
  ~SealedMemory();

  std::byte* data() const { return base_; }
  std::size_t size() const { return bytes_; }
  std::uint32_t file_descriptor() const { return std::uint32_t(file_.number()); }  // of memory that was created

 private:
  SealedMemory(FileDescriptor file, void* base, std::size_t bytes)
      : file_(std::move(file)), base_(static_cast<std::byte*>(base)), bytes_(bytes) {}
  FileDescriptor file_;
  std::byte* base_;
  std::size_t bytes_;
};

// Where it is looked up, for messages.
std::string PlaceOfMemory(std::uint32_t pid, std::uint32_t file_descriptor);

}  // namespace slabstream
