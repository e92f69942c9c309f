#include "data/owned/owner_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

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
  std::array<OwnerSlot, kMostOwnerSlots> of_slots;
};

namespace {

constexpr std::uint64_t kMagic = 0x534c41424f574e52ULL;  // "SLABOWNR"
constexpr std::uint32_t kVersion = 1;
constexpr std::uint64_t kPage = 4096;
constexpr std::int64_t kMostStride = std::int64_t{1} << 40;  // so that no sum of steps within a volume overflows

static_assert(std::atomic<double>::is_always_lock_free && sizeof(OwnerHeader) == 248 && sizeof(HeldBox) == 80);

std::uint64_t InPages(std::uint64_t bytes) { return (bytes + kPage - 1) / kPage * kPage; }
std::uint64_t BeginOfSlot(std::size_t boxes, std::uint64_t slot_bytes, std::uint64_t slot) {
  return InPages(sizeof(OwnerHeader) + boxes * sizeof(HeldBox)) + slot * InPages(slot_bytes);
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
  Result<SealedMemory> memory = SealedMemory::Create(BeginOfSlot(layout.boxes.size(), layout.slot_bytes, layout.slots));
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
  std::ranges::copy(layout.boxes, reinterpret_cast<HeldBox*>(&header + 1));
  header.magic = kMagic;
  return owner;
}

std::span<std::byte> OwnerMemory::Begin(std::uint32_t slot) {
  OwnerSlot& of = header().of_slots.at(slot);
  of.generation.store(of.generation | 1, std::memory_order_relaxed);
  // Readers see that before anything that is written to the slot from now on.
  std::atomic_thread_fence(std::memory_order_seq_cst);
  return {memory_.data() + BeginOfSlot(header().boxes, slot_bytes_, slot), slot_bytes_};
}

void OwnerMemory::Commit(std::uint32_t slot, std::uint64_t time, double simulated) {
  OwnerSlot& of = header().of_slots.at(slot);
  of.time = time;
  of.simulated = simulated;
  of.generation.store((of.generation | 1) + 1, std::memory_order_seq_cst);
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
      SealedMemory::Open(place.pid, place.file_descriptor, sizeof(OwnerHeader), BeginOfSlot(kMostOwnedBoxes, kMostOwnerBytes, 1) + kPage);
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
  if (boxes > kMostOwnedBoxes || sizeof(OwnerHeader) + boxes * sizeof(HeldBox) > memory->size()) return wrong("has too many boxes");
  const auto* const first = reinterpret_cast<const HeldBox*>(&header + 1);
  layout.boxes.assign(first, first + boxes);
  if (Status status = layout.Check(); !status.ok()) return status;
  if (BeginOfSlot(boxes, layout.slot_bytes, layout.slots) > memory->size()) return wrong("is too short for its slots");
  std::shared_ptr<const MappedOwner> owner(new MappedOwner(*std::move(memory), std::move(layout)));
  mapped[place] = owner;
  return owner;
}

Status MappedOwner::Read(std::size_t box, const Box& part, std::uint64_t time, const BoxRoom& out) const {
  const HeldBox& from = layout_.boxes.at(box);
  CHECK(from.held.Contains(part)) << "voxels that the owner does not hold";
  const auto& header = *reinterpret_cast<const OwnerHeader*>(memory_.data());
  const Index3 at = part.begin - from.held.begin;
  const std::uint64_t sample = std::uint64_t(at.x) * std::uint64_t(from.strides[0]) + std::uint64_t(at.y) * std::uint64_t(from.strides[1]) +
                               std::uint64_t(at.z) * std::uint64_t(from.strides[2]);
  for (std::uint32_t slot = 0; slot < layout_.slots; ++slot) {
    const OwnerSlot& of = header.of_slots.at(slot);
    const std::uint64_t generation = of.generation.load(std::memory_order_acquire);
    if (generation % 2 != 0 || of.time != time) continue;
    const std::byte* const begin = memory_.data() + BeginOfSlot(layout_.boxes.size(), layout_.slot_bytes, slot);
    CopySamples(layout_.samples, begin + from.offset + sample * BytesPerSample(layout_.samples), from.strides, part.size(), out);
    std::atomic_thread_fence(std::memory_order_acquire);
    if (of.generation.load(std::memory_order_relaxed) == generation) return Status::Ok();
  }
  return Status::Unavailable(fmt::format("time {} is not held any more: the owner has gone on", time));
}

}  // namespace slabstream
