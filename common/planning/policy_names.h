// The names that a Policy may hold beside those of Decompositions(), Assignments() and CombiningSchemes().
#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace slabstream {

struct NamedChoice {
  std::string_view name;     // what the option takes
  std::string_view purpose;  // one line for --help
};

// --split: what boxes have equal shares of.
enum class WorkSplit { kVoxels, kOccupied, kCost };
inline constexpr std::string_view kAutomaticSplit = "auto";     // what suits the decomposition
const std::vector<NamedChoice>& WorkSplits();                   // kAutomaticSplit first, then by WorkSplit
std::optional<WorkSplit> FindWorkSplit(std::string_view name);  // none: kAutomaticSplit, or no such name

// --balance: whether boxes change while frames go by.
const std::vector<NamedChoice>& BalanceModes();  // "static", "dynamic"
inline constexpr std::string_view kStaticBalance = "static", kDynamicBalance = "dynamic";

}  // namespace slabstream
