#include "common/simulation/schedule_run.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace slabstream {

ScheduleRun::ScheduleRun(const GroupPlan& group, PixelRange frame)
    : group_(group), steps_(group.schedule.steps.size()), ranks_(group.schedule.ranks) {
  for (Rank rank = 0; rank < group.schedule.ranks; ++rank) ranks_[rank].held.Put(frame, {rank, rank + 1});

  std::vector<Fragments<std::uint32_t>> latest(ranks_.size());  // the latest step that touches a pixel
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;   // (step and side that comes first, the one that waits)
  const std::vector<Step>& steps = group.schedule.steps;
  for (std::uint32_t i = 0; i < steps.size(); ++i) {
    for (const Side side : {kFrom, kTo}) {
      const Rank rank = side == kFrom ? steps[i].from : steps[i].to;
      ++ranks_[rank].open_steps;
      std::set<std::uint32_t> before;
      for (const auto& [begin, held] : latest[rank].Take(steps[i].pixels)) before.insert(held.value);
      for (const std::uint32_t earlier : before) {
        order.emplace_back(2 * earlier + (steps[earlier].from == rank ? kFrom : kTo), 2 * i + side);
        ++steps_[i].waits[side];
      }
      latest[rank].Put(steps[i].pixels, i);
    }
  }
  std::sort(order.begin(), order.end());
  first_waiter_.resize(2 * steps.size() + 1);
  for (const auto& [first, waiter] : order) {
    ++first_waiter_[first + 1];
    waiters_.push_back(waiter);
  }
  for (std::size_t i = 1; i < first_waiter_.size(); ++i) first_waiter_[i] += first_waiter_[i - 1];
  for (std::uint32_t i = 0; i < steps.size(); ++i) Offer(i);
}

// Puts the step where TakeNext looks, if nothing but its ranks themselves stands in its way.
void ScheduleRun::Offer(std::uint32_t index) {
  const Step& step = group_.schedule.steps[index];
  const StepState& state = steps_[index];
  if (local(step)) {
    if (state.sent || state.waits[kFrom] > 0 || state.waits[kTo] > 0) return;
    ranks_[step.from].possible.insert(index);
    ranks_[step.to].possible.insert(index);
  } else {
    if (state.waits[kFrom] == 0 && !state.sent) ranks_[step.from].possible.insert(index);
    if (state.waits[kTo] == 0 && state.arrived) ranks_[step.to].possible.insert(index);
  }
}

void ScheduleRun::OnArrived(std::uint32_t step, Parts parts) {
  steps_[step].arrived = true;
  steps_[step].parts = std::move(parts);
  Offer(step);
}

// The step is taken at one of its ranks: who waited for that waits for one less.
void ScheduleRun::Close(std::uint32_t index, Side side) {
  const Step& step = group_.schedule.steps[index];
  RankState& rank = ranks_[side == kFrom ? step.from : step.to];
  rank.possible.erase(index);
  --rank.open_steps;
  for (std::uint32_t i = first_waiter_[2 * index + side]; i < first_waiter_[2 * index + side + 1]; ++i) {
    const std::uint32_t waiter = waiters_[i] / 2;
    if (--steps_[waiter].waits[waiters_[i] % 2] == 0) Offer(waiter);
  }
}

// True if the parts met something.
bool ScheduleRun::Put(Rank rank, const Parts& parts) {
  bool onto = false;
  for (const auto& [begin, part] : parts) {
    const Parts there = ranks_[rank].held.Take({begin, part.end});
    onto |= !there.empty();
    for (const auto& [old_begin, old] : there) ranks_[rank].held.Put({old_begin, old.end}, old.value);
    CHECK(ranks_[rank].held.Combine({begin, part.end}, part.value, Joined)) << "the schedule was valid";
  }
  return onto;
}

ScheduleRun::Taken ScheduleRun::TakeNext(Rank rank) {
  Taken taken;
  if (!Free(rank)) return taken;
  for (const std::uint32_t index : ranks_[rank].possible) {
    const Step& step = group_.schedule.steps[index];
    const bool moves = local(step);
    if (moves && !Free(step.from == rank ? step.to : step.from)) continue;
    taken.step = index;
    if (moves || step.from == rank) {
      taken.kind = moves ? Kind::kMove : Kind::kSend;
      taken.parts = ranks_[step.from].held.Take(step.pixels);
      steps_[index].sent = true;
      if (moves) taken.onto = Put(step.to, taken.parts);
      Close(index, kFrom);
      if (moves) Close(index, kTo);
    } else {
      taken.kind = Kind::kReceive;
      taken.parts = std::move(steps_[index].parts);
      taken.onto = Put(rank, taken.parts);
      Close(index, kTo);
    }
    return taken;
  }
  return taken;
}

bool ScheduleRun::RootDone() const {
  if (ranks_.empty()) return true;
  const RankState& root = ranks_[group_.schedule.root];
  return root.rendered && root.combining == 0 && root.open_steps == 0;
}

}  // namespace slabstream
