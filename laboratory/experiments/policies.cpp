#include "laboratory/experiments/policies.h"

#include <fmt/format.h>

#include "common/base/check.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"

namespace slabstream {

std::vector<NamedPolicy> AllPartitions() {
  std::vector<NamedPolicy> policies;
  for (const DecompositionEntry& entry : Decompositions()) {
    for (const std::string_view split : {"voxels", "occupied"}) {
      NamedPolicy named{fmt::format("{} by {}", entry.name, split), {}};
      named.policy.decomposition = entry.name;
      named.policy.load_metric = split;
      named.policy.groups = 1;
      policies.push_back(std::move(named));
    }
  }
  return policies;
}

NamedPolicy EqualSlabs() { return AllPartitions().front(); }

NamedPolicy BalancedTree() {
  NamedPolicy tree{"kd-tree by occupied", {}};
  tree.policy.decomposition = "kd-tree";
  tree.policy.load_metric = "occupied";
  tree.policy.groups = 1;
  return tree;
}

std::vector<NamedPolicy> PartitionsAlongTheView() {
  std::vector<NamedPolicy> policies;
  for (const char* decomposition : {"slab", "kd-tree"}) {
    NamedPolicy named{fmt::format("{} along the view", decomposition), BalancedTree().policy};
    named.policy.decomposition = decomposition;
    named.policy.axis = AxisChoice::kView;
    policies.push_back(std::move(named));
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
