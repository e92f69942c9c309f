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
  Schedule schedule = {request.ranks, request.root, {}};
  if (request.ranks < 2) return schedule;
  const std::vector<std::uint32_t> used = UsableFactors(request.ranks, factors);
  const auto members = std::accumulate(used.begin(), used.end(), std::uint32_t{1}, std::multiplies<>());
  const auto add = [&](std::uint32_t round, Rank from, Rank to, const PixelRange& pixels) {
    if (pixels.begin < pixels.end) schedule.steps.push_back({round, from, to, pixels});
  };

  // Neighbours fold: member m stands for the ranks [first(m), first(m + 1)), the root for its own.
  const auto first = [&](std::uint64_t m) { return Rank(m * request.ranks / members); };
  std::vector<Rank> rank_of(members);
  std::uint32_t round = 0;
  for (std::uint32_t m = 0; m < members; ++m) {
    const Rank begin = first(m), end = first(m + 1);
    rank_of[m] = request.root >= begin && request.root < end ? request.root : begin;
    std::uint32_t turn = 0;
    ForEachInsideOut(rank_of[m] - begin, end - begin, [&](std::uint32_t from) { add(turn++, begin + from, rank_of[m], request.pixels); });
    round = std::max(round, turn);
  }

  std::ranges::stable_sort(schedule.steps, {}, &Step::round);

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

}  // namespace slabstream
