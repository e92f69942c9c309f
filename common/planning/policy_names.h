// The names that a Policy may hold besides those of Decompositions(), Assignments(), Balances() and CombiningSchemes().
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "common/frame/frame_request.h"

namespace slabstream {

struct NamedChoice {
  std::string_view name;     // what the option takes
  std::string_view purpose;  // one line for --help
};

// --balance-by: what boxes have equal shares of.
enum class BalanceBy { kVoxels, kBricks, kOccupied, kCost };
const std::vector<NamedChoice>& BalanceByChoices();             // kAutomatic first, then by BalanceBy
std::optional<BalanceBy> FindBalanceBy(std::string_view name);  // none: kAutomatic, or no such name
std::string_view NameOf(BalanceBy metric);

}  // namespace slabstream
