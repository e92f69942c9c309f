// FairTurns: whose turn it is. The members share a service, threads or processors, which are too few for all at a time. The rule is
// start-time fair queueing (P. Goyal, H. M. Vin, H. Cheng, 1996): the next turn belongs to the member that has used least time. So a member
// that always wants more gets an equal share, and a member that wants less than an equal share hardly waits. How long a turn takes need not
// be known before it begins.
//
// A member that had nothing to do has not saved up time. It counts as if it had used at least as much as the last member in turn had used
// when that turn began, less a credit. The credit makes up for short waits: a member that waits for something else between its demands, and
// so misses its turns, has them later.
// Pure; one thread.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <map>

#include "common/base/time.h"

namespace slabstream {

template <class Member>
class FairTurns {
 public:
  explicit FairTurns(Duration credit = {}) : credit_(credit) {}

  // A member's place in the order of turns. The smallest one is next.
  struct Turn {
    Duration used{};
    std::uint64_t last = 0;  // number of the last Join or Take
    friend auto operator<=>(const Turn&, const Turn&) = default;
  };

  // The member has something to do, and had nothing before.
  void Join(const Member& member) {
    const Duration used = TurnOf(member).used;
    turns_[member] = {used, ++count_};
  }
  Turn TurnOf(const Member& member) const {
    const auto known = turns_.find(member);
    return known == turns_.end() ? Turn{used_by_last_, 0} : Turn{std::max(known->second.used, used_by_last_ - credit_), known->second.last};
  }

  void Take(const Member& member) {  // its turn begins
    used_by_last_ = TurnOf(member).used;
    turns_[member] = {used_by_last_, ++count_};
  }
  // The member has used this much. Negative: it was charged too much before. A member that was forgotten is charged nothing.
  void Charge(const Member& member, Duration used) {
    if (const auto known = turns_.find(member); known != turns_.end()) known->second.used += used;
  }

  void Forget(const Member& member) { turns_.erase(member); }
  // Forgets members that have nothing to do and have used no more than the last one in turn, less the credit. Without credit, to remember
  // them would change no turn; with it, they come back as if they were new.
  template <class Busy>
  void ForgetIdle(Busy&& busy) {
    std::erase_if(turns_, [&](const auto& entry) { return entry.second.used <= used_by_last_ - credit_ && !busy(entry.first); });
  }
  void ForgetAll() { turns_.clear(); }  // nobody has anything to do: the next ones begin as equals
  std::size_t size() const { return turns_.size(); }

 private:
  std::map<Member, Turn> turns_;
  Duration credit_;
  Duration used_by_last_{};  // by the last member in turn, when its turn began
  std::uint64_t count_ = 0;
};

}  // namespace slabstream
