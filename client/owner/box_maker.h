// BoxMaker: makes the boxes of an owner when somebody asks for them, one at a time in the order of the first requests, and keeps what it
// has made within a budget. What several ask for meanwhile is made once.
//
// Requests and times come from any thread. A thread of its own calls the maker.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/lru_map.h"
#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/wire/voxels_structs.h"
#include "data/owned/owner_memory.h"

namespace slabstream {

// The first sample of what is held of a box, with the layout's strides. It stays until the pointer goes.
using MadeBox = std::shared_ptr<const std::byte>;
// Makes the samples of a box at a time. It may take long, but ends soon once the owner ends. An error goes to whoever asks for the box, in
// one line.
using MakeBox = std::function<Result<MadeBox>(std::size_t box, std::uint64_t time)>;

class BoxMaker {
 public:
  // A request, and its samples; no bytes: the box is made (ChunkRequest::in_place).
  struct Answer {
    ChunkRequest request;
    Result<Bytes> samples;
  };

  // Keeps at most so many bytes, least recently asked for first out, and the last box that was made in any case. `answered` is called when
  // TakeAnswers has something.
  BoxMaker(std::shared_ptr<OwnerMemory> memory, std::shared_ptr<const MappedOwner> own, std::uint64_t most_bytes, MakeBox make,
           std::function<void()> answered);
  ~BoxMaker();  // waits for a box that is being made

  // A slot has this time from now on; 0: none, and what was made for it is dropped.
  void SetTime(std::uint32_t slot, std::uint64_t time);
  // `request`: of this box; it asks for at most as many bytes as one answer may have.
  void Ask(std::size_t box, const ChunkRequest& request);
  std::vector<Answer> TakeAnswers();
  bool is_making() const;  // or is about to

 private:
  using Key = std::pair<std::uint32_t, std::size_t>;  // slot and box
  void Run();
  Result<Bytes> SamplesOf(std::size_t box, const ChunkRequest& request) const;
  void Drop(LruMap<Key, MadeBox>::Entries dropped, std::unique_lock<std::mutex>& lock);

  const std::shared_ptr<OwnerMemory> memory_;
  const std::shared_ptr<const MappedOwner> own_;  // the same memory
  const std::uint64_t most_bytes_;
  const MakeBox make_;
  const std::function<void()> answered_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::map<std::uint32_t, std::uint64_t> times_;  // by slot
  std::deque<Key> order_;                         // boxes that are asked for; the first one is being made
  std::map<Key, std::vector<ChunkRequest>> asked_;
  LruMap<Key, MadeBox> kept_;  // by bytes
  std::vector<Answer> answers_;
  bool ends_ = false;

  std::thread thread_;
};

}  // namespace slabstream
