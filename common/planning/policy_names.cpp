#include "common/planning/policy_names.h"

#include <algorithm>

namespace slabstream {

const std::vector<NamedChoice>& BalanceByChoices() {
  static const std::vector<NamedChoice> choices = {
      {kAutomatic, "what suits the rest of the policy: bricks for kd-tree, voxels for others, occupied where costs count"},
      {"voxels", "equal voxels"},
      {"bricks", "equal work, by the bricks of voxels that may show something; no voxel is counted"},
      {"occupied", "equal work, by the voxels that show something, which are counted before the first frame"},
      {"cost", "equal render time, as measured in earlier frames; occupied until then"},
  };
  return choices;
}

std::optional<BalanceBy> FindBalanceBy(std::string_view name) {
  const std::vector<NamedChoice>& choices = BalanceByChoices();
  const auto found = std::ranges::find(choices.begin() + 1, choices.end(), name, &NamedChoice::name);
  if (found == choices.end()) return std::nullopt;
  return BalanceBy(found - choices.begin() - 1);
}

std::string_view NameOf(BalanceBy metric) { return BalanceByChoices()[std::size_t(metric) + 1].name; }

}  // namespace slabstream
