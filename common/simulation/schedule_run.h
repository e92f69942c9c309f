// ScheduleRun: one group's schedule on all its ranks at once, by the rule of the service (worker/group_run.h): a step may be taken at a
// rank when the rank is rendered, nothing is being combined for it, and all earlier steps of the rank that touch the same pixels are taken.
// Instead of looking through all steps after each event it counts for every step what it still waits for.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "common/combining/holdings.h"
#include "common/planning/frame_plan.h"

namespace slabstream {

class ScheduleRun {
 public:
  using Parts = Holdings::Map;  // what a step carries

  // `group` must outlive the run; its schedule must be valid over `frame` (CheckSchedule).
  ScheduleRun(const GroupPlan& group, PixelRange frame);

  void OnRendered(Rank rank) { ranks_[rank].rendered = true; }
  void OnArrived(std::uint32_t step, Parts parts);  // at its `to`, from another worker
  void OnCombined(Rank rank) { --ranks_[rank].combining; }

  // The first step that can be taken now among those of `rank`, which is taken thereby: its parts leave `from` or come to `to`.
  enum class Kind : std::uint8_t { kNone, kSend, kReceive, kMove };  // kMove: between two ranks of one worker
  struct Taken {
    Kind kind = Kind::kNone;
    std::uint32_t step = 0;
    Parts parts;
    bool onto = false;  // kReceive, kMove: something was there, on which they are combined
  };
  Taken TakeNext(Rank rank);
  // A combine for the rank is under way until OnCombined.
  void Combining(Rank rank) { ++ranks_[rank].combining; }

  // The root holds everything, and nothing is being combined there.
  bool RootDone() const;

 private:
  enum Side : std::uint32_t { kFrom = 0, kTo = 1 };
  struct StepState {
    std::uint32_t waits[2] = {0, 0};  // for earlier steps, at `from` and at `to`
    bool sent = false, arrived = false;
    Parts parts;  // that arrived
  };
  struct RankState {
    bool rendered = false;
    int combining = 0;
    std::uint32_t open_steps = 0;
    std::set<std::uint32_t> possible;  // steps that wait for nothing but this rank itself; of a move, also its other rank
    Holdings held;
  };

  bool local(const Step& step) const { return group_.placements[step.from].worker == group_.placements[step.to].worker; }
  bool Free(Rank rank) const { return ranks_[rank].rendered && ranks_[rank].combining == 0; }
  void Offer(std::uint32_t step);
  void Close(std::uint32_t step, Side side);
  bool Put(Rank rank, const Parts& parts);

  const GroupPlan& group_;
  std::vector<StepState> steps_;
  std::vector<RankState> ranks_;
  // Who waits for the step at one of its sides (2 * step + side): [first_waiter_[i], first_waiter_[i + 1]) of waiters_, each 2 * step +
  // side.
  std::vector<std::uint32_t> first_waiter_, waiters_;
};

}  // namespace slabstream
