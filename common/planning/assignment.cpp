#include "common/planning/assignment.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <queue>
#include <tuple>

namespace slabstream {

namespace {

// Box i belongs to slot i mod slots.
std::vector<std::uint32_t> AssignCyclic(const AssignmentRequest& request) {
  std::vector<std::uint32_t> slots(request.costs.size());
  for (std::size_t box = 0; box < slots.size(); ++box) slots[box] = std::uint32_t(box % request.slots);
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

// Each slot has about as many owners, with neighbouring numbers: these often lie side by side, so that their boxes make longer runs.
std::vector<std::uint32_t> AssignToOwners(const AssignmentRequest& request) {
  const std::uint64_t owners = std::max(request.holder_count, request.slots);
  std::vector<std::uint32_t> slots;
  for (const std::uint32_t holder : request.holders) slots.push_back(std::uint32_t(holder * std::uint64_t{request.slots} / owners));
  return slots;
}

}  // namespace

const std::vector<AssignmentEntry>& Assignments() {
  static const std::vector<AssignmentEntry> entries = {
      {"cyclic", "boxes to workers in turn", AssignCyclic},
      {"alternating", "boxes to workers in turn, in every other frame from the last one on: front and back change hands", AssignCyclic,
       false, true},
      {"contiguous", "neighbouring boxes to the same worker", AssignContiguous},
      {"greedy", "the costliest remaining box to the worker with the least work", AssignGreedy, true},
      {"owner", "each box to the worker beside whoever holds its voxels; boxes are those of the pieces that a volume lies in",
       AssignToOwners, false, false, true},
  };
  return entries;
}

}  // namespace slabstream
