#include "common/planning/policy_names.h"

#include <algorithm>

namespace slabstream {

const std::vector<NamedChoice>& BalanceByChoices() {
  static const std::vector<NamedChoice> choices = {
      {kAutomatic, "what suits the decomposition"},
      {"voxels", "equal voxels"},
      {"occupied", "equal work, by what is visible under the transfer function"},
      {"cost", "equal render time, as earlier frames took it; until there are any, occupied"},
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

const std::vector<NamedChoice>& BalanceModes() {
  static const std::vector<NamedChoice> choices = {
      {kStaticBalance, "boxes stay as they were made"},
      {kDynamicBalance, "boxes are resized between frames where what is won pays for the voxels that move"},
  };
  return choices;
}

}  // namespace slabstream
