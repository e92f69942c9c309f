// Where owners are, as a source's text says it, and the memory of an owner, which may write anything into it at any time.
//
// input: u8 kind; a text, or u8 pages and what the memory begins with
#include <unistd.h>

#include "common/memory/sealed_memory.h"
#include "data/owned/owned_source.h"
#include "tests/fuzz/decoders.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kIncarnation = 7;

OwnerPlace PlaceOf(std::uint32_t file_descriptor) {
  return {SharedMemoryScope(), std::uint32_t(::getpid()), file_descriptor, kIncarnation};
}

bool DecodeText(const std::string& text) {
  const Result<OwnedField> field = OwnedField::Parse(text);
  if (!field.ok()) {
    CheckRefusal(field.status());
    return false;
  }
  CHECK(OwnedField::Parse(field->Text()).value() == *field);
  return true;
}

// What is read of any box lies in the memory, whatever the owner writes after it was opened.
bool DecodeMemory(std::size_t pages, std::span<const std::byte> begin) {
  const SealedMemory memory = SealedMemory::Create(4096 * (pages + 1)).value();
  std::copy_n(begin.begin(), std::min(begin.size(), memory.size()), memory.data());
  const Result<std::shared_ptr<const MappedOwner>> owner = MappedOwner::Open(PlaceOf(memory.file_descriptor()));
  if (!owner.ok()) {
    CheckRefusal(owner.status());
    return false;
  }
  const OwnerLayout layout = (*owner)->layout();
  CHECK(layout.Check().ok());
  bool read = layout.boxes.empty() || layout.on_demand;  // nothing is made, so nothing can be read
  for (std::size_t box = 0; box < layout.boxes.size(); ++box) {
    Box part = layout.boxes[box].held;
    for (const Axis axis : kAxes) part.begin[axis] = std::max(part.begin[axis], part.end[axis] - 8);
    std::vector<std::byte> samples(std::size_t(part.voxel_count()) * BytesPerSample(layout.samples));
    read = (*owner)->Read(box, part, 0, 1, BoxRoom::Dense(part, samples.data(), true)).ok() || read;
  }
  std::fill_n(memory.data(), memory.size(), std::byte{0xFE});
  for (std::size_t box = 0; box < layout.boxes.size(); ++box) {
    const Index3 last = layout.boxes[box].held.end - Uniform(1);
    std::array<std::byte, 8> sample;
    (void)(*owner)->Read(box, {last, last + Uniform(1)}, 0, 0xFEFEFEFEFEFEFEFE,
                         BoxRoom::Dense({last, last + Uniform(1)}, sample.data(), true));
  }
  return read;
}

}  // namespace

bool DecodeOwners(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  if (input.Take<std::uint8_t>() % 2 == 0) return DecodeText(std::string(input.Text()));
  const std::size_t pages = input.Take<std::uint8_t>();
  return DecodeMemory(pages, input.rest());
}

std::vector<FuzzBytes> OwnersSeeds() {
  std::vector<FuzzBytes> seeds;
  for (const char* const text : {"owned:rho:1f:10.10.10:@9.1.2.3,@8.4.5.6,7.8.9,", "owned:a.b-c:0:1.ff.20:"}) {
    seeds.push_back(FuzzSeed().Put(std::uint8_t{0}).Put(std::string_view(text)).bytes());
  }
  for (const SampleType type : {SampleType::kUint16, SampleType::kFloat64}) {
    OwnerLayout layout{.samples = type, .size = {6, 5, 4}};
    layout.boxes = {{.box = {{0, 0, 0}, {3, 5, 4}}, .held = {{0, 0, 0}, {4, 5, 4}}},
                    {.box = {{3, 0, 0}, {6, 5, 4}}, .held = {{2, 0, 0}, {6, 5, 4}}}};
    layout.PlaceDense();
    layout.on_demand = type == SampleType::kUint16;
    if (layout.on_demand) layout.slot_bytes = 0;
    const auto owner = OwnerMemory::Create(kIncarnation, layout).value();
    (void)owner->Begin(1);
    owner->Commit(1, 1, 0.5);
    const SealedMemory memory = SealedMemory::Open(std::uint32_t(::getpid()), owner->file_descriptor(), 4096, 1U << 20).value();
    const std::span<const std::byte> begin(memory.data(), 512);  // header and boxes
    seeds.push_back(FuzzSeed().Put(std::uint8_t{1}).Put(std::uint8_t(memory.size() / 4096 - 1)).Put(begin).bytes());
  }
  return seeds;
}

}  // namespace slabstream
