#include "laboratory/experiments/policies.h"

#include <fmt/format.h>

#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"

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

std::vector<std::string> AllSchemes() {
  std::vector<std::string> schemes;
  for (const CombiningEntry& entry : CombiningSchemes()) schemes.emplace_back(entry.name);
  return schemes;
}

std::vector<std::string> UsualSchemes() { return {"fan-in", "radix-k"}; }

}  // namespace slabstream
