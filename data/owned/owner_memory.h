// OwnerMemory: where a process keeps the voxels of a volume that it owns, so that others of its host read them in place.
//
//   header    what is held (OwnerLayout), and for each slot its generation and time
//   boxes     one HeldBox after the other
//   arrays    for each slot and box: where its samples lie in the owner's own memory; 0: in the slot
//   slots     each has room for all boxes at one time, and begins at a page
//
// The owner writes a time into a slot while readers read another one. A slot's generation is odd while it is written and rises with each
// use. A reader copies samples and looks at the generation before and after: another one means that what it has copied may be anything.
// Samples in the owner's own memory are copied by the kernel (process_memory.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/memory/sealed_memory.h"
#include "common/volume/box.h"
#include "data/sources/volume_source.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

inline constexpr std::size_t kMostOwnedBoxes = 4096;                      // of an owner
inline constexpr std::uint32_t kMostOwnerSlots = 8;                       // at least 1
inline constexpr std::uint64_t kMostOwnerBytes = std::uint64_t{1} << 40;  // of all slots

struct HeldBox {
  Box box;   // the voxels that it owns, not empty
  Box held;  // these, and copies of its neighbours' (ghosts); inside the volume
  // Of the samples of `held` in a slot: bytes to the first one, and samples from a voxel to the next along x, y and z, each at least 1.
  std::uint64_t offset = 0;
  std::array<std::int64_t, 3> strides = {};
  friend bool operator==(const HeldBox&, const HeldBox&) = default;
};

struct OwnerLayout {
  SampleType samples = SampleType::kUint8;
  Index3 size;  // of the whole volume
  std::vector<HeldBox> boxes = {};
  std::uint32_t slots = 2;
  std::uint64_t slot_bytes = 0;

  // Gives each box a place without gaps, x fastest, one after the other.
  void PlaceDense();
  // InvalidArgument, naming the field, the value and the limit.
  Status Check() const;
  friend bool operator==(const OwnerLayout&, const OwnerLayout&) = default;
};

struct OwnerHeader;

// The owner's end. One thread writes.
class OwnerMemory {
 public:
  // Errors of OwnerLayout::Check and SealedMemory::Create. `incarnation`: random; readers name it.
  static Result<std::shared_ptr<OwnerMemory>> Create(std::uint64_t incarnation, const OwnerLayout& layout);

  ~OwnerMemory();  // arrays are not read from then on; what is in slots stays with those who have mapped it

  std::uint32_t file_descriptor() const { return memory_.file_descriptor(); }
  // The slot's samples, to be written from now on: readers of what it held notice.
  std::span<std::byte> Begin(std::uint32_t slot);
  // All of it is written; `time` is not 0. `arrays`: for each box where the first sample of what is held of it lies, if not in the slot
  // (null); or nothing. They do not change until the next Begin of the slot.
  void Commit(std::uint32_t slot, std::uint64_t time, double simulated, std::span<const std::byte* const> arrays = {});

 private:
  OwnerMemory(SealedMemory memory, const OwnerLayout& layout) : memory_(std::move(memory)), layout_(layout) {}
  OwnerHeader& header() const { return *reinterpret_cast<OwnerHeader*>(memory_.data()); }
  const SealedMemory memory_;
  const OwnerLayout layout_;
  bool has_arrays_ = false;  // has had, in any slot
};

// Where an owner's memory is.
struct OwnerPlace {
  std::uint64_t scope = 0;  // SharedMemoryScope of the owner
  std::uint32_t pid = 0, file_descriptor = 0;
  std::uint64_t incarnation = 0;
  friend auto operator<=>(const OwnerPlace&, const OwnerPlace&) = default;
};

// A reader's end. Any thread.
class MappedOwner {
 public:
  // Mapped once in a process while it is used. Errors of SealedMemory::Open; Unavailable: the owner is of another scope; InvalidArgument:
  // there is something else, or what its header says does not fit.
  static Result<std::shared_ptr<const MappedOwner>> Open(const OwnerPlace& place);

  const OwnerLayout& layout() const { return layout_; }
  // False: this time is in arrays of the owner, and the system does not let this process read them.
  bool Reaches(std::uint64_t time) const;
  // The samples of every 2^level-th voxel along each axis of `part` of what box number `box` holds, from its first voxel on. Unavailable:
  // no slot has this time any more, or as of ReadProcessMemory.
  Status Read(std::size_t box, const Box& part, int level, std::uint64_t time, const BoxRoom& out) const;

 private:
  MappedOwner(const OwnerPlace& place, SealedMemory memory, OwnerLayout layout)
      : place_(place), memory_(std::move(memory)), layout_(std::move(layout)) {}
  Status CheckProcess() const;
  const OwnerPlace place_;
  const SealedMemory memory_;
  const OwnerLayout layout_;  // as it was checked; the owner may write anything later
};

}  // namespace slabstream
