#include <algorithm>
#include <numeric>
#include <optional>

#include "common/combining/steps.h"

namespace slabstream {
namespace {

// The factors as they are used: see MakeSwap. Steps: those that fold, those of each round, those that collect.
std::vector<std::uint32_t> UsableFactors(Rank ranks, std::span<const std::uint32_t> factors) {
  std::vector<std::uint32_t> used;
  std::uint64_t product = 1, steps_a_member = 0;
  const auto fits = [&](std::uint64_t factor) {
    return product * factor <= ranks && product * factor * (steps_a_member + factor - 1) + ranks - 1 <= kMaxSteps;
  };
  for (const std::uint32_t wanted : factors) {
    std::uint64_t factor = std::min<std::uint64_t>(wanted, ranks / product);
    while (factor >= 2 && !fits(factor)) --factor;
    if (factor < 2) break;
    used.push_back(std::uint32_t(factor));
    product *= factor;
    steps_a_member += factor - 1;
    if (factor < wanted) break;
  }
  return used;
}

std::uint32_t Product(const std::vector<std::uint32_t>& factors) {
  return std::accumulate(factors.begin(), factors.end(), std::uint32_t{1}, std::multiplies<>());
}

// Neighbours fold their images into one: member m stands for the ranks [first(m), first(m + 1)).
struct Members {
  Rank ranks;
  std::uint32_t count;
  std::vector<Rank> rank_of = std::vector<Rank>(count);
  Rank first(std::uint64_t m) const { return Rank(m * ranks / count); }
};

// The rank of the root's member is the root, that of another one stands at the same place. Adds the steps; returns the next round.
std::uint32_t Fold(const ScheduleRequest& request, Members& members, std::vector<Step>& steps) {
  std::uint32_t of_root = 0;
  while (members.first(of_root + 1) <= request.root) ++of_root;
  const Rank place = request.root - members.first(of_root);
  std::uint32_t round = 0;
  for (std::uint32_t m = 0; m < members.count; ++m) {
    const Rank begin = members.first(m), end = members.first(m + 1);
    members.rank_of[m] = std::min(begin + place, end - 1);
    std::uint32_t turn = 0;
    ForEachInsideOut(members.rank_of[m] - begin, end - begin, [&](std::uint32_t from) {
      steps.push_back({turn++, begin + from, members.rank_of[m], request.pixels});
    });
    round = std::max(round, turn);
  }
  std::ranges::stable_sort(steps, {}, &Step::round);
  return round;
}

}  // namespace

std::vector<std::uint32_t> DefaultFactors(Rank ranks) {
  constexpr std::uint32_t kLargest = 8;
  for (Rank product = ranks; product >= 2; --product) {
    std::vector<std::uint32_t> factors;
    Rank rest = product;
    for (std::uint32_t factor = kLargest; factor >= 2; --factor) {
      for (; rest % factor == 0; rest /= factor) factors.push_back(factor);
    }
    if (rest == 1) return factors;
  }
  return {};
}

Schedule MakeSwap(const ScheduleRequest& request, std::span<const std::uint32_t> factors) {
  Schedule schedule = {request.ranks, {request.root}, {}};
  if (request.ranks < 2) return schedule;
  const std::vector<std::uint32_t> used = UsableFactors(request.ranks, factors);
  Members folded{request.ranks, Product(used)};
  const std::uint32_t members = folded.count;
  const auto add = [&](std::uint32_t round, Rank from, Rank to, const PixelRange& pixels) {
    if (pixels.begin < pixels.end) schedule.steps.push_back({round, from, to, pixels});
  };

  std::uint32_t round = Fold(request, folded, schedule.steps);
  const std::vector<Rank>& rank_of = folded.rank_of;

  // Members whose numbers differ in one digit to the base of the factors share what they hold.
  std::vector<PixelRange> held(members, request.pixels);
  std::vector<std::uint32_t> digit(members);
  std::uint32_t stride = 1;
  for (const std::uint32_t factor : used) {
    for (std::uint32_t m = 0; m < members; ++m) {
      digit[m] = m / stride % factor;
      held[m] = Share(held[m], digit[m], factor);
    }
    for (std::uint32_t turn = 0; turn < InsideOutTurns(factor); ++turn, ++round) {
      for (std::uint32_t m = 0; m < members; ++m) {
        const std::optional<std::uint32_t> from = InsideOut(turn, digit[m], factor);
        if (from) add(round, rank_of[m + stride * *from - stride * digit[m]], rank_of[m], held[m]);
      }
    }
    stride *= factor;
  }

  for (std::uint32_t m = 0; m < members; ++m) {
    if (rank_of[m] != request.root) add(round, rank_of[m], request.root, held[m]);
  }
  return schedule;
}

Schedule MakeSwapTree(const ScheduleRequest& request, std::span<const std::uint32_t> factors) {
  Schedule schedule = {request.ranks, {request.root}, {}};
  if (request.ranks < 2) return schedule;
  const std::vector<std::uint32_t> used = UsableFactors(request.ranks, factors);
  Members members{request.ranks, Product(used)};
  std::uint32_t round = Fold(request, members, schedule.steps);
  const auto root = std::uint32_t(std::ranges::find(members.rank_of, request.root) - members.rank_of.begin());
  std::uint32_t stride = 1;
  for (const std::uint32_t factor : used) {
    // Members whose lower digits are the root's hold what the others of their groups had.
    const std::uint32_t to = root / stride % factor;
    for (std::uint32_t turn = 0; turn < InsideOutTurns(factor); ++turn, ++round) {
      const std::optional<std::uint32_t> from = InsideOut(turn, to, factor);
      if (!from) continue;
      for (std::uint32_t group = root % stride; group < members.count; group += stride * factor) {
        schedule.steps.push_back({round, members.rank_of[group + stride * *from], members.rank_of[group + stride * to], request.pixels});
      }
    }
    stride *= factor;
  }
  return schedule;
}

}  // namespace slabstream
