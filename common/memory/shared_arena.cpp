#include "common/memory/shared_arena.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "common/base/check.h"
#include "common/files/file_descriptor.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kMagic = 0x534c41424152454eULL;  // "SLABAREN"

Status SystemError(StatusCode code, const char* what) {
  return {code, std::string("shared memory: ") + what + ": " + std::strerror(errno)};
}

std::uint64_t RandomNumber() {
  std::random_device device;
  const std::uint64_t number = (std::uint64_t{device()} << 32) | device();
  return number == 0 ? 1 : number;
}

std::size_t RoundedUp(std::size_t bytes) { return (bytes + kBlockAlignment - 1) / kBlockAlignment * kBlockAlignment; }

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

// ---------------------------------------------------------------- the owner

Result<std::unique_ptr<SharedArena>> SharedArena::Create() {
  FileDescriptor file(::memfd_create("slabstream", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (file.number() < 0) return SystemError(StatusCode::kUnavailable, "memfd_create");
  if (::ftruncate(file.number(), off_t(kArenaBytes)) != 0) return SystemError(StatusCode::kUnavailable, "ftruncate");
  // The file never shrinks under a reader's mapping.
  if (::fcntl(file.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
    return SystemError(StatusCode::kUnavailable, "sealing");
  }
  void* const base = ::mmap(nullptr, kArenaBytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, file.number(), 0);
  if (base == MAP_FAILED) return SystemError(StatusCode::kUnavailable, "mmap");
  (void)::madvise(base, kArenaBytes, MADV_DONTDUMP);
  return std::unique_ptr<SharedArena>(new SharedArena(file.Release(), static_cast<std::byte*>(base), RandomNumber()));
}

SharedArena::SharedArena(int file_descriptor, std::byte* base, std::uint64_t id)
    : file_descriptor_(file_descriptor),
      base_(base),
      name_{id, std::uint32_t(::getpid()), std::uint32_t(file_descriptor)},
      last_generation_(RandomNumber()) {
  header().magic = kMagic;
  header().id = id;
  free_[sizeof(ArenaHeader)] = kArenaBytes - sizeof(ArenaHeader);
  for (std::uint32_t slot = kArenaSlots; slot-- > 0;) free_slots_.push_back(slot);
}

SharedArena::~SharedArena() {
  ::munmap(base_, kArenaBytes);
  ::close(file_descriptor_);
}

void* SharedArena::Take(std::size_t bytes) {
  if (bytes > kArenaBytes || free_slots_.empty()) return nullptr;
  const std::size_t wanted = RoundedUp(bytes);
  for (auto room = free_.begin(); room != free_.end(); ++room) {
    const auto [offset, size] = *room;
    if (size < wanted) continue;
    free_.erase(room);
    if (size > wanted) free_[offset + wanted] = size - wanted;
    void* const block = base_ + offset;
    taken_[block] = {wanted, free_slots_.back(), 0};
    free_slots_.pop_back();
    Renew(block);
    return block;
  }
  return nullptr;
}

void SharedArena::Renew(void* block) {
  Block& taken = taken_.at(block);
  if (++last_generation_ == 0) ++last_generation_;
  taken.generation = last_generation_;
  header().generations[taken.slot].store(taken.generation, std::memory_order_relaxed);
  // Readers see the new generation before anything written to the block from now on, even by stores that bypass the caches.
  std::atomic_thread_fence(std::memory_order_seq_cst);
}

void SharedArena::GiveBack(void* block) {
  const auto taken = taken_.find(block);
  CHECK(taken != taken_.end()) << "a block that was not taken from here";
  header().generations[taken->second.slot].store(0, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  free_slots_.push_back(taken->second.slot);
  std::size_t offset = std::size_t(static_cast<std::byte*>(block) - base_), bytes = taken->second.bytes;
  taken_.erase(taken);
  (void)::madvise(block, bytes, MADV_REMOVE);  // if that fails the memory is merely kept
  // Join it with free neighbours.
  const auto after = free_.find(offset + bytes);
  if (after != free_.end()) {
    bytes += after->second;
    free_.erase(after);
  }
  const auto next = free_.lower_bound(offset);
  if (next != free_.begin() && std::prev(next)->first + std::prev(next)->second == offset) {
    std::prev(next)->second += bytes;
  } else {
    free_[offset] = bytes;
  }
}

BlockName SharedArena::NameOf(const void* block) const {
  const auto taken = taken_.find(block);
  CHECK(taken != taken_.end()) << "a block that was not taken from here";
  return {std::uint64_t(static_cast<const std::byte*>(block) - base_), taken->second.generation, taken->second.slot};
}

// ---------------------------------------------------------------- a reader

Result<std::shared_ptr<const MappedArena>> MappedArena::Open(const ArenaName& name) {
  const std::string path = "/proc/" + std::to_string(name.pid) + "/fd/" + std::to_string(name.file_descriptor);
  // Check before opening: opening a pipe or a device has side effects.
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) {
    return SystemError(errno == ENOENT ? StatusCode::kNotFound : StatusCode::kUnavailable, path.c_str());
  }
  if (!S_ISREG(found.st_mode) || found.st_size != off_t(kArenaBytes)) return Status::InvalidArgument("shared memory: " + path + " is none");
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) return SystemError(errno == ENOENT ? StatusCode::kNotFound : StatusCode::kUnavailable, path.c_str());
  const int seals = ::fcntl(file.number(), F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0 || ::fstat(file.number(), &found) != 0 || found.st_size != off_t(kArenaBytes)) {
    return Status::InvalidArgument("shared memory: " + path + " is none");
  }
  // One of huge pages, of which there may be none left, would end this process when it is read.
  struct statfs system {};
  if (::fstatfs(file.number(), &system) != 0 || system.f_type != TMPFS_MAGIC) {
    return Status::InvalidArgument("shared memory: " + path + " is none");
  }
  void* const base = ::mmap(nullptr, kArenaBytes, PROT_READ, MAP_SHARED | MAP_NORESERVE, file.number(), 0);
  if (base == MAP_FAILED) return SystemError(StatusCode::kUnavailable, "mmap");
  (void)::madvise(base, kArenaBytes, MADV_DONTDUMP);
  std::shared_ptr<const MappedArena> arena(new MappedArena(static_cast<const std::byte*>(base)));
  const auto* header = static_cast<const ArenaHeader*>(base);
  if (header->magic != kMagic || header->id != name.id) return Status::InvalidArgument("shared memory: " + path + " is another one");
  return arena;
}

MappedArena::~MappedArena() { ::munmap(const_cast<std::byte*>(base_), kArenaBytes); }

const std::byte* MappedArena::Find(const BlockName& block, std::uint64_t bytes) const {
  const bool fits = block.slot < kArenaSlots && block.offset >= sizeof(ArenaHeader) && block.offset % kBlockAlignment == 0 &&
                    block.offset <= kArenaBytes && bytes <= kArenaBytes - block.offset;
  return fits ? base_ + block.offset : nullptr;
}

bool MappedArena::Holds(const BlockName& block) const {
  std::atomic_thread_fence(std::memory_order_acquire);
  return block.generation != 0 && block.slot < kArenaSlots &&
         reinterpret_cast<const ArenaHeader*>(base_)->generations[block.slot].load(std::memory_order_relaxed) == block.generation;
}

}  // namespace slabstream
