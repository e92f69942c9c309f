#include "common/planning/assignment.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <queue>
#include <random>
#include <tuple>
#include <utility>

namespace slabstream {

namespace {

// Box i belongs to slot i mod slots.
std::vector<std::uint32_t> AssignCyclic(const AssignmentRequest& request) {
  std::vector<std::uint32_t> slots(request.costs.size());
  for (std::size_t box = 0; box < slots.size(); ++box) slots[box] = std::uint32_t(box % request.slots);
  return slots;
}

// Boxes to slots in turn, then back, and so on. Boxes of a partition are in the order of their places, so the first and the last of them
// lie on opposite sides of the volume: of the boxes of a slot, half are in front in whatever view the others are behind.
std::vector<std::uint32_t> AssignZigzag(const AssignmentRequest& request) {
  std::vector<std::uint32_t> slots(request.costs.size());
  for (std::size_t box = 0; box < slots.size(); ++box) {
    const std::size_t turn = box % (2 * std::size_t{request.slots});
    slots[box] = std::uint32_t(std::min(turn, 2 * std::size_t{request.slots} - 1 - turn));
  }
  return slots;
}

// AssignCyclic of the boxes in a shuffled order, the same every time: chance, for others to be compared with.
std::vector<std::uint32_t> AssignRandom(const AssignmentRequest& request) {
  const std::vector<std::uint32_t> cyclic = AssignCyclic(request);
  std::vector<std::size_t> order(cyclic.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::minstd_rand random;  // its numbers are the same everywhere, and so is this shuffle (Fisher and Yates, 1938)
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  std::vector<std::uint32_t> slots(cyclic.size());
  for (std::size_t i = 0; i < order.size(); ++i) slots[order[i]] = cyclic[i];
  return slots;
}

// Each slot owns consecutive boxes; the numbers of boxes of two slots differ by at most one.
std::vector<std::uint32_t> AssignContiguous(const AssignmentRequest& request) {
  std::vector<std::uint32_t> slots(request.costs.size());
  for (std::size_t box = 0; box < slots.size(); ++box) slots[box] = std::uint32_t(box * request.slots / slots.size());
  return slots;
}

// Takes boxes in descending order of cost and gives each to the slot with the least cost so far (longest processing time first: Graham,
// "Bounds on multiprocessing timing anomalies", 1969: at most 4/3 of the optimum). Ties go in the order of boxes and slots.
std::vector<std::uint32_t> AssignGreedy(const AssignmentRequest& request) {
  std::vector<std::size_t> costliest_first(request.costs.size());
  std::iota(costliest_first.begin(), costliest_first.end(), std::size_t{0});
  std::ranges::stable_sort(costliest_first, std::greater<>(), [&](std::size_t box) { return request.costs[box]; });
  // Load of a slot: time, number of boxes, slot; least first. The number of boxes spreads boxes that cost nothing.
  using Load = std::tuple<double, std::uint32_t, std::uint32_t>;
  std::priority_queue<Load, std::vector<Load>, std::greater<>> loads;
  for (std::uint32_t slot = 0; slot < request.slots; ++slot) loads.push({0, 0, slot});
  std::vector<std::uint32_t> slots(request.costs.size());
  for (const std::size_t box : costliest_first) {
    const auto [time, boxes, slot] = loads.top();
    loads.pop();
    slots[box] = slot;
    loads.push({time + request.costs[box], boxes + 1, slot});
  }
  return slots;
}

}  // namespace

const std::vector<AssignmentEntry>& Assignments() {
  static const std::vector<AssignmentEntry> entries = {
      {"cyclic", "boxes to workers in turn", AssignCyclic},
      {"zigzag", "boxes to workers in turn and back: each has some in front and some behind", AssignZigzag},
      {"alternating", "boxes to workers in turn, in every other frame from the last one on: front and back change hands", AssignCyclic,
       false, true},
      {"contiguous", "neighbouring boxes to the same worker", AssignContiguous},
      {"random", "boxes to workers as if by chance, the same every time; to compare with", AssignRandom},
      {"greedy", "the costliest remaining box to the worker with the least work", AssignGreedy, true},
  };
  return entries;
}

}  // namespace slabstream
