#include "worker/machine/box_fetcher.h"

#include <fmt/format.h>

#include <string>

#include "common/base/check.h"
#include "common/volume/box_assembly.h"

namespace slabstream {
namespace {

// Cuts boxes at blocks of their source, or at several of them together, as many as one chunk brings, or at parts of one. So each piece is
// one chunk. `filled`: some parts are filled; then the blocks are those that are filled together.
std::vector<Box> InBlocks(const std::vector<Box>& boxes, const StoredAt& stored, ScalarType type, bool filled) {
  Index3 block = stored.block.end, end;
  for (const Box& box : boxes) end = Max(end, box.end);
  if (filled) block = BlocksTogether(block, end, BytesPerSample(type), kChunkBytes);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    while (2 * CountIn(block) * BytesPerSample(type) <= kChunkBytes && block[axis] < end[axis]) block[axis] *= 2;
  }
  for (const Axis axis : {Axis::kZ, Axis::kY, Axis::kX}) {
    while (CountIn(block) * BytesPerSample(type) > kChunkBytes && block[axis] > 1) block[axis] = (block[axis] + 1) / 2;
  }
  std::vector<Box> pieces;
  for (const Box& box : boxes) {
    const std::vector<Box> of_box = CutAtBlocks(box, block);
    pieces.insert(pieces.end(), of_box.begin(), of_box.end());
  }
  return pieces;
}

}  // namespace

std::uint32_t BoxFetcher::HeldBox::BytesOf(const ChunkPlace& chunk) const {
  if (!IsCellChunk(chunk.chunk)) return PartOfChunk(chunk.box, key.types.samples, chunk.chunk).bytes;
  return cell_bytes == 0 ? kChunkBytes : BytesOfCellChunk(cell_bytes, chunk.chunk);
}

BoxFetcher::HeldBox* BoxFetcher::Find(Generation padded) {
  const auto found = boxes_.find(padded);
  return found == boxes_.end() ? nullptr : &found->second;
}

BoxFetcher::HeldBox* BoxFetcher::FindRequested(DatasetId dataset, const ChunkPlace& chunk) {
  for (auto& [generation, padded] : boxes_) {
    if (padded.key.dataset != dataset) continue;
    const auto request = in_flight_.find({generation, chunk});
    if (request != in_flight_.end() && !request->second.storing) return &padded;
  }
  return nullptr;
}

void BoxFetcher::NoteUse(const Use& use, DatasetId dataset) {
  const auto [found, is_new] = users_.try_emplace({use.client, dataset}, FrameUses{use.frame, use_counter_, use_counter_});
  FrameUses& uses = found->second;
  if (uses.frame != use.frame) uses = {use.frame, use_counter_, uses.begin};
  latest_client_ = use.client;
  needed_since_ = uses.begin_before;
  if (users_.size() > kMostUsers) users_.erase(std::ranges::min_element(users_, {}, [](const auto& user) { return user.second.begin; }));
}

BoxFetcher::Generation BoxFetcher::Acquire(const Use& use, DatasetId dataset, const Box& box, const SampleTypes& types,
                                           const std::optional<StoredAt>& stored, const std::vector<FilledBox>& filled,
                                           WorkerActions& actions) {
  std::vector<FilledBox> inside;
  for (const FilledBox& part : filled) {
    if (const Box common = Intersection(part.box, box); !common.empty()) inside.push_back({common, part.sample});
  }
  NoteUse(use, dataset);
  HeldBox* best = nullptr;
  for (auto& [generation, padded] : boxes_) {
    if (padded.retired || padded.key.dataset != dataset || padded.key.types != types || !padded.Covers(box, inside)) continue;
    if (best == nullptr || (padded.is_complete() && !best->is_complete())) best = &padded;
  }
  if (best == nullptr) {
    const Generation generation = ++last_generation_;
    best = &boxes_[generation];
    best->key = {dataset, box, types, generation};
    if (stored) best->stored_at = std::make_shared<const StoredAt>(*stored);
    best->filled = std::move(inside);
    best->bytes = best->RawBytes();
    cached_bytes_ += best->bytes;
    best->pins = 1;
    OpenBox open = PlanCopies(*best);
    if (best->is_complete()) RetireCovered(*best);
    Trim(actions);  // room first, then the new one
    actions.push_back(std::move(open));
  } else {
    ++best->pins;
  }
  best->last_use = ++use_counter_;
  best->client = use.client;
  return best->key.generation;
}

// Which voxels are copied, and from where; and which chunks are missing.
OpenBox BoxFetcher::PlanCopies(HeldBox& padded) {
  std::vector<HeldBox*> sources;
  std::vector<Box> at_hand;
  // If there is no room, everything that can be dropped must be. Cells are fetched for the whole padded box.
  const bool copies = cached_bytes() <= most_cached() && !padded.key.types.cells;
  for (auto& [generation, other] : boxes_) {
    if (!copies || &other == &padded || other.retired || !other.is_complete()) continue;
    if (other.key.dataset != padded.key.dataset || other.key.types != padded.key.types) continue;
    sources.push_back(&other);
    at_hand.push_back(other.key.box);
  }
  BoxAssembly assembly = Assemble(padded.key.box, at_hand, MostMissing(padded.key.box));
  OpenBox open{padded.key, {}, padded.stored_at != nullptr, padded.filled};
  for (const BoxAssembly::Part& part : assembly.copied) {
    HeldBox& source = *sources[part.source];
    for (const Box& box : Without(Without({part.box}, source.filled), padded.filled)) open.copies.push_back({source.key, box});
    for (const FilledBox& hole : source.filled) {
      if (const Box box = Intersection(hole.box, part.box); !box.empty()) assembly.missing.push_back(box);
    }
    ++source.pins;
    padded.sources.push_back(source.key.generation);
  }
  std::vector<Box> missing = Without(std::move(assembly.missing), padded.filled);
  if (padded.stored_at != nullptr) missing = InBlocks(missing, *padded.stored_at, padded.key.types.samples, !padded.filled.empty());
  for (const Box& box : missing) {
    for (std::uint32_t chunk = 0; chunk < ChunkCount(box, padded.key.types.samples); ++chunk) padded.missing.push_back({box, chunk});
  }
  if (padded.key.types.cells) padded.missing.push_back({padded.key.box, kFirstCellChunk});
  std::ranges::reverse(padded.missing);
  padded.chunk_count = padded.missing.size();
  padded.begun = padded.is_complete();
  return open;
}

void BoxFetcher::Rendered(Generation padded) { Unpin(std::exchange(boxes_.at(padded).sources, {})); }

// Does not mark the sources as used: they were only copied from.
void BoxFetcher::Unpin(std::span<const Generation> sources) {
  for (const Generation source : sources) --boxes_.at(source).pins;
}

void BoxFetcher::Release(Generation padded) {
  HeldBox& released = boxes_.at(padded);
  CHECK_LT(0, released.pins);
  --released.pins;
  released.last_use = ++use_counter_;
}

BoxFetcher::FetchReport BoxFetcher::TakeReport(Generation padded) {
  boxes_.at(padded).requested = false;
  return std::exchange(boxes_.at(padded).report, {});
}

void BoxFetcher::SetBytes(Generation padded, std::uint64_t bytes) {
  HeldBox& of_box = boxes_.at(padded);
  cached_bytes_ -= of_box.bytes;
  of_box.bytes = std::max(of_box.RawBytes(), bytes);
  cached_bytes_ += of_box.bytes;
}

void BoxFetcher::RequestChunks(std::span<const std::vector<Generation>> by_client, std::size_t at_any_rate, Epoch epoch, WorkerId worker,
                               Time now, WorkerActions& actions) {
  const auto waits = [this](const std::vector<Generation>& boxes) {
    return std::ranges::any_of(boxes,
                               [this](Generation padded) { return !boxes_.at(padded).missing.empty() && !boxes_.at(padded).retired; });
  };
  const auto clients = std::ranges::count_if(by_client, waits);
  if (clients == 0) return;
  std::uint64_t begun_bytes = BegunBytes();
  for (const std::vector<Generation>& boxes : by_client) {
    std::uint64_t in_flight_bytes = 0, in_flight = 0;  // of this client
    for (const auto& [name, request] : in_flight_) {
      if (std::ranges::find(boxes, name.first) == boxes.end()) continue;
      in_flight_bytes += request.bytes;
      ++in_flight;
    }
    bool has_credit = true;
    for (const Generation generation : boxes) {
      if (!has_credit) break;
      HeldBox& padded = boxes_.at(generation);
      const bool now_or_never = at_any_rate > 0;
      at_any_rate -= now_or_never ? 1 : 0;
      if (!padded.begun && !now_or_never && begun_bytes + padded.bytes > room_) return;
      if (!padded.begun) begun_bytes += padded.bytes;
      padded.begun = true;
      while (!padded.retired && !padded.missing.empty()) {
        const ChunkPlace chunk = padded.missing.back();
        const std::uint32_t bytes = padded.BytesOf(chunk);
        if (!in_flight_.empty() && in_flight_bytes_ + bytes > config_.credit_bytes) return;
        if (padded.stored_at != nullptr && in_flight_.size() >= kMostRequests) return;
        has_credit = in_flight == 0 || in_flight_bytes + bytes <= config_.credit_bytes / std::uint64_t(clients);
        if (padded.stored_at != nullptr) has_credit = has_credit && in_flight <= kMostRequests / std::uint64_t(clients);
        if (!has_credit) break;
        padded.missing.pop_back();
        in_flight_[{generation, chunk}] = {bytes, now + config_.chunk_timeout, false};
        in_flight_bytes_ += bytes;
        in_flight_bytes += bytes;
        ++in_flight;
        if (!padded.requested) padded.report.begin = now;
        padded.requested = true;
        const auto failed = padded.failures.find(chunk);
        const bool in_place = padded.stored_at != nullptr && (failed == padded.failures.end() || failed->second < kMostInPlace);
        actions.push_back(
            SendChunkRequest{padded.key, {epoch, worker, padded.key.dataset, chunk.box, chunk.chunk, 0, in_place}, padded.stored_at});
      }
    }
  }
}

std::uint64_t BoxFetcher::BegunBytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [generation, padded] : boxes_) bytes += padded.begun ? padded.bytes : 0;
  return bytes;
}

std::uint64_t BoxFetcher::HeldBytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [generation, padded] : boxes_) {
    const bool whole = padded.is_complete() && padded.sources.empty();
    bytes += whole ? padded.bytes : padded.bytes * padded.stored / std::max<std::size_t>(padded.chunk_count, 1);
  }
  return bytes;
}

void BoxFetcher::OnChunk(const Chunk& chunk, Bytes payload, WorkerActions& actions) {
  const ChunkPlace place{chunk.box, chunk.chunk};
  HeldBox* padded = FindRequested(chunk.dataset, place);
  if (padded == nullptr) return;  // a duplicate, or nobody waits for it now
  InFlight& request = in_flight_.at({padded->key.generation, place});
  if (chunk.raw_bytes == 0) return Retry(padded->key.generation, place, Status::Unavailable("voxels that were made were dropped unread"));
  if (chunk.chunk == kFirstCellChunk) {
    SetCellBytes(*padded, chunk.cell_bytes);
    in_flight_bytes_ -= request.bytes - padded->BytesOf(place);
    request.bytes = padded->BytesOf(place);
  }
  if (chunk.raw_bytes != request.bytes || (IsCellChunk(chunk.chunk) && chunk.cell_bytes != padded->cell_bytes)) {
    Retry(padded->key.generation, place,
          Status::DataLoss(fmt::format("chunk {} has {} bytes, expected {}", chunk.chunk, chunk.raw_bytes, request.bytes)));
    return;
  }
  request.storing = true;
  padded->report.stored_bytes += chunk.stored_bytes;
  padded->report.sent_bytes += payload.size();
  actions.push_back(StoreChunk{padded->key, chunk, std::move(payload)});
}

void BoxFetcher::SetCellBytes(HeldBox& padded, std::uint64_t bytes) {
  const std::uint64_t before = padded.RawBytes();
  padded.cell_bytes = bytes;
  cached_bytes_ -= padded.bytes;
  padded.bytes = padded.bytes - before + padded.RawBytes();
  cached_bytes_ += padded.bytes;
}

void BoxFetcher::OnRefused(const ChunkRefused& refused) {
  if (HeldBox* padded = FindRequested(refused.dataset, {refused.box, refused.chunk})) GiveUp(*padded, refused.status);
}

void BoxFetcher::OnStored(const ChunkStored& stored, Time now) {
  const ChunkPlace place{stored.box, stored.chunk};
  const auto request = in_flight_.find({stored.padded.generation, place});
  if (request == in_flight_.end()) return;
  if (!stored.status.ok()) {
    HeldBox* padded = Find(stored.padded.generation);
    Retry(stored.padded.generation, place, stored.status);
    if (padded != nullptr && stored.status.code() == StatusCode::kResourceExhausted)
      GiveUp(*padded, stored.status);  // no room for the next copy either
    return;
  }
  const std::uint32_t bytes = request->second.bytes;
  in_flight_bytes_ -= bytes;
  in_flight_.erase(request);
  fetched_bytes_ += bytes;
  if (HeldBox* padded = Find(stored.padded.generation)) {
    ++padded->stored;
    if (place.chunk == kFirstCellChunk) {
      const std::uint32_t count = CellChunkCount(padded->cell_bytes);
      for (std::uint32_t i = count - 1; i > 0; --i) padded->missing.push_back({place.box, kFirstCellChunk + i});
      padded->chunk_count += count - 1;
    }
    padded->report.voxel_bytes += bytes;
    padded->report.stored_bytes += stored.stored_bytes;
    padded->report.end = now;
    if (padded->is_complete()) RetireCovered(*padded);
  }
}

void BoxFetcher::ExpireRequests(Time now) {
  std::vector<ChunkName> expired;
  for (const auto& [name, request] : in_flight_) {
    if (!request.storing && request.expiry <= now) expired.push_back(name);
  }
  const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(config_.chunk_timeout).count();
  for (const auto& [generation, chunk] : expired) {
    const HeldBox* const padded = Find(generation);
    const std::string from = padded == nullptr || padded->stored_at == nullptr ? "" : padded->stored_at->source + ": ";
    const bool of_owners = padded != nullptr && padded->stored_at != nullptr && NamesOwners(padded->stored_at->source);
    Retry(generation, chunk,
          Status::Unavailable(fmt::format("{}chunk {} of a padded box did not arrive within {} ms", from, chunk.chunk, waited)),
          !of_owners);
  }
}

Time BoxFetcher::NextExpiry() const {
  Time next = Time::max();
  for (const auto& [name, request] : in_flight_) {
    if (!request.storing) next = std::min(next, request.expiry);
  }
  return next;
}

void BoxFetcher::Retry(Generation generation, const ChunkPlace& chunk, const Status& why, bool counts) {
  const auto request = in_flight_.find({generation, chunk});
  in_flight_bytes_ -= request->second.bytes;
  in_flight_.erase(request);
  HeldBox* padded = Find(generation);
  if (padded == nullptr) return;
  padded->missing.push_back(chunk);
  if (counts && ++padded->failures[chunk] >= config_.chunk_attempts) {
    GiveUp(*padded, Status(why.code(), fmt::format("{}, {} times", why.message(), config_.chunk_attempts)));
  }
}

void BoxFetcher::GiveUp(HeldBox& padded, Status status) {
  if (padded.retired) return;
  padded.retired = true;
  failures_.push_back({padded.key.generation, std::move(status)});
}

// If one padded box covers another, the smaller one is no longer needed once both are complete, or if nobody waits for it.
void BoxFetcher::RetireCovered(HeldBox& complete) {
  const auto covers = [](const HeldBox& a, const HeldBox& b) {
    return a.key.dataset == b.key.dataset && a.key.types == b.key.types && a.Covers(b.key.box, b.filled);
  };
  for (auto& [generation, other] : boxes_) {
    if (&other == &complete || other.retired) continue;
    if (covers(complete, other) && (other.is_complete() || other.pins == 0)) {
      other.retired = true;
    } else if (covers(other, complete) && other.is_complete()) {
      complete.retired = true;
    }
  }
}

void BoxFetcher::ForgetRequests() {
  std::erase_if(in_flight_, [this](const auto& entry) {
    const auto& [name, request] = entry;
    if (request.storing) return false;
    if (HeldBox* padded = Find(name.first)) padded->missing.push_back(name.second);
    in_flight_bytes_ -= request.bytes;
    return true;
  });
}

void BoxFetcher::Trim(WorkerActions& actions) {
  for (auto next = boxes_.begin(); next != boxes_.end();) {
    const auto entry = next++;
    if (entry->second.pins == 0 && entry->second.retired) Drop(entry->first, actions);
  }
  while (cached_bytes() > most_cached()) {
    const HeldBox* const next = NextToDrop();
    if (next == nullptr) return;
    Drop(next->key.generation, actions);
  }
}

// First what nobody may need again, oldest first; then what the latest client has used, newest first; then what others have, oldest first.
BoxFetcher::HeldBox* BoxFetcher::NextToDrop() {
  const auto order = [this](const HeldBox& padded) {
    if (padded.last_use < needed_since_) return std::pair(0, padded.last_use);
    return padded.client == latest_client_ ? std::pair(1, use_counter_ - padded.last_use) : std::pair(2, padded.last_use);
  };
  HeldBox* next = nullptr;
  for (auto& [generation, padded] : boxes_) {
    if (padded.pins == 0 && (next == nullptr || order(padded) < order(*next))) next = &padded;
  }
  return next;
}

void BoxFetcher::Drop(Generation padded, WorkerActions& actions) {
  actions.push_back(DropBox{boxes_.at(padded).key});
  Unpin(boxes_.at(padded).sources);
  cached_bytes_ -= boxes_.at(padded).bytes;
  boxes_.erase(padded);
}

}  // namespace slabstream
