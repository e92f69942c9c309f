#include "common/memory/sealed_memory.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace slabstream {
namespace {

Status CannotShare(StatusCode code, const std::string& what) { return {code, "shared memory: " + what + ": " + std::strerror(errno)}; }

}  // namespace

std::uint64_t SharedMemoryScope() {
  std::ifstream boot("/proc/sys/kernel/random/boot_id");
  std::string text;
  struct stat pid_namespace {};
  if (!std::getline(boot, text) || ::stat("/proc/self/ns/pid", &pid_namespace) != 0) return 0;
  text += '/' + std::to_string(pid_namespace.st_dev) + '/' + std::to_string(pid_namespace.st_ino);
  std::uint64_t key = 0xcbf29ce484222325ULL;  // FNV-1a, 64 bits
  for (const char c : text) key = (key ^ std::uint8_t(c)) * 0x100000001b3ULL;
  return key == 0 ? 1 : key;
}

std::string PlaceOfMemory(std::uint32_t pid, std::uint32_t file_descriptor) {
  return "/proc/" + std::to_string(pid) + "/fd/" + std::to_string(file_descriptor);
}

Result<SealedMemory> SealedMemory::Create(std::size_t bytes) {
  FileDescriptor file(::memfd_create("slabstream", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (file.number() < 0) return CannotShare(StatusCode::kUnavailable, "memfd_create");
  if (::ftruncate(file.number(), off_t(bytes)) != 0) return CannotShare(StatusCode::kUnavailable, "ftruncate");
  if (::fcntl(file.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
    return CannotShare(StatusCode::kUnavailable, "sealing");
  }
  void* const base = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, file.number(), 0);
  if (base == MAP_FAILED) return CannotShare(StatusCode::kUnavailable, "mmap");
  (void)::madvise(base, bytes, MADV_DONTDUMP);
  return SealedMemory(std::move(file), base, bytes);
}

Result<SealedMemory> SealedMemory::Open(std::uint32_t pid, std::uint32_t file_descriptor, std::size_t least_bytes, std::size_t most_bytes) {
  const std::string path = PlaceOfMemory(pid, file_descriptor);
  const auto failure = [&] { return CannotShare(errno == ENOENT ? StatusCode::kNotFound : StatusCode::kUnavailable, path); };
  const auto other = [&] { return Status::InvalidArgument("shared memory: " + path + " is none"); };
  const auto fits = [&](const struct stat& found) { return found.st_size >= off_t(least_bytes) && found.st_size <= off_t(most_bytes); };
  // Check before opening: opening a pipe or a device has side effects.
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return failure();
  if (!S_ISREG(found.st_mode) || !fits(found)) return other();
  // Whoever maps what another process shares has it open for reading alone: it does not pass for that process' own.
  if (::lstat(path.c_str(), &found) != 0) return failure();
  if ((found.st_mode & S_IWUSR) == 0) return other();
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) return failure();
  const int seals = ::fcntl(file.number(), F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0 || ::fstat(file.number(), &found) != 0 || !fits(found)) return other();
  // One of huge pages, of which there may be none left, would end this process when it is read.
  struct statfs system {};
  if (::fstatfs(file.number(), &system) != 0 || system.f_type != TMPFS_MAGIC) return other();
  const auto bytes = std::size_t(found.st_size);
  void* const base = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED | MAP_NORESERVE, file.number(), 0);
  if (base == MAP_FAILED) return CannotShare(StatusCode::kUnavailable, "mmap");
  (void)::madvise(base, bytes, MADV_DONTDUMP);
  return SealedMemory(FileDescriptor(), base, bytes);
}

SealedMemory::~SealedMemory() {
  if (base_ != nullptr) ::munmap(base_, bytes_);
}

}  // namespace slabstream
