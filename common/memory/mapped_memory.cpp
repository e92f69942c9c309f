#include "common/memory/mapped_memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <new>

namespace slabstream {
namespace {

bool IsMapped(std::size_t bytes, std::size_t mapped_from) { return !kWatched && bytes >= mapped_from; }

}  // namespace

void* MapMemory(std::size_t bytes) {
  const bool huge = bytes >= kHugePage;
  const std::size_t mapped = bytes + (huge ? kHugePage : 0);
  void* const all = ::mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (all == MAP_FAILED) throw std::bad_alloc();
  if (!huge) return all;
  // What lies before the first huge page of the mapping goes back, and what lies behind the block's last page.
  static const auto kPage = std::size_t(::sysconf(_SC_PAGESIZE));
  auto* const begin = static_cast<std::byte*>(all);
  const std::size_t before = (kHugePage - reinterpret_cast<std::uintptr_t>(begin) % kHugePage) % kHugePage;
  const std::size_t end = before + (bytes + kPage - 1) / kPage * kPage;
  if (before > 0) ::munmap(begin, before);
  if (end < mapped) ::munmap(begin + end, mapped - end);
  (void)::madvise(begin + before, bytes, MADV_HUGEPAGE);  // without huge pages nothing changes
  return begin + before;
}

void UnmapMemory(void* block, std::size_t bytes) { ::munmap(block, bytes); }

void* TakeMemory(std::size_t bytes, std::size_t mapped_from) {
  return IsMapped(bytes, mapped_from) ? MapMemory(bytes) : ::operator new(bytes, std::align_val_t(kBufferAlignment));
}

void* TakeZeros(std::size_t bytes) {
  void* const block = TakeMemory(bytes);
  if (!IsMapped(bytes, kLargeBlock)) std::memset(block, 0, bytes);
  return block;
}

void FreeMemory(void* block, std::size_t bytes, std::size_t mapped_from) {
  if (IsMapped(bytes, mapped_from)) {
    UnmapMemory(block, bytes);
  } else {
    ::operator delete(block, std::align_val_t(kBufferAlignment));
  }
}

}  // namespace slabstream
