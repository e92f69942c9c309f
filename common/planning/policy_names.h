// The names that a Policy may hold beside those of Decompositions(), Assignments() and CombiningSchemes().
//
// kAutomatic stands for any of them: in decomposition, assignment and combine it leaves the choice to ChoosePolicy (coordinator/tuning), in
// split it means what suits the decomposition, and is chosen together with it where that is left open, too.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "common/planning/frame_request.h"

namespace slabstream {

inline constexpr std::string_view kAutomatic = "auto";

// Whether a name is left to ChoosePolicy. Plans and layouts are made by policies of which none is.
inline bool LeavesChoice(const Policy& policy) {
  return policy.decomposition == kAutomatic || policy.assignment == kAutomatic || policy.combine == kAutomatic;
}

struct NamedChoice {
  std::string_view name;     // what the option takes
  std::string_view purpose;  // one line for --help
};

// --split: what boxes have equal shares of.
enum class WorkSplit { kVoxels, kOccupied, kCost };
const std::vector<NamedChoice>& WorkSplits();                   // kAutomatic first, then by WorkSplit
std::optional<WorkSplit> FindWorkSplit(std::string_view name);  // none: kAutomatic, or no such name

// --balance: whether boxes change while frames go by.
const std::vector<NamedChoice>& BalanceModes();  // "static", "dynamic"
inline constexpr std::string_view kStaticBalance = "static", kDynamicBalance = "dynamic";

}  // namespace slabstream
