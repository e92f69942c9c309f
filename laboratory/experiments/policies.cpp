#include "laboratory/experiments/policies.h"

#include <fmt/format.h>

#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/balances.h"

namespace slabstream {

std::vector<NamedPolicy> AllPartitions() {
  std::vector<NamedPolicy> policies;
  for (const DecompositionEntry& entry : Decompositions()) {
    for (const std::string split : {"voxels", "occupied"}) {
      policies.push_back(
          {fmt::format("{} by {}", entry.name, split), {.decomposition = std::string(entry.name), .balance_by = split, .groups = 1}});
    }
  }
  return policies;
}

NamedPolicy EqualSlabs() { return AllPartitions().front(); }

NamedPolicy BalancedSlabs() { return AllPartitions().at(1); }

NamedPolicy BalancedTree() { return {"kd-tree by occupied", {.decomposition = "kd-tree", .balance_by = "occupied", .groups = 1}}; }

std::vector<NamedPolicy> PartitionsAlongTheView() {
  std::vector<NamedPolicy> policies;
  for (const std::string decomposition : {"slab", "kd-tree"}) {
    policies.push_back({fmt::format("{} along the view", decomposition),
                        {.decomposition = decomposition, .balance_by = "occupied", .axis = AxisChoice::kView, .groups = 1}});
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
  std::vector<NamedPolicy> methods = {{"slabs", EqualSlabs().policy},
                                      {"equal", equal},
                                      {"random", Combined(equal, equal.combine, kBoxesAWorker, "random")},
                                      {"rebuilt", tree}};
  for (const BalanceEntry& entry : Balances()) {
    if (entry.change == nullptr) continue;
    NamedPolicy& method =
        methods.emplace_back(std::string(entry.name), entry.hands_over ? Combined(equal, equal.combine, kBoxesAWorker) : tree);
    method.policy.balance = entry.name;
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
