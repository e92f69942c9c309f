// The names that a Policy may hold besides those of Decompositions(), Assignments(), Balances() and CombiningSchemes().
//
// kAutomatic leaves the choice of decomposition, assignment and combine to ChoosePolicy (coordinator/tuning). As a load metric it means the
// one that suits the decomposition; if the decomposition is open, both are chosen together.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "common/frame/frame_request.h"

namespace slabstream {

// Whether a name is left to ChoosePolicy. Plans and layouts need policies without such names.
inline bool LeavesChoice(const Policy& policy) {
  return policy.decomposition == kAutomatic || policy.assignment == kAutomatic || policy.combine == kAutomatic;
}

struct NamedChoice {
  std::string_view name;     // what the option takes
  std::string_view purpose;  // one line for --help
};

// --balance-by: what boxes have equal shares of.
enum class BalanceBy { kVoxels, kOccupied, kCost };
const std::vector<NamedChoice>& BalanceByChoices();             // kAutomatic first, then by BalanceBy
std::optional<BalanceBy> FindBalanceBy(std::string_view name);  // none: kAutomatic, or no such name
std::string_view NameOf(BalanceBy metric);

}  // namespace slabstream
