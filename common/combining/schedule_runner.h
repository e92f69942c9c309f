// ScheduleRunner<Value>: runs a schedule at some of its ranks, or at all. It says which step comes next (StepOrder) and keeps what each of
// these ranks holds. The caller defines values and how two of them merge: images in the worker, intervals of ranks where a schedule is
// checked, covered pixels where one is simulated.
//
// The caller merges what a kMove or kReceive brings into held(to). Nothing here knows which family made the schedule.
#pragma once

#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/combining/fragments.h"
#include "common/combining/step_order.h"

namespace slabstream {

inline std::vector<Rank> AllRanks(Rank ranks) {
  std::vector<Rank> all(ranks);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

template <class Value>
class ScheduleRunner {
 public:
  // As StepOrder's constructor. `frame`: all pixels of the schedule.
  ScheduleRunner(SharedSchedule schedule, PixelRange frame, std::vector<Rank> ranks)
      : order_(std::move(schedule), std::move(ranks)), frame_(frame) {
    for (const Rank rank : order_.ranks()) held_[rank];
  }

  StepOrder& order() { return order_; }
  const StepOrder& order() const { return order_; }

  // The rank's own image is there.
  void OnRendered(Rank rank, const Value& value) {
    held(rank).Put({frame_, value});
    order_.OnRendered(rank);
  }

  struct Taken {
    StepOrder::Kind kind = StepOrder::Kind::kSend;
    std::uint32_t index = 0, turn = 0;  // the step's numbers
    Rank rank = 0;                      // the rank that takes it; kMove: one of the two
    bool last = true;                   // as StepOrder says
    const Step* step = nullptr;
    // kSend, kMove: what `from` held of the step's pixels, perhaps not all; now removed from it. Valid until the next call.
    std::span<const Fragment<Value>> parts;
  };
  std::optional<Taken> TakeNext() {
    const std::optional<StepOrder::Taken> next = order_.TakeNext();
    if (!next) return std::nullopt;
    Taken taken = {next->kind, next->step, next->turn, next->rank, next->last, &order_.schedule().steps()[next->step], {}};
    if (next->kind == StepOrder::Kind::kReceive) return taken;
    parts_.clear();
    held(taken.step->from).Take(taken.step->pixels, parts_);
    taken.parts = parts_;
    return taken;
  }

  Fragments<Value>& held(Rank rank) { return held_.at(rank); }
  const std::map<Rank, Fragments<Value>>& held() const { return held_; }

 private:
  StepOrder order_;
  PixelRange frame_;
  std::map<Rank, Fragments<Value>> held_;
  typename Fragments<Value>::List parts_;  // the parts that were taken last
};

}  // namespace slabstream
