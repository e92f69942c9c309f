#include "worker/slab_fetcher.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"

namespace slabstream {
namespace {

std::uint32_t BytesOfChunk(const SlabKey& key, std::uint32_t chunk) {
  const std::uint64_t total = std::uint64_t(key.box.voxel_count()) * BytesPerSample(key.type);
  return std::uint32_t(std::min<std::uint64_t>(kChunkBytes, total - std::uint64_t(chunk) * kChunkBytes));
}

}  // namespace

SlabFetcher::Slab* SlabFetcher::Find(Generation slab) {
  const auto found = slabs_.find(slab);
  return found == slabs_.end() ? nullptr : &found->second;
}

const SlabFetcher::Slab* SlabFetcher::Find(Generation slab) const {
  const auto found = slabs_.find(slab);
  return found == slabs_.end() ? nullptr : &found->second;
}

SlabFetcher::Slab* SlabFetcher::FindRequested(DatasetId dataset, const Box& box, std::uint32_t chunk) {
  for (auto& [generation, slab] : slabs_) {
    if (slab.key.dataset != dataset || slab.key.box != box) continue;
    const auto request = in_flight_.find({generation, chunk});
    if (request != in_flight_.end() && !request->second.storing) return &slab;
  }
  return nullptr;
}

SlabFetcher::Generation SlabFetcher::Acquire(DatasetId dataset, const Box& box, ScalarType type, WorkerActions& actions) {
  Slab* best = nullptr;
  for (auto& [generation, slab] : slabs_) {
    if (slab.retired || slab.key.dataset != dataset || slab.key.type != type || !slab.key.box.Contains(box)) continue;
    if (best == nullptr || (slab.is_complete() && !best->is_complete())) best = &slab;
  }
  if (best == nullptr) {
    const Generation generation = ++last_generation_;
    best = &slabs_[generation];
    best->key = {dataset, box, type, generation};
    best->bytes = std::uint64_t(box.voxel_count()) * BytesPerSample(type);
    best->chunk_count = ChunkCount(box, type);
    best->missing.resize(best->chunk_count);
    for (std::uint32_t i = 0; i < best->chunk_count; ++i) best->missing[i] = best->chunk_count - 1 - i;
    best->pins = 1;
    Trim(actions);  // room first, then the new one
    actions.push_back(OpenSlab{best->key});
  } else {
    ++best->pins;
  }
  best->last_use = ++use_counter_;
  return best->key.generation;
}

void SlabFetcher::Release(Generation slab) {
  Slab* found = Find(slab);
  CHECK(found != nullptr) << "slab " << slab;
  CHECK_LT(0, found->pins);
  --found->pins;
  found->last_use = ++use_counter_;
}

bool SlabFetcher::complete(Generation slab) const {
  const Slab* found = Find(slab);
  return found != nullptr && found->is_complete();
}

SlabKey SlabFetcher::key(Generation slab) const {
  const Slab* found = Find(slab);
  CHECK(found != nullptr) << "slab " << slab;
  return found->key;
}

SlabFetcher::FetchReport SlabFetcher::TakeReport(Generation slab) {
  Slab* found = Find(slab);
  if (found == nullptr) return {};
  found->requested = false;
  return std::exchange(found->report, {});
}

void SlabFetcher::SetBytes(Generation slab, std::uint64_t bytes) {
  if (Slab* found = Find(slab)) found->bytes = std::max<std::uint64_t>(bytes, found->bytes);
}

void SlabFetcher::RequestChunks(std::span<const Generation> slabs, Epoch epoch, WorkerId worker, Time now, WorkerActions& actions) {
  for (const Generation generation : slabs) {
    Slab* slab = Find(generation);
    if (slab == nullptr || slab->retired) continue;
    while (!slab->missing.empty()) {
      const std::uint32_t chunk = slab->missing.back();
      const std::uint32_t bytes = BytesOfChunk(slab->key, chunk);
      if (!in_flight_.empty() && in_flight_bytes_ + bytes > config_.credit_bytes) return;
      slab->missing.pop_back();
      in_flight_[{generation, chunk}] = {bytes, now + config_.chunk_timeout, false};
      in_flight_bytes_ += bytes;
      if (!slab->requested) slab->report.begin = now;
      slab->requested = true;
      actions.push_back(SendChunkRequest{{epoch, worker, slab->key.dataset, slab->key.box, chunk}});
    }
  }
}

void SlabFetcher::OnChunk(const Chunk& chunk, Bytes payload, WorkerActions& actions) {
  Slab* slab = FindRequested(chunk.dataset, chunk.box, chunk.chunk);
  if (slab == nullptr) return;  // arrived before, or nobody waits for it any more
  InFlight& request = in_flight_.at({slab->key.generation, chunk.chunk});
  if (chunk.raw_bytes != request.bytes) {
    Retry(slab->key.generation, chunk.chunk,
          Status::DataLoss(fmt::format("chunk {} has {} bytes, expected {}", chunk.chunk, chunk.raw_bytes, request.bytes)));
    return;
  }
  request.storing = true;
  actions.push_back(StoreChunk{slab->key, chunk, std::move(payload)});
}

void SlabFetcher::OnRefused(const ChunkRefused& refused) {
  if (Slab* slab = FindRequested(refused.dataset, refused.box, refused.chunk)) GiveUp(*slab, refused.status);
}

void SlabFetcher::OnStored(const ChunkStored& stored, Time now) {
  const auto request = in_flight_.find({stored.slab.generation, stored.chunk});
  if (request == in_flight_.end() || !request->second.storing) return;
  if (!stored.status.ok()) {
    Retry(stored.slab.generation, stored.chunk, stored.status);
    return;
  }
  const std::uint32_t bytes = request->second.bytes;
  in_flight_bytes_ -= bytes;
  in_flight_.erase(request);
  fetched_bytes_ += bytes;
  if (Slab* slab = Find(stored.slab.generation)) {
    ++slab->stored;
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
  for (const auto& [generation, chunk] : expired) {
    const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(config_.chunk_timeout).count();
    Retry(generation, chunk, Status::Unavailable(fmt::format("chunk {} of a slab did not arrive within {} ms", chunk, waited)));
  }
}

Time SlabFetcher::NextExpiry() const {
  Time next = Time::max();
  for (const auto& [name, request] : in_flight_) {
    if (!request.storing) next = std::min(next, request.expiry);
  }
  return next;
}

void SlabFetcher::Retry(Generation generation, std::uint32_t chunk, const Status& why) {
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

// Of two slabs of which one covers the other, the smaller one is no longer needed once both are complete, or if nobody waits for it.
void SlabFetcher::RetireCovered(Slab& complete) {
  const auto covers = [](const Slab& a, const Slab& b) {
    return a.key.dataset == b.key.dataset && a.key.type == b.key.type && a.key.box.Contains(b.key.box);
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
  for (auto request = in_flight_.begin(); request != in_flight_.end();) {
    if (request->second.storing) {
      ++request;
      continue;
    }
    if (Slab* slab = Find(request->first.first)) slab->missing.push_back(request->first.second);
    in_flight_bytes_ -= request->second.bytes;
    request = in_flight_.erase(request);
  }
}

void SlabFetcher::RetireAll() {
  for (auto& [generation, slab] : slabs_) slab.retired = true;
}

void SlabFetcher::Trim(WorkerActions& actions) {
  for (auto entry = slabs_.begin(); entry != slabs_.end();) {
    const auto next = std::next(entry);
    if (entry->second.pins == 0 && entry->second.retired) Drop(entry->first, actions);
    entry = next;
  }
  while (cached_bytes() > config_.cache_bytes) {
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
  slabs_.erase(slab);
}

std::uint64_t SlabFetcher::cached_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [generation, slab] : slabs_) bytes += slab.bytes;
  return bytes;
}

}  // namespace slabstream
