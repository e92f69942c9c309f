#include "worker/slab_fetcher.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/volume/box_assembly.h"

namespace slabstream {

std::uint32_t SlabFetcher::Slab::BytesOf(const ChunkPlace& chunk) const {
  if (!IsCellChunk(chunk.chunk)) return BytesOfChunk(chunk.box, key.types, chunk.chunk);
  return cell_bytes == 0 ? kChunkBytes : BytesOfCellChunk(cell_bytes, chunk.chunk);
}

SlabFetcher::Slab* SlabFetcher::Find(Generation slab) {
  const auto found = slabs_.find(slab);
  return found == slabs_.end() ? nullptr : &found->second;
}

SlabFetcher::Slab* SlabFetcher::FindRequested(DatasetId dataset, const ChunkPlace& chunk) {
  for (auto& [generation, slab] : slabs_) {
    if (slab.key.dataset != dataset) continue;
    const auto request = in_flight_.find({generation, chunk});
    if (request != in_flight_.end() && !request->second.storing) return &slab;
  }
  return nullptr;
}

SlabFetcher::Generation SlabFetcher::Acquire(DatasetId dataset, const Box& box, const SampleTypes& types, WorkerActions& actions) {
  Slab* best = nullptr;
  for (auto& [generation, slab] : slabs_) {
    if (slab.retired || slab.key.dataset != dataset || slab.key.types != types || !slab.key.box.Contains(box)) continue;
    if (best == nullptr || (slab.is_complete() && !best->is_complete())) best = &slab;
  }
  if (best == nullptr) {
    const Generation generation = ++last_generation_;
    best = &slabs_[generation];
    best->key = {dataset, box, types, generation};
    best->bytes = best->RawBytes();
    cached_bytes_ += best->bytes;
    best->pins = 1;
    OpenSlab open = PlanSlab(*best);
    if (best->is_complete()) RetireCovered(*best);
    Trim(actions);  // room first, then the new one
    actions.push_back(std::move(open));
  } else {
    ++best->pins;
  }
  best->last_use = ++use_counter_;
  return best->key.generation;
}

// Which voxels are copied, and from where; and which chunks are missing.
OpenSlab SlabFetcher::PlanSlab(Slab& slab) {
  std::vector<Slab*> sources;
  std::vector<Box> at_hand;
  // If there is no room, everything that can be dropped must be. Cells are fetched for the whole slab.
  const bool copies = cached_bytes() <= most_cached() && !slab.key.types.layers.cells;
  for (auto& [generation, other] : slabs_) {
    if (!copies || &other == &slab || other.retired || !other.is_complete()) continue;
    if (other.key.dataset != slab.key.dataset || other.key.types != slab.key.types) continue;
    sources.push_back(&other);
    at_hand.push_back(other.key.box);
  }
  const BoxAssembly assembly = Assemble(slab.key.box, at_hand, MostMissing(slab.key.box));
  OpenSlab open{slab.key, {}};
  for (const BoxAssembly::Part& part : assembly.copied) {
    Slab& source = *sources[part.source];
    open.copies.push_back({source.key, part.box});
    ++source.pins;
    slab.sources.push_back(source.key.generation);
  }
  for (const Box& box : assembly.missing) {
    for (std::uint32_t chunk = 0; chunk < ChunkCount(box, slab.key.types); ++chunk) slab.missing.push_back({box, chunk});
  }
  if (slab.key.types.layers.cells) slab.missing.push_back({slab.key.box, kFirstCellChunk});
  std::ranges::reverse(slab.missing);
  slab.chunk_count = slab.missing.size();
  slab.begun = slab.is_complete();
  return open;
}

void SlabFetcher::Rendered(Generation slab) { Unpin(std::exchange(slabs_.at(slab).sources, {})); }

// Does not mark the sources as used: they were only copied from.
void SlabFetcher::Unpin(std::span<const Generation> sources) {
  for (const Generation source : sources) --slabs_.at(source).pins;
}

void SlabFetcher::Release(Generation slab) {
  Slab& released = slabs_.at(slab);
  CHECK_LT(0, released.pins);
  --released.pins;
  released.last_use = ++use_counter_;
}

SlabFetcher::FetchReport SlabFetcher::TakeReport(Generation slab) {
  slabs_.at(slab).requested = false;
  return std::exchange(slabs_.at(slab).report, {});
}

void SlabFetcher::SetBytes(Generation slab, std::uint64_t bytes) {
  Slab& of_slab = slabs_.at(slab);
  cached_bytes_ -= of_slab.bytes;
  of_slab.bytes = std::max(of_slab.RawBytes(), bytes);
  cached_bytes_ += of_slab.bytes;
}

// While a slab has not been rendered from, its voxels are still copied from its sources.
bool SlabFetcher::Share(Generation a, Generation b) const {
  const auto touched = [this](Generation slab) {
    std::vector<Generation> all = slabs_.at(slab).sources;
    all.push_back(slab);
    return all;
  };
  const std::vector<Generation> of_a = touched(a), of_b = touched(b);
  return std::ranges::find_first_of(of_a, of_b) != of_a.end();
}

void SlabFetcher::RequestChunks(std::span<const std::vector<Generation>> by_client, bool next_at_any_rate, Epoch epoch, WorkerId worker,
                                Time now, WorkerActions& actions) {
  const auto waits = [this](const std::vector<Generation>& slabs) {
    return std::ranges::any_of(slabs, [this](Generation slab) { return !slabs_.at(slab).missing.empty() && !slabs_.at(slab).retired; });
  };
  const auto clients = std::ranges::count_if(by_client, waits);
  if (clients == 0) return;
  std::uint64_t begun_bytes = BegunBytes();
  bool first = true;
  for (const std::vector<Generation>& slabs : by_client) {
    std::uint64_t in_flight_bytes = 0;  // of this client
    for (const auto& [name, request] : in_flight_) {
      if (std::ranges::find(slabs, name.first) != slabs.end()) in_flight_bytes += request.bytes;
    }
    bool has_credit = true;
    for (const Generation generation : slabs) {
      if (!has_credit) break;
      Slab& slab = slabs_.at(generation);
      const bool at_any_rate = std::exchange(first, false) && next_at_any_rate;
      if (!slab.begun && !at_any_rate && begun_bytes + slab.bytes > room_) return;
      if (!slab.begun) begun_bytes += slab.bytes;
      slab.begun = true;
      while (!slab.retired && !slab.missing.empty()) {
        const ChunkPlace chunk = slab.missing.back();
        const std::uint32_t bytes = slab.BytesOf(chunk);
        if (!in_flight_.empty() && in_flight_bytes_ + bytes > config_.credit_bytes) return;
        has_credit = in_flight_bytes == 0 || in_flight_bytes + bytes <= config_.credit_bytes / std::uint64_t(clients);
        if (!has_credit) break;
        slab.missing.pop_back();
        in_flight_[{generation, chunk}] = {bytes, now + config_.chunk_timeout, false};
        in_flight_bytes_ += bytes;
        in_flight_bytes += bytes;
        if (!slab.requested) slab.report.begin = now;
        slab.requested = true;
        actions.push_back(SendChunkRequest{{epoch, worker, slab.key.dataset, chunk.box, chunk.chunk}});
      }
    }
  }
}

std::uint64_t SlabFetcher::BegunBytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [generation, slab] : slabs_) bytes += slab.begun ? slab.bytes : 0;
  return bytes;
}

void SlabFetcher::OnChunk(const Chunk& chunk, Bytes payload, WorkerActions& actions) {
  const ChunkPlace place{chunk.box, chunk.chunk};
  Slab* slab = FindRequested(chunk.dataset, place);
  if (slab == nullptr) return;  // a duplicate, or nobody waits for it now
  InFlight& request = in_flight_.at({slab->key.generation, place});
  if (chunk.chunk == kFirstCellChunk) {
    SetCellBytes(*slab, chunk.cell_bytes);
    in_flight_bytes_ -= request.bytes - slab->BytesOf(place);
    request.bytes = slab->BytesOf(place);
  }
  if (chunk.raw_bytes != request.bytes || (IsCellChunk(chunk.chunk) && chunk.cell_bytes != slab->cell_bytes)) {
    Retry(slab->key.generation, place,
          Status::DataLoss(fmt::format("chunk {} has {} bytes, expected {}", chunk.chunk, chunk.raw_bytes, request.bytes)));
    return;
  }
  request.storing = true;
  actions.push_back(StoreChunk{slab->key, chunk, std::move(payload)});
}

void SlabFetcher::SetCellBytes(Slab& slab, std::uint64_t bytes) {
  const std::uint64_t before = slab.RawBytes();
  slab.cell_bytes = bytes;
  cached_bytes_ -= slab.bytes;
  slab.bytes = slab.bytes - before + slab.RawBytes();
  cached_bytes_ += slab.bytes;
}

void SlabFetcher::OnRefused(const ChunkRefused& refused) {
  if (Slab* slab = FindRequested(refused.dataset, {refused.box, refused.chunk})) GiveUp(*slab, refused.status);
}

void SlabFetcher::OnStored(const ChunkStored& stored, Time now) {
  const ChunkPlace place{stored.box, stored.chunk};
  const auto request = in_flight_.find({stored.slab.generation, place});
  if (request == in_flight_.end() || !request->second.storing) return;
  if (!stored.status.ok()) {
    Slab* slab = Find(stored.slab.generation);
    Retry(stored.slab.generation, place, stored.status);
    if (slab != nullptr && stored.status.code() == StatusCode::kResourceExhausted)
      GiveUp(*slab, stored.status);  // no room for the next copy either
    return;
  }
  const std::uint32_t bytes = request->second.bytes;
  in_flight_bytes_ -= bytes;
  in_flight_.erase(request);
  fetched_bytes_ += bytes;
  if (Slab* slab = Find(stored.slab.generation)) {
    ++slab->stored;
    if (place.chunk == kFirstCellChunk) {
      const std::uint32_t count = CellChunkCount(slab->cell_bytes);
      for (std::uint32_t i = count - 1; i > 0; --i) slab->missing.push_back({place.box, kFirstCellChunk + i});
      slab->chunk_count += count - 1;
    }
    slab->report.voxel_bytes += bytes;
    slab->report.end = now;
    if (slab->is_complete()) RetireCovered(*slab);
  }
}

void SlabFetcher::ExpireRequests(Time now) {
  std::vector<ChunkName> expired;
  for (const auto& [name, request] : in_flight_) {
    if (!request.storing && request.expiry <= now) expired.push_back(name);
  }
  const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(config_.chunk_timeout).count();
  for (const auto& [generation, chunk] : expired) {
    Retry(generation, chunk, Status::Unavailable(fmt::format("chunk {} of a slab did not arrive within {} ms", chunk.chunk, waited)));
  }
}

Time SlabFetcher::NextExpiry() const {
  Time next = Time::max();
  for (const auto& [name, request] : in_flight_) {
    if (!request.storing) next = std::min(next, request.expiry);
  }
  return next;
}

void SlabFetcher::Retry(Generation generation, const ChunkPlace& chunk, const Status& why) {
  const auto request = in_flight_.find({generation, chunk});
  in_flight_bytes_ -= request->second.bytes;
  in_flight_.erase(request);
  Slab* slab = Find(generation);
  if (slab == nullptr) return;
  slab->missing.push_back(chunk);
  if (++slab->failures[chunk] >= config_.chunk_attempts) {
    GiveUp(*slab, Status(why.code(), fmt::format("{}, {} times", why.message(), config_.chunk_attempts)));
  }
}

void SlabFetcher::GiveUp(Slab& slab, Status status) {
  if (slab.retired) return;
  slab.retired = true;
  failures_.push_back({slab.key.generation, std::move(status)});
}

// If one slab covers another, the smaller one is no longer needed once both are complete, or if nobody waits for it.
void SlabFetcher::RetireCovered(Slab& complete) {
  const auto covers = [](const Slab& a, const Slab& b) {
    return a.key.dataset == b.key.dataset && a.key.types == b.key.types && a.key.box.Contains(b.key.box);
  };
  for (auto& [generation, other] : slabs_) {
    if (&other == &complete || other.retired) continue;
    if (covers(complete, other) && (other.is_complete() || other.pins == 0)) {
      other.retired = true;
    } else if (covers(other, complete) && other.is_complete()) {
      complete.retired = true;
    }
  }
}

void SlabFetcher::ForgetRequests() {
  std::erase_if(in_flight_, [this](const auto& entry) {
    const auto& [name, request] = entry;
    if (request.storing) return false;
    if (Slab* slab = Find(name.first)) slab->missing.push_back(name.second);
    in_flight_bytes_ -= request.bytes;
    return true;
  });
}

void SlabFetcher::Trim(WorkerActions& actions) {
  for (auto next = slabs_.begin(); next != slabs_.end();) {
    const auto entry = next++;
    if (entry->second.pins == 0 && entry->second.retired) Drop(entry->first, actions);
  }
  while (cached_bytes() > most_cached()) {
    const Slab* oldest = nullptr;
    for (const auto& [generation, slab] : slabs_) {
      if (slab.pins == 0 && (oldest == nullptr || slab.last_use < oldest->last_use)) oldest = &slab;
    }
    if (oldest == nullptr) return;  // all are needed
    Drop(oldest->key.generation, actions);
  }
}

void SlabFetcher::Drop(Generation slab, WorkerActions& actions) {
  actions.push_back(DropSlab{slabs_.at(slab).key});
  Unpin(slabs_.at(slab).sources);
  cached_bytes_ -= slabs_.at(slab).bytes;
  slabs_.erase(slab);
}

}  // namespace slabstream
