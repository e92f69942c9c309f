#include "common/combining/step_order.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/combining/fragments.h"

namespace slabstream {

StepOrder::StepOrder(SharedSchedule schedule, std::vector<Rank> ranks)
    : schedule_(std::move(schedule)), numbers_(std::move(ranks)), ranks_(numbers_.size()) {
  std::size_t turns = 0;
  for (const Rank rank : numbers_) turns += schedule_->StepsOf(rank).size();
  turns_.reserve(turns);
  for (std::uint32_t i = 0; i < numbers_.size(); ++i) {
    ranks_[i].number = numbers_[i];
    ranks_[i].first_turn = std::uint32_t(turns_.size());
    for (const std::uint32_t step : schedule_->StepsOf(numbers_[i])) turns_.push_back({.step = step, .rank = i});
    ranks_[i].turn_end = std::uint32_t(turns_.size());
    ranks_[i].open_steps = ranks_[i].turn_end - ranks_[i].first_turn;
  }
  for (Turn& turn : turns_) {
    turn.sends = StepOf(turn).from == numbers_[turn.rank];
    turn.missing = PixelCount(StepOf(turn).pixels);
    turn.partner = (turn.sends ? FindReceiving(turn.step) : FindSending(turn.step)).value_or(kElsewhere);
  }
  sendable_ = IndexSet(turn_count());
  possible_ = IndexSet(turn_count());
  changed_ = IndexSet(std::uint32_t(ranks_.size()));
  FindWaits();
  for (std::uint32_t turn = 0; turn < turn_count(); ++turn) Offer(turn);
}

void StepOrder::FindWaits() {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // (turn, another one that waits for it)
  order.reserve(turns_.size());
  std::vector<std::uint32_t> earlier, waiters(turns_.size());
  const auto wait = [&](std::uint32_t first, std::uint32_t turn) {
    order.emplace_back(first, turn);
    ++waiters[first];
    ++turns_[turn].waits;
  };
  for (const RankState& rank : ranks_) {
    Fragments<std::uint32_t> latest;  // the last turn that touches a pixel
    for (std::uint32_t turn = rank.first_turn; turn < rank.turn_end; ++turn) {
      const PixelRange& pixels = StepOf(turns_[turn]).pixels;
      if (const auto only = latest.Exchange({pixels, turn})) {  // the usual case
        wait(*only, turn);
        continue;
      }
      earlier.clear();
      for (const auto& fragment : latest.Within(pixels)) earlier.push_back(fragment.value);
      std::ranges::sort(earlier);
      earlier.erase(std::unique(earlier.begin(), earlier.end()), earlier.end());
      for (const std::uint32_t first : earlier) wait(first, turn);
      if (earlier.empty()) {
        latest.Put({pixels, turn});
      } else {
        latest.Replace({pixels, turn});
      }
    }
  }
  for (std::uint32_t turn = 0; turn < turns_.size(); ++turn) {
    if (waiters[turn] < 2) continue;
    turns_[turn].many_waiters = true;
    turns_[turn].first_waiter = std::uint32_t(waiters_.size());
    waiters_.resize(waiters_.size() + 1 + waiters[turn]);
  }
  for (const auto& [first, waiter] : order) {
    const std::uint32_t place = turns_[first].first_waiter;
    (turns_[first].many_waiters ? waiters_[place + ++waiters_[place]] : turns_[first].first_waiter) = waiter;
  }
}

std::optional<std::uint32_t> StepOrder::FindRank(Rank rank) const {
  const auto found = std::ranges::lower_bound(ranks_, rank, {}, &RankState::number);
  if (found == ranks_.end() || found->number != rank) return std::nullopt;
  return std::uint32_t(found - ranks_.begin());
}

std::optional<std::uint32_t> StepOrder::FindSending(std::uint32_t step) const {
  const std::optional<std::uint32_t> rank = FindRank(schedule_->steps()[step].from);
  return rank ? std::optional(ranks_[*rank].first_turn + schedule_->PlaceAtSender(step)) : std::nullopt;
}

std::optional<std::uint32_t> StepOrder::FindReceiving(std::uint32_t step) const {
  const std::optional<std::uint32_t> rank = FindRank(schedule_->steps()[step].to);
  return rank ? std::optional(ranks_[*rank].first_turn + schedule_->PlaceAtReceiver(step)) : std::nullopt;
}

StepOrder::RankState& StepOrder::At(Rank rank) { return ranks_[FindRank(rank).value()]; }
const StepOrder::RankState& StepOrder::At(Rank rank) const { return ranks_[FindRank(rank).value()]; }

void StepOrder::OnRendered(Rank rank) {
  const std::uint32_t index = FindRank(rank).value();
  CHECK(!ranks_[index].rendered) << "rank " << rank;
  ranks_[index].rendered = true;
  changed_.Insert(index);
}

void StepOrder::OnCombined(Rank rank) {
  const std::uint32_t index = FindRank(rank).value();
  CHECK_GT(ranks_[index].combining, 0U);
  if (--ranks_[index].combining == 0) changed_.Insert(index);
}

void StepOrder::OnArrived(std::uint32_t turn, std::uint64_t pixels) {
  turns_[turn].missing -= std::min(turns_[turn].missing, pixels);
  turns_[turn].untaken = true;
  Offer(turn);
}

std::optional<std::uint32_t> StepOrder::Awaited(std::uint32_t step) const {
  if (step >= schedule_->steps().size()) return std::nullopt;
  const std::optional<std::uint32_t> turn = FindReceiving(step);
  return turn && turns_[*turn].partner == kElsewhere && !turns_[*turn].taken ? turn : std::nullopt;
}

// Offers the turn to TakeNext if it waits only for its ranks to be free.
void StepOrder::Offer(std::uint32_t index) {
  const Turn& turn = turns_[index];
  if (turn.taken || turn.waits > 0) return;
  if (turn.partner != kElsewhere) {
    if (turns_[turn.partner].waits > 0) return;
    possible_.Insert(turn.partner);
  } else if (!turn.sends && !turn.untaken) {
    return;
  }
  (turn.sends && turn.partner == kElsewhere ? sendable_ : possible_).Insert(index);
  changed_.Insert(turn.rank);
}

// Marks the turn as taken; those that wait for it wait for one less.
void StepOrder::Close(std::uint32_t index) {
  Turn& turn = turns_[index];
  turn.taken = true;
  sendable_.Erase(index);
  possible_.Erase(index);
  --ranks_[turn.rank].open_steps;
  const auto wait_less = [&](std::uint32_t waiter) {
    if (--turns_[waiter].waits == 0) Offer(waiter);
  };
  if (turn.many_waiters) {
    std::ranges::for_each(std::span(waiters_).subspan(turn.first_waiter + 1, waiters_[turn.first_waiter]), wait_less);
  } else if (turn.first_waiter != kElsewhere) {
    wait_less(turn.first_waiter);
  }
}

std::optional<StepOrder::Taken> StepOrder::TakeNext() {
  const auto ranks = std::uint32_t(ranks_.size());
  for (std::uint32_t i = changed_.Find(0, ranks); i < ranks; i = changed_.Find(i, ranks)) {
    const RankState& rank = ranks_[i];
    const std::uint32_t end = rank.rendered ? rank.turn_end : rank.first_turn;
    if (const std::uint32_t index = sendable_.Find(rank.first_turn, end); rank.free() && index < end) {
      const Taken taken = {Kind::kSend, turns_[index].step, index, rank.number};
      Close(index);
      return taken;
    }
    for (std::uint32_t index = possible_.Find(rank.first_turn, end); index < end; index = possible_.Find(index + 1, end)) {
      Turn& turn = turns_[index];
      const bool moves = turn.partner != kElsewhere;
      if (moves && !(rank.free() && ranks_[turns_[turn.partner].rank].free())) continue;
      Taken taken = {moves ? Kind::kMove : Kind::kReceive, turn.step, index, rank.number};
      taken.last = taken.kind != Kind::kReceive || turn.missing == 0;
      if (taken.last) {
        Close(index);
        if (moves) Close(turn.partner);
      } else {
        turn.untaken = false;
        possible_.Erase(index);
      }
      return taken;
    }
    changed_.Erase(i);
  }
  return std::nullopt;
}

}  // namespace slabstream
