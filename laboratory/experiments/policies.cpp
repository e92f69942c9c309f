#include "laboratory/experiments/policies.h"

#include <fmt/format.h>

#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/balances.h"
#include "laboratory/experiments/compared_policies.h"

namespace slabstream {
namespace {

NamedPolicy Partitioned(std::string_view decomposition, std::string_view split) {
  return {fmt::format("{} by {}", decomposition, split),
          {.decomposition = std::string(decomposition), .balance_by = std::string(split), .groups = 1, .combine = "fan-in"}};
}

}  // namespace

std::vector<NamedPolicy> AllPartitions() {
  std::vector<NamedPolicy> policies;
  for (const DecompositionEntry& entry : Decompositions()) {
    for (const char* split : {"voxels", "bricks", "occupied"}) policies.push_back(Partitioned(entry.name, split));
  }
  return policies;
}

NamedPolicy EqualSlabs() { return AllPartitions().front(); }

NamedPolicy BrickTree() { return Partitioned("kd-tree", "bricks"); }

NamedPolicy BalancedTree() { return Partitioned("kd-tree", "occupied"); }

std::vector<NamedPolicy> PartitionsAlongTheView() {
  std::vector<NamedPolicy> policies;
  for (const char* decomposition : {"slab", "kd-tree"}) {
    NamedPolicy& named = policies.emplace_back(Partitioned(decomposition, "occupied"));
    named.name = fmt::format("{} along the view", decomposition);
    named.policy.axis = AxisChoice::kView;
  }
  return policies;
}

Policy Combined(Policy policy, std::string_view combine, int groups, std::string_view assignment) {
  policy.combine = combine;
  policy.groups = groups;
  policy.assignment = assignment;
  return policy;
}

std::vector<NamedPolicy> BalanceMethods() {
  const Policy tree = BalancedTree().policy;
  Policy equal = tree;
  equal.balance_by = "voxels";
  const Policy several = Combined(equal, equal.combine, kBoxesAWorker);
  std::vector<NamedPolicy> methods = {{"slabs", EqualSlabs().policy}, {"equal", equal}, {"bricks", BrickTree().policy}, {"rebuilt", tree}};
  for (const BalanceEntry& entry : Balances()) {
    if (entry.change != nullptr) methods.emplace_back(std::string(entry.name), tree).policy.balance = entry.name;
  }
  for (const ComparedBalance& entry : ComparedBalances()) {
    const Policy& from = entry.hands_over ? several : tree;
    methods.emplace_back(std::string(entry.name), from).policy.balance = entry.name;
  }
  return methods;
}

std::vector<std::string> AllSchemes() {
  std::vector<std::string> schemes;
  for (const CombiningEntry& entry : CombiningSchemes()) schemes.emplace_back(entry.name);
  return schemes;
}

std::vector<std::string> UsualSchemes() { return {"fan-in", "radix-k"}; }

}  // namespace slabstream
