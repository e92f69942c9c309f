// SentTallies: bytes and encoding time of each rank's messages, kept until the rank's report leaves this worker.
//
// A rank may send many messages of a group, in strips or to many others. Its report goes with the last of them, or with those of another
// rank of this worker, or, from the display worker, with GroupDone. The machine sees no bytes and so counts nothing. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "common/stats/report.h"
#include "common/wire/ids.h"

namespace slabstream {

class SentTallies {
 public:
  // A message of `rank` with a payload of `bytes` was made from begin_ns to end_ns, by the clock of MonotonicNow().
  void Add(const GroupKey& key, std::uint32_t rank, std::size_t bytes, std::int64_t begin_ns, std::int64_t end_ns);

  // Moves the tallies of ranks of `key` into their reports.
  void MoveInto(const GroupKey& key, std::vector<RankReport>& reports);

  template <class Predicate>
  void Forget(Predicate over) {
    const std::lock_guard lock(mutex_);
    std::erase_if(tallies_, [&](const auto& tally) { return over(tally.first.first); });
  }

 private:
  struct Tally {
    std::uint64_t image_bytes = 0;
    std::vector<Span> encoding;
  };
  std::mutex mutex_;
  std::map<std::pair<GroupKey, std::uint32_t>, Tally> tallies_;  // by rank; guarded by mutex_
};

}  // namespace slabstream
