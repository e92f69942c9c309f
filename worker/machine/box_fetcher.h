// BoxFetcher: the padded boxes of a worker, complete or on their way. It decides which chunks to ask for, within the byte credit, and which
// padded boxes to drop.
//
//   1. Acquire pins a padded box that covers the box; it opens one if none is cached or on its way. Voxels that complete padded boxes hold
//      are copied from them: these stay until the new padded box has been rendered from (Rendered) or is dropped. The rest is fetched, box
//      by box.
//   2. RequestChunks, in the order in which padded boxes will be needed; Chunk -> StoreChunk -> ChunkStored. A chunk that does not arrive
//      within chunk_timeout, or arrives damaged, is requested again, chunk_attempts times; then the padded box is given up (TakeFailures).
//      Of voxels that owners hold the coordinator knows whether they will come, so they are waited for until it refuses them.
//   3. complete(padded box): it can be rendered from. Release when that is done; the padded box stays cached.
// Clients that wait for voxels at the same time have equal parts of the credit.
// Trim drops unpinned padded boxes: those that a complete one covers (the same box with a smaller halo), then others as far as they exceed
// cache_bytes or the room (SetRoom). A client's frames mostly need the same padded boxes in the same order, nearest first. So if there is
// no room for all of them, those that were used last are needed again last, and go first: dropping the least recently used would leave
// none that the next frame finds. Boxes that neither this frame nor the one before it has used go before them.
// Padded boxes that are waited for begin to take memory one after the other, as far as there is room; the one that is needed next always
// does, unless others are needed at the same time (RequestChunks).
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/volume/filled_box.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

class BoxFetcher {
 public:
  using Generation = std::uint64_t;  // BoxKey::generation: names a padded box

  struct Failure {
    Generation padded = 0;
    Status status;
  };
  // What was received for a padded box since the last report.
  struct FetchReport {
    std::uint64_t voxel_bytes = 0;
    std::uint64_t stored_bytes = 0;  // Chunk::stored_bytes
    std::uint64_t sent_bytes = 0;    // payloads
    Time begin, end;                 // first request, last chunk stored; meaningful if voxel_bytes > 0
  };

  explicit BoxFetcher(const WorkerConfig& config) : config_(config) {}

  void SetRoom(std::uint64_t bytes) { room_ = bytes; }  // for all padded boxes, those in use too; without a call there is no limit

  // Whose frame needs a padded box.
  struct Use {
    ClientId client = 0;
    FrameId frame = 0;
  };

  // `stored`: where the voxels can be read (FrameSetup::stored). What is missing is then asked for block by block, without what `filled`
  // fills.
  Generation Acquire(const Use& use, DatasetId dataset, const Box& box, const SampleTypes& types, const std::optional<StoredAt>& stored,
                     const std::vector<FilledBox>& filled, WorkerActions& actions);
  void Release(Generation padded);  // once for each Acquire
  // What follows needs acquired padded boxes.
  bool complete(Generation padded) const { return boxes_.at(padded).is_complete(); }  // all that must be fetched is stored
  void Rendered(Generation padded);                                                   // the padded box now holds all its voxels itself
  BoxKey key(Generation padded) const { return boxes_.at(padded).key; }
  FetchReport TakeReport(Generation padded);
  // The padded box's memory, with what was derived from its voxels and cells; it may fall. Counts as at least the samples and cells.
  void SetBytes(Generation padded, std::uint64_t bytes);

  // Whether there is room for what another render derives from this padded box: about as much as its voxels (worker_memory.h).
  bool HasRoomBeside(Generation padded) const { return boxes_.at(padded).RawBytes() <= room_ - std::min(room_, cached_bytes_); }

  // Whether padded boxes that have begun to take memory exceed the room.
  bool TakesTooMuch() const { return BegunBytes() > room_; }

  // Requests missing chunks of these padded boxes, which each client needs in this order, within the credit (one chunk is always allowed)
  // and the room. So many of the first client's begin to take memory `at_any_rate`, even if there is no room.
  void RequestChunks(std::span<const std::vector<Generation>> by_client, std::size_t at_any_rate, Epoch epoch, WorkerId worker, Time now,
                     WorkerActions& actions);
  void OnChunk(const Chunk& chunk, Bytes payload, WorkerActions& actions);
  void OnRefused(const ChunkRefused& refused);
  void OnStored(const ChunkStored& stored, Time now);
  void ExpireRequests(Time now);
  Time NextExpiry() const;  // Time::max() if nothing is requested

  // Padded boxes given up since the last call. They are never complete; whoever acquired them must release them.
  std::vector<Failure> TakeFailures() { return std::exchange(failures_, {}); }

  void ForgetRequests();  // the coordinator is gone: requested chunks will not come
  void Trim(WorkerActions& actions);

  std::uint64_t cached_bytes() const { return cached_bytes_; }
  // Those of cached_bytes whose memory is taken by now: chunks that are stored, and what is complete.
  std::uint64_t HeldBytes() const;
  bool reads_stored() const {
    return std::ranges::any_of(boxes_, [](const auto& box) { return box.second.stored_at != nullptr; });
  }
  std::uint64_t fetched_bytes() const { return fetched_bytes_; }
  std::size_t size() const { return boxes_.size(); }
  std::size_t chunk_requests() const { return in_flight_.size(); }

 private:
  // Then samples that are made on demand are sent: in place they were dropped as often before they were read.
  static constexpr int kMostInPlace = 3;
  static constexpr std::size_t kMostRequests =
      48;  // at a time, of blocks, which may be small: a coordinator queues few more (kMaxQueuedChunks)

  struct ChunkPlace {  // a chunk of a box inside the padded box
    Box box;
    std::uint32_t chunk = 0;
    friend bool operator==(const ChunkPlace&, const ChunkPlace&) = default;
    friend auto operator<=>(const ChunkPlace&, const ChunkPlace&) = default;
  };
  struct HeldBox {
    BoxKey key;
    std::shared_ptr<const StoredAt> stored_at = nullptr;  // null: the coordinator holds the voxels
    std::vector<FilledBox> filled;                        // not read
    int pins = 0;
    bool retired = false;  // not to be acquired again; dropped when unpinned
    std::uint64_t bytes = 0;
    std::uint64_t last_use = 0;
    ClientId client = 0;              // the client that acquired it last
    std::vector<Generation> sources;  // pinned
    std::vector<ChunkPlace> missing;  // chunks neither stored nor in flight; the next one to ask for is last
    std::uint64_t cell_bytes = 0;     // bytes of the padded box's cells; 0: there are none, or no chunk of them has come yet
    std::size_t stored = 0, chunk_count = 0;
    std::map<ChunkPlace, int> failures;
    FetchReport report;
    bool requested = false;  // since the last report
    bool begun = false;      // some of it was requested or copied: it takes memory

    bool is_complete() const { return stored == chunk_count; }
    std::uint64_t RawBytes() const {  // bytes of samples and cells
      return BytesOfBox(key.box, key.types.samples) + cell_bytes;
    }
    // Whether it can stand for a padded box in which no more than `filled` need not be read.
    bool Covers(const Box& box, std::span<const FilledBox> may_be_filled) const {
      return key.box.Contains(box) && FillsNoMoreThan(filled, box, may_be_filled);
    }
    std::uint32_t BytesOf(const ChunkPlace& chunk) const;  // the most, if they are not known yet
  };
  struct InFlight {
    std::uint32_t bytes = 0;
    Time expiry;
    bool storing = false;
  };
  using ChunkName = std::pair<Generation, ChunkPlace>;
  // When a client's last two frames of a dataset began to use padded boxes, in uses (last_use).
  struct FrameUses {
    FrameId frame = 0;
    std::uint64_t begin = 0, begin_before = 0;
  };
  static constexpr std::size_t kMostUsers = 256;

  HeldBox* Find(Generation padded);  // null: dropped
  HeldBox* FindRequested(DatasetId dataset, const ChunkPlace& chunk);
  void NoteUse(const Use& use, DatasetId dataset);
  HeldBox* NextToDrop();  // null: all are pinned
  OpenBox PlanCopies(HeldBox& padded);
  std::uint64_t BegunBytes() const;
  std::uint64_t most_cached() const { return std::min(config_.cache_bytes, room_); }
  void Unpin(std::span<const Generation> sources);
  void SetCellBytes(HeldBox& padded, std::uint64_t bytes);
  // `counts`: as one of chunk_attempts.
  void Retry(Generation padded, const ChunkPlace& chunk, const Status& why, bool counts = true);
  void GiveUp(HeldBox& padded, Status status);
  void RetireCovered(HeldBox& complete);
  void Drop(Generation padded, WorkerActions& actions);

  const WorkerConfig config_;
  std::map<Generation, HeldBox> boxes_;
  std::map<ChunkName, InFlight> in_flight_;  // outlives its padded box: the credit is used until the chunk is stored or expires
  std::uint64_t in_flight_bytes_ = 0;
  std::uint64_t room_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t cached_bytes_ = 0;  // bytes of boxes_
  Generation last_generation_ = 0;
  std::uint64_t use_counter_ = 0;
  std::map<std::pair<ClientId, DatasetId>, FrameUses> users_;
  ClientId latest_client_ = 0;      // the client that acquired a padded box last
  std::uint64_t needed_since_ = 0;  // in uses: its frames may need again what was used since then
  std::uint64_t fetched_bytes_ = 0;
  std::vector<Failure> failures_;
};

}  // namespace slabstream
