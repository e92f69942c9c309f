#include "common/combining/step_order.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/combining/fragments.h"

namespace slabstream {

StepOrder::StepOrder(SharedSchedule schedule, std::vector<Rank> ranks)
    : schedule_(std::move(schedule)), numbers_(std::move(ranks)), ranks_(numbers_.size()) {
  for (std::uint32_t i = 0; i < numbers_.size(); ++i) {
    ranks_[i].first_turn = std::uint32_t(turns_.size());
    for (const std::uint32_t step : schedule_->StepsOf(numbers_[i])) turns_.push_back({.step = step, .rank = i});
    ranks_[i].turn_end = std::uint32_t(turns_.size());
    ranks_[i].open_steps = ranks_[i].turn_end - ranks_[i].first_turn;
  }
  for (Turn& turn : turns_) {
    const Step& step = StepOf(turn);
    turn.partner = FindTurn(Sends(turn) ? step.to : step.from, turn.step).value_or(kElsewhere);
  }
  FindWaits();
  for (std::uint32_t turn = 0; turn < turns_.size(); ++turn) Offer(turn);
}

void StepOrder::FindWaits() {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // (turn, another one that waits for it)
  for (const RankState& rank : ranks_) {
    Fragments<std::uint32_t> latest;  // the last turn that touches a pixel
    for (std::uint32_t turn = rank.first_turn; turn < rank.turn_end; ++turn) {
      std::vector<std::uint32_t> earlier;
      for (const auto& fragment : latest.Take(StepOf(turns_[turn]).pixels)) earlier.push_back(fragment.value);
      std::ranges::sort(earlier);
      const auto repeated = std::ranges::unique(earlier);
      earlier.erase(repeated.begin(), repeated.end());
      for (const std::uint32_t first : earlier) order.emplace_back(first, turn);
      turns_[turn].waits = std::uint32_t(earlier.size());
      latest.Put({StepOf(turns_[turn]).pixels, turn});
    }
  }
  std::ranges::sort(order);
  first_waiter_.resize(turns_.size() + 1);
  for (const auto& [first, waiter] : order) {
    ++first_waiter_[first + 1];
    waiters_.push_back(waiter);
  }
  for (std::size_t i = 1; i < first_waiter_.size(); ++i) first_waiter_[i] += first_waiter_[i - 1];
}

std::optional<std::uint32_t> StepOrder::FindRank(Rank rank) const {
  const auto found = std::ranges::lower_bound(numbers_, rank);
  if (found == numbers_.end() || *found != rank) return std::nullopt;
  return std::uint32_t(found - numbers_.begin());
}

std::optional<std::uint32_t> StepOrder::FindTurn(Rank rank, std::uint32_t step) const {
  const std::optional<std::uint32_t> index = FindRank(rank);
  if (!index) return std::nullopt;
  const auto begin = turns_.begin() + ranks_[*index].first_turn, end = turns_.begin() + ranks_[*index].turn_end;
  const auto found = std::lower_bound(begin, end, step, [](const Turn& turn, std::uint32_t value) { return turn.step < value; });
  if (found == end || found->step != step) return std::nullopt;
  return std::uint32_t(found - turns_.begin());
}

StepOrder::RankState& StepOrder::At(Rank rank) { return ranks_[FindRank(rank).value()]; }
const StepOrder::RankState& StepOrder::At(Rank rank) const { return ranks_[FindRank(rank).value()]; }

void StepOrder::OnRendered(Rank rank) {
  const std::uint32_t index = FindRank(rank).value();
  CHECK(!ranks_[index].rendered) << "rank " << rank;
  ranks_[index].rendered = true;
  changed_.insert(index);
}

void StepOrder::OnCombined(Rank rank) {
  const std::uint32_t index = FindRank(rank).value();
  CHECK_GT(ranks_[index].combining, 0U);
  if (--ranks_[index].combining == 0) changed_.insert(index);
}

void StepOrder::OnArrived(std::uint32_t step, std::uint64_t pixels) {
  CHECK(Awaited(step)) << "step " << step;
  const std::uint32_t index = *FindTurn(schedule_->steps()[step].to, step);
  turns_[index].arrived += pixels;
  turns_[index].untaken = true;
  Offer(index);
}

bool StepOrder::Awaited(std::uint32_t step) const {
  if (step >= schedule_->steps().size()) return false;
  const std::optional<std::uint32_t> turn = FindTurn(schedule_->steps()[step].to, step);
  return turn && turns_[*turn].partner == kElsewhere && !turns_[*turn].taken;
}

// Offers the turn to TakeNext if it waits only for its ranks to be free.
void StepOrder::Offer(std::uint32_t index) {
  const Turn& turn = turns_[index];
  if (turn.taken || turn.waits > 0) return;
  if (turn.partner != kElsewhere) {
    if (turns_[turn.partner].waits > 0) return;
    ranks_[turns_[turn.partner].rank].possible.insert(turn.partner);
  } else if (!Sends(turn) && !turn.untaken) {
    return;
  }
  ranks_[turn.rank].possible.insert(index);
  changed_.insert(turn.rank);
}

// Marks the turn as taken; those that wait for it wait for one less.
void StepOrder::Close(std::uint32_t index) {
  turns_[index].taken = true;
  ranks_[turns_[index].rank].possible.erase(index);
  --ranks_[turns_[index].rank].open_steps;
  for (std::uint32_t i = first_waiter_[index]; i < first_waiter_[index + 1]; ++i) {
    if (--turns_[waiters_[i]].waits == 0) Offer(waiters_[i]);
  }
}

std::optional<StepOrder::Taken> StepOrder::TakeNext() {
  for (; !changed_.empty(); changed_.erase(changed_.begin())) {
    RankState& rank = ranks_[*changed_.begin()];
    if (!rank.free()) continue;
    for (const std::uint32_t index : rank.possible) {
      Turn& turn = turns_[index];
      const bool moves = turn.partner != kElsewhere;
      if (moves && !ranks_[turns_[turn.partner].rank].free()) continue;
      const Taken taken = {moves ? Kind::kMove : Sends(turn) ? Kind::kSend : Kind::kReceive, turn.step};
      if (taken.kind == Kind::kReceive && turn.arrived < PixelCount(StepOf(turn).pixels)) {
        turn.untaken = false;
        rank.possible.erase(index);
      } else {
        Close(index);
        if (moves) Close(turn.partner);
      }
      return taken;
    }
  }
  return std::nullopt;
}

}  // namespace slabstream
