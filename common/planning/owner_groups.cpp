#include "common/planning/owner_groups.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/planning/layout.h"

namespace slabstream {
namespace {

class Grouper {
 public:
  explicit Grouper(const OwnerGroupsRequest& request)
      : request_(request), behind_begin_(request.slots.size() + 1), waits_(request.slots.size()), looks_(request.slots.size()) {
    for (const std::uint32_t slot : request.slots) {
      if (slot != kNoSlot) slots_ = std::max<std::size_t>(slots_, slot + std::size_t{1});
    }
    left_ = std::size_t(std::ranges::count_if(request.slots, [](std::uint32_t slot) { return slot != kNoSlot; }));
    ready_.resize(slots_);
    FindWhatIsBehind();
    for (BoxId box = 0; box < waits_.size(); ++box) {
      if (waits_[box] == 0) Free(box);
    }
    PassOn();
  }

  std::vector<std::vector<BoxId>> Group() {
    std::vector<std::vector<BoxId>> groups;
    while (left_ > 0) {
      std::vector<BoxId>& group = groups.emplace_back();
      open_.assign(slots_, true);
      while (const std::optional<std::uint32_t> slot = Next()) {
        open_[*slot] = false;
        TakeRun(*slot, group);
      }
      CHECK(!group.empty()) << "boxes lie in front of each other in a circle";
    }
    return groups;
  }

 private:
  void FindWhatIsBehind() {
    const std::span<const Box> boxes = request_.partition->boxes();
    std::vector<std::pair<BoxId, BoxId>> passages;  // out of the first, into the second
    for (const auto& [first, second] : request_.touching) {
      const Passage passage = PassageBetween(boxes[first], boxes[second], *request_.camera, *request_.stretch);
      if (passage == Passage::kFromFirst) passages.emplace_back(first, second);
      if (passage == Passage::kFromSecond) passages.emplace_back(second, first);
    }
    for (const auto& [front, back] : passages) ++behind_begin_[front + 1];
    for (std::size_t box = 0; box < waits_.size(); ++box) behind_begin_[box + 1] += behind_begin_[box];
    behind_.resize(passages.size());
    std::vector<std::uint32_t> next(behind_begin_.begin(), behind_begin_.end() - 1);
    for (const auto& [front, back] : passages) {
      behind_[next[front]++] = back;
      ++waits_[back];
    }
  }
  std::span<const BoxId> Behind(BoxId box) const {
    return std::span(behind_).subspan(behind_begin_[box], behind_begin_[box + 1] - behind_begin_[box]);
  }

  // Nothing is in front of the box any more.
  void Free(BoxId box) {
    const std::uint32_t slot = request_.slots[box];
    (slot == kNoSlot ? passed_ : ready_[slot]).push_back(box);
  }
  // Boxes that have been passed are in front of nothing.
  void PassOn() {
    while (!passed_.empty()) {
      const BoxId box = passed_.back();
      passed_.pop_back();
      for (const BoxId back : Behind(box)) {
        if (--waits_[back] == 0) Free(back);
      }
    }
  }

  void TakeRun(std::uint32_t slot, std::vector<BoxId>& group) {
    std::vector<BoxId>& ready = ready_[slot];
    std::uint64_t bytes = 0;
    std::size_t taken = 0;
    for (; taken < ready.size(); ++taken) {  // it grows meanwhile
      const BoxId box = ready[taken];
      if (!request_.bytes.empty()) {
        if (taken > 0 && bytes + request_.bytes[box] > request_.most_bytes) break;
        bytes += request_.bytes[box];
      }
      group.push_back(box);
      --left_;
      passed_.push_back(box);
      PassOn();
    }
    ready.erase(ready.begin(), ready.begin() + std::ptrdiff_t(taken));
  }

  // A slot without a run that can take a box; nothing: the group is complete.
  std::optional<std::uint32_t> Next() {
    std::vector<std::uint32_t> candidates;
    for (std::uint32_t slot = 0; slot < slots_; ++slot) {
      if (open_[slot] && !ready_[slot].empty()) candidates.push_back(slot);
    }
    if (candidates.empty()) return std::nullopt;
    if (candidates.size() == 1) return candidates.front();
    std::vector<std::size_t> most(slots_), now(slots_);
    Look(
        candidates, [&](std::uint32_t slot) { return bool(open_[slot]); }, most);
    std::uint32_t best = candidates.front();
    std::size_t least_loss = std::numeric_limits<std::size_t>::max();
    for (const std::uint32_t slot : candidates) {
      Look(
          {&slot, 1}, [&](std::uint32_t other) { return other == slot; }, now);
      const std::size_t loss = most[slot] - now[slot];
      if (loss >= least_loss) continue;
      best = slot;
      least_loss = loss;
      if (loss == 0) break;
    }
    return best;
  }

  // How many boxes each slot could take if those that `may` took theirs as often as they like, from the ready ones of `begin` on.
  template <class May>
  void Look(std::span<const std::uint32_t> begin, May&& may, std::vector<std::size_t>& counts) {
    ++look_;
    looking_.clear();
    for (const std::uint32_t slot : begin) {
      counts[slot] = 0;
      looking_.insert(looking_.end(), ready_[slot].begin(), ready_[slot].end());
    }
    while (!looking_.empty()) {
      const BoxId box = looking_.back();
      looking_.pop_back();
      if (request_.slots[box] != kNoSlot) ++counts[request_.slots[box]];
      for (const BoxId back : Behind(box)) {
        if (looks_[back].look != look_) looks_[back] = {look_, waits_[back]};
        if (--looks_[back].waits > 0) continue;
        if (request_.slots[back] == kNoSlot || may(request_.slots[back])) looking_.push_back(back);
      }
    }
  }

  struct Looked {
    std::uint32_t look = 0;
    std::uint32_t waits = 0;  // as of that look
  };

  const OwnerGroupsRequest& request_;
  std::size_t slots_ = 0, left_ = 0;
  std::vector<std::uint32_t> behind_begin_;  // of each box, in behind_
  std::vector<BoxId> behind_;
  std::vector<std::uint32_t> waits_;       // by box: boxes in front of it that have not been taken
  std::vector<std::vector<BoxId>> ready_;  // by slot: boxes that nothing is in front of
  std::vector<bool> open_;                 // by slot: it has no run in the group yet
  std::uint32_t look_ = 0;
  std::vector<Looked> looks_;  // by box
  std::vector<BoxId> passed_, looking_;
};

}  // namespace

std::vector<std::vector<BoxId>> GroupByOwner(const OwnerGroupsRequest& request) { return Grouper(request).Group(); }

}  // namespace slabstream
