#include "common/planning/assignment.h"

#include <algorithm>
#include <functional>
#include <map>
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

// Owners go to the slots of their host, or to all slots if it has none. Each of them has about as many owners, with neighbouring numbers:
// these often lie side by side, so that their boxes make longer runs.
std::vector<std::uint32_t> AssignToOwners(const AssignmentRequest& request) {
  std::map<std::uint64_t, std::vector<std::uint32_t>> slots_of, holders_of;  // by host; 0: all
  for (std::uint32_t slot = 0; slot < request.slots; ++slot) {
    slots_of[0].push_back(slot);
    if (slot < request.slot_hosts.size() && request.slot_hosts[slot] != 0) slots_of[request.slot_hosts[slot]].push_back(slot);
  }
  for (std::uint32_t holder = 0; holder < request.holder_count; ++holder) {
    const std::uint64_t host = holder < request.holder_hosts.size() ? request.holder_hosts[holder] : 0;
    holders_of[slots_of.contains(host) ? host : 0].push_back(holder);
  }
  std::vector<std::uint32_t> slot_of(request.holder_count);
  for (const auto& [host, holders] : holders_of) {
    const std::vector<std::uint32_t>& slots = slots_of.at(host);
    for (std::size_t i = 0; i < holders.size(); ++i) slot_of[holders[i]] = slots[i * slots.size() / std::max(holders.size(), slots.size())];
  }
  std::vector<std::uint32_t> slots;
  for (const std::uint32_t holder : request.holders) slots.push_back(slot_of[holder]);
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
