#include "worker/service/stored_box.h"

#include <algorithm>
#include <string>

#include "common/base/check.h"

namespace slabstream {

StoredBox::StoredBox(const BoxKey& key, std::vector<Copy> copies, bool stored, std::vector<FilledBox> filled)
    : key_(key), stored_(stored), copies_(std::move(copies)), filled_(std::move(filled)) {
  CHECK(stored_ || filled_.empty());
}

Status StoredBox::Store(const Chunk& chunk, const Bytes& payload) {
  const std::lock_guard lock(mutex_);
  if (chunk.box.empty() || !key_.box.Contains(chunk.box) || chunk.dataset != key_.dataset)
    return Status::DataLoss("chunk of another padded box");
  if (voxels_ != nullptr) return Status::Ok();  // a duplicate after the padded box was complete
  if (IsCellChunk(chunk.chunk)) {
    return key_.types.cells ? cells_.Store(chunk, payload.span()) : Status::DataLoss("cells of a dataset that has none");
  }
  if (chunk.chunk >= ChunkCount(chunk.box, key_.types.samples) ||
      chunk.raw_bytes != PartOfChunk(chunk.box, key_.types.samples, chunk.chunk).bytes) {
    return Status::DataLoss("chunk " + std::to_string(chunk.chunk) + " of " + std::to_string(chunk.raw_bytes) +
                            " bytes does not fit a box of " + std::to_string(chunk.box.voxel_count()) + " voxels");
  }
  const ChunkPart part = PartOfChunk(chunk.box, key_.types.samples, chunk.chunk);
  unpacked_.resize(chunk.raw_bytes);
  if (Status status = UnpackChunk(chunk, payload.span(), unpacked_); !status.ok()) return status;
  Write(chunk.box, part.begin, unpacked_);
  return Status::Ok();
}

void StoredBox::Hold(std::shared_ptr<const HeldVoxels> held) {
  CHECK(!stored_);
  const std::lock_guard lock(mutex_);
  if (voxels_ == nullptr) held_ = std::move(held);
}

BrickedVoxels& StoredBox::Arriving() {
  if (!arriving_) arriving_.emplace(key_.box, key_.types.samples);
  return *arriving_;
}

PaddedVoxels& StoredBox::ArrivingStored() {
  if (!arriving_stored_) arriving_stored_ = MakePaddedVoxels(key_.box, key_.types.samples);
  return *arriving_stored_;
}

std::optional<BoxRoom> StoredBox::RoomFor(const Box& box) {
  CHECK(stored_ && key_.box.Contains(box));
  const std::lock_guard lock(mutex_);
  if (voxels_ != nullptr) return std::nullopt;
  const PaddedVoxels& voxels = ArrivingStored();
  return BoxRoom{voxels.At(box.begin), voxels.row, voxels.slice, true};
}

void StoredBox::Write(const Box& box, std::uint64_t begin, std::span<const std::byte> samples) {
  if (!stored_) return Arriving().Write(box, begin, samples);
  const PaddedVoxels& voxels = ArrivingStored();
  const std::size_t sample_bytes = BytesPerSample(voxels.type), row_bytes = std::size_t(box.size().x) * sample_bytes;
  while (!samples.empty()) {
    const std::size_t row = begin / row_bytes, within = begin % row_bytes;
    const auto y = std::int32_t(row % std::size_t(box.size().y)), z = std::int32_t(row / std::size_t(box.size().y));
    const std::span<const std::byte> part = samples.first(std::min(row_bytes - within, samples.size()));
    std::ranges::copy(part, voxels.At(box.begin + Index3{0, y, z}) + within);
    samples = samples.subspan(part.size());
    begin += part.size();
  }
}

void StoredBox::CopyFrom(const BoxVoxels& from, const Box& box) {
  const BoxVoxels::Samples samples = from.samples();  // holds them
  const VoxelBricks source = samples.view();
  const Index3 size = box.size();
  std::vector<std::byte> slice(std::size_t(size.x) * std::size_t(size.y) * BytesPerSample(source.type()));
  for (std::int32_t z = 0; z < size.z; ++z) {
    const std::uint64_t begin = std::uint64_t(z) * slice.size();
    source.Read(box, begin, slice);
    Write(box, begin, slice);
  }
}

bool StoredBox::Assemble() {
  const std::lock_guard lock(mutex_);
  if (voxels_ != nullptr) return false;
  if (held_ != nullptr) copies_ = {};
  for (const Copy& copy : copies_) CopyFrom(*copy.from->Assembled(), copy.box);
  if (held_ != nullptr) {
    voxels_ = std::make_shared<BoxVoxels>(held_->view().Part(key_.box), held_, cells_.cells());
  } else if (stored_) {
    for (const FilledBox& filled : filled_) FillBox(ArrivingStored(), filled.box, filled.sample);
    FillPadding(ArrivingStored());
    voxels_ = std::make_shared<BoxVoxels>(*std::move(arriving_stored_), cells_.cells());
  } else {
    Arriving();
    voxels_ = std::make_shared<BoxVoxels>(*std::move(arriving_), cells_.cells());
  }
  arriving_.reset();
  arriving_stored_.reset();
  filled_ = {};
  held_ = {};
  cells_ = {};
  unpacked_ = {};
  return !std::exchange(copies_, {}).empty();
}

std::shared_ptr<BoxVoxels> StoredBox::Assembled() {
  Assemble();  // a padded box may be copied from before it is rendered from
  const std::lock_guard lock(mutex_);
  return voxels_;
}

BoxData& StoredBox::DataFor(ClientId client) {
  const std::lock_guard lock(mutex_);
  auto best = derived_.end();
  for (auto each = derived_.begin(); each != derived_.end(); ++each) {
    if (each->lent) continue;
    const auto rank = [client](const Derived& derived) { return std::pair(derived.client == client, derived.last_use); };
    if (best == derived_.end() || rank(*best) < rank(*each)) best = each;
  }
  if (best == derived_.end()) best = derived_.emplace(derived_.end(), voxels_);
  best->lent = true;
  best->client = client;
  ++leases_;
  best->data.TakeVoxels();
  return best->data;
}

void StoredBox::Return(BoxData& data) {
  const std::lock_guard lock(mutex_);
  data.LeaveVoxels();
  data.SetLight(nullptr);  // they belong to the frame, and so would stay
  data.SetShapes(nullptr);
  for (Derived& each : derived_) {
    if (&each.data != &data) continue;
    each.lent = false;
    each.last_use = leases_;  // it may have lasted for many of others
    each.bytes = data.derived_bytes();
  }
  std::erase_if(derived_, [this](const Derived& each) { return !each.lent && leases_ - each.last_use >= kMostUnused; });
}

std::size_t StoredBox::bytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t total = voxels_ == nullptr ? 0 : voxels_->bytes();
  for (const Derived& each : derived_) total += each.bytes;
  return total;
}

}  // namespace slabstream
