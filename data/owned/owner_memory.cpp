#include "data/owned/owner_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <map>
#include <mutex>
#include <utility>

#include "data/owned/process_memory.h"
#include "data/owned/voxel_lattice.h"
#include "data/sources/copy_samples.h"

namespace slabstream {

struct OwnerSlot {
  std::atomic<std::uint64_t> generation;  // odd: it is being written
  std::atomic<std::uint64_t> time;        // 0: none
  std::atomic<double> simulated;
};
struct OwnerHeader {
  std::uint64_t magic, incarnation;
  std::uint32_t version, samples;
  std::array<std::int32_t, 3> size;
  std::uint32_t boxes, slots, unused;
  std::uint64_t slot_bytes;
  std::uint64_t address;  // of this header in the owner: who finds the incarnation there reads the memory of that process
  std::array<OwnerSlot, kMostOwnerSlots> of_slots;
};

namespace {

constexpr std::uint64_t kMagic = 0x534c41424f574e52ULL;  // "SLABOWNR"
constexpr std::uint32_t kVersion = 2;
constexpr std::uint64_t kPage = 4096;
constexpr std::int64_t kMostStride = std::int64_t{1} << 40;  // so that no sum of steps within a volume overflows

static_assert(std::atomic<double>::is_always_lock_free && sizeof(OwnerHeader) == 256 && sizeof(HeldBox) == 80);

std::uint64_t InPages(std::uint64_t bytes) { return (bytes + kPage - 1) / kPage * kPage; }
using ArrayAddress = std::atomic<std::uint64_t>;
std::uint64_t BytesOfHeader(std::uint64_t boxes, std::uint64_t slots) {
  return sizeof(OwnerHeader) + boxes * (sizeof(HeldBox) + slots * sizeof(ArrayAddress));
}
std::uint64_t BeginOfSlot(const OwnerLayout& layout, std::uint64_t slot) {
  return InPages(BytesOfHeader(layout.boxes.size(), layout.slots)) + slot * InPages(layout.slot_bytes);
}
ArrayAddress* ArraysOf(const SealedMemory& memory, const OwnerLayout& layout, std::uint64_t slot) {
  const std::size_t boxes = layout.boxes.size();
  return reinterpret_cast<ArrayAddress*>(memory.data() + BytesOfHeader(boxes, 0)) + slot * boxes;
}

}  // namespace

void OwnerLayout::PlaceDense() {
  slot_bytes = 0;
  for (HeldBox& each : boxes) {
    const Index3 held = each.held.size();
    each.offset = slot_bytes;
    each.strides = {1, held.x, std::int64_t{held.x} * held.y};
    slot_bytes += std::uint64_t(each.held.voxel_count()) * BytesPerSample(samples);
  }
}

Status OwnerLayout::Check() const {
  const auto wrong = [](const std::string& what) { return Status::InvalidArgument("memory of an owner: " + what); };
  if (samples > SampleType::kFloat16) return wrong(fmt::format("samples of type {}, which is none", int(samples)));
  const Index3 least = Min(size, Uniform(1)), most = Max(size, Uniform(kMaxVolumeSide));
  if (least != Uniform(1) || most != Uniform(kMaxVolumeSide)) {
    return wrong(fmt::format("size {} x {} x {}, each side must be in [1, {}]", size.x, size.y, size.z, kMaxVolumeSide));
  }
  if (boxes.size() > kMostOwnedBoxes) return wrong(fmt::format("{} boxes, limit {}", boxes.size(), kMostOwnedBoxes));
  if (slots < 1 || slots > kMostOwnerSlots) return wrong(fmt::format("{} slots, must be in [1, {}]", slots, kMostOwnerSlots));
  if (slot_bytes > kMostOwnerBytes / slots) {
    return wrong(fmt::format("{} slots of {} bytes, limit {} bytes", slots, slot_bytes, kMostOwnerBytes));
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const HeldBox& each = boxes[i];
    if (each.box.empty() || !each.held.Contains(each.box) || !Box{{}, size}.Contains(each.held)) {
      return wrong(fmt::format("box {} is empty, or not inside what is held of it, or that not inside the volume", i));
    }
    const Index3 held = each.held.size();
    std::uint64_t last = 0;  // sample, counted from the first one
    for (const Axis axis : kAxes) {
      const std::int64_t stride = each.strides[std::size_t(Number(axis))];
      if (stride < 1 || stride > kMostStride) return wrong(fmt::format("a stride of {} of box {}, limit {}", stride, i, kMostStride));
      last += std::uint64_t(held[axis] - 1) * std::uint64_t(stride);
    }
    if (const std::uint64_t bytes = (last + 1) * BytesPerSample(samples); each.offset > slot_bytes || bytes > slot_bytes - each.offset) {
      return wrong(fmt::format("box {} takes {} bytes from {} on, a slot has {}", i, bytes, each.offset, slot_bytes));
    }
  }
  return Status::Ok();
}

// ---------------------------------------------------------------- the owner

Result<std::shared_ptr<OwnerMemory>> OwnerMemory::Create(std::uint64_t incarnation, const OwnerLayout& layout) {
  if (Status status = layout.Check(); !status.ok()) return status;
  Result<SealedMemory> memory = SealedMemory::Create(BeginOfSlot(layout, layout.slots));
  if (!memory.ok()) return memory.status();
  std::shared_ptr<OwnerMemory> owner(new OwnerMemory(*std::move(memory), layout));
  OwnerHeader& header = owner->header();
  header.incarnation = incarnation;
  header.version = kVersion;
  header.samples = std::uint32_t(layout.samples);
  header.size = {layout.size.x, layout.size.y, layout.size.z};
  header.boxes = std::uint32_t(layout.boxes.size());
  header.slots = layout.slots;
  header.slot_bytes = layout.slot_bytes;
  header.address = reinterpret_cast<std::uint64_t>(&header);
  std::ranges::copy(layout.boxes, reinterpret_cast<HeldBox*>(&header + 1));
  header.magic = kMagic;
  return owner;
}

std::span<std::byte> OwnerMemory::Begin(std::uint32_t slot) {
  OwnerSlot& of = header().of_slots.at(slot);
  of.generation.store(of.generation | 1, std::memory_order_relaxed);
  // Readers see that before anything that is written to the slot from now on.
  std::atomic_thread_fence(std::memory_order_seq_cst);
  return {memory_.data() + BeginOfSlot(layout_, slot), layout_.slot_bytes};
}

void OwnerMemory::Commit(std::uint32_t slot, std::uint64_t time, double simulated, std::span<const std::byte* const> arrays) {
  CHECK(arrays.empty() || arrays.size() == layout_.boxes.size()) << "arrays for " << arrays.size() << " boxes";
  // Where Yama guards processes, readers need its consent: they are no children of this one.
  if (!arrays.empty() && !std::exchange(has_arrays_, true)) LetProcessesReadMemory();
  for (std::size_t box = 0; has_arrays_ && box < layout_.boxes.size(); ++box) {
    ArraysOf(memory_, layout_, slot)[box] = arrays.empty() ? 0 : reinterpret_cast<std::uint64_t>(arrays[box]);
  }
  OwnerSlot& of = header().of_slots.at(slot);
  of.time = time;
  of.simulated = simulated;
  of.generation.store((of.generation | 1) + 1, std::memory_order_seq_cst);
}

OwnerMemory::~OwnerMemory() {
  for (std::uint32_t slot = 0; has_arrays_ && slot < layout_.slots; ++slot) (void)Begin(slot);
}

// ---------------------------------------------------------------- a reader

Result<std::shared_ptr<const MappedOwner>> MappedOwner::Open(const OwnerPlace& place) {
  static std::mutex mutex;
  static std::map<OwnerPlace, std::weak_ptr<const MappedOwner>> mapped;
  static const std::uint64_t scope = SharedMemoryScope();
  if (place.scope == 0 || place.scope != scope) return Status::Unavailable("the owner is not on this host");
  const std::lock_guard lock(mutex);
  std::erase_if(mapped, [](const auto& each) { return each.second.expired(); });
  if (const auto known = mapped.find(place); known != mapped.end()) {
    if (auto owner = known->second.lock()) return owner;
  }
  Result<SealedMemory> memory =
      SealedMemory::Open(place.pid, place.file_descriptor, sizeof(OwnerHeader),
                         BytesOfHeader(kMostOwnedBoxes, kMostOwnerSlots) + kMostOwnerBytes + (1 + kMostOwnerSlots) * kPage);
  if (!memory.ok()) return memory.status();
  const auto& header = *reinterpret_cast<const OwnerHeader*>(memory->data());
  const auto wrong = [&](const char* what) {
    return Status::InvalidArgument(fmt::format("shared memory: {} {}", PlaceOfMemory(place.pid, place.file_descriptor), what));
  };
  if (header.magic != kMagic || header.version != kVersion || header.incarnation != place.incarnation) return wrong("is another one");
  OwnerLayout layout{.samples = SampleType(std::min(header.samples, 255U)),
                     .size = {header.size[0], header.size[1], header.size[2]},
                     .slots = header.slots,
                     .slot_bytes = header.slot_bytes};
  const std::uint64_t boxes = header.boxes;
  if (boxes > kMostOwnedBoxes || BytesOfHeader(boxes, 0) > memory->size()) return wrong("has too many boxes");
  const auto* const first = reinterpret_cast<const HeldBox*>(&header + 1);
  layout.boxes.assign(first, first + boxes);
  if (Status status = layout.Check(); !status.ok()) return status;
  if (BeginOfSlot(layout, layout.slots) > memory->size()) return wrong("is too short for its slots");
  std::shared_ptr<const MappedOwner> owner(new MappedOwner(place, *std::move(memory), std::move(layout)));
  mapped[place] = owner;
  return owner;
}

Status MappedOwner::CheckProcess() const {
  const auto& header = *reinterpret_cast<const OwnerHeader*>(memory_.data());
  std::uint64_t found = 0;
  Status read =
      ReadProcessMemory(place_.pid, header.address + offsetof(OwnerHeader, incarnation), std::as_writable_bytes(std::span(&found, 1)));
  if (!read.ok() || found == place_.incarnation) return read;
  return Status::Unavailable(fmt::format("process {} is another one", place_.pid));
}

bool MappedOwner::Reaches(std::uint64_t time) const {
  const auto& header = *reinterpret_cast<const OwnerHeader*>(memory_.data());
  for (std::uint32_t slot = 0; slot < layout_.slots; ++slot) {
    if (header.of_slots.at(slot).time != time) continue;
    const ArrayAddress* const arrays = ArraysOf(memory_, layout_, slot);
    if (std::any_of(arrays, arrays + layout_.boxes.size(), [](const ArrayAddress& each) { return each != 0; })) return CheckProcess().ok();
  }
  return true;
}

Status MappedOwner::Read(std::size_t box, const Box& part, int level, std::uint64_t time, const BoxRoom& out) const {
  const HeldBox& from = layout_.boxes.at(box);
  CHECK(from.held.Contains(part)) << "voxels that the owner does not hold";
  const auto& header = *reinterpret_cast<const OwnerHeader*>(memory_.data());
  const Index3 at = part.begin - from.held.begin;
  const std::uint64_t sample = std::uint64_t(at.x) * std::uint64_t(from.strides[0]) + std::uint64_t(at.y) * std::uint64_t(from.strides[1]) +
                               std::uint64_t(at.z) * std::uint64_t(from.strides[2]);
  const std::uint64_t skipped = sample * BytesPerSample(layout_.samples);
  const Index3 count = PointsAlong(part.size(), level);
  std::array<std::int64_t, 3> strides = from.strides;
  for (std::int64_t& stride : strides) stride <<= level;
  Status copied;
  for (std::uint32_t slot = 0; slot < layout_.slots; ++slot) {
    const OwnerSlot& of = header.of_slots.at(slot);
    const std::uint64_t generation = of.generation.load(std::memory_order_acquire);
    if (generation % 2 != 0 || of.time != time) continue;
    if (const std::uint64_t array = ArraysOf(memory_, layout_, slot)[box]; array != 0) {
      copied = CopyProcessSamples(place_.pid, layout_.samples, array + skipped, strides, count, out);
      // Afterwards: a process that is still there was there all the time, so that no other one had its id.
      if (copied.ok()) copied = CheckProcess();
    } else {
      const std::byte* const begin = memory_.data() + BeginOfSlot(layout_, slot);
      CopySamples(layout_.samples, begin + from.offset + skipped, strides, count, out);
    }
    std::atomic_thread_fence(std::memory_order_acquire);
    if (of.generation.load(std::memory_order_relaxed) == generation) return copied;
  }
  return Status::Unavailable(fmt::format("time {} is not held any more: the owner has gone on", time));
}

}  // namespace slabstream
