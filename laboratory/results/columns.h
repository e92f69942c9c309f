// The columns and metrics of results: the only list of each. docs/reference/results.md is their table, and python/slabstream_lab reads what
// is written with them. Names stay; a column that changes its meaning gets a new name and results a new kResultsVersion.
#pragma once

#include <span>
#include <string_view>

namespace slabstream {

inline constexpr int kResultsVersion = 1;

struct Column {
  std::string_view name, meaning;
};
// What a value was found for. A case leaves out the columns that do not apply to it.
std::span<const Column> CaseColumns();
// Around them: which run, the value itself, and who found it.
std::span<const Column> RunColumns();
std::span<const Column> ValueColumns();

struct Metric {
  std::string_view name, unit, meaning;
};
std::span<const Metric> Metrics();

}  // namespace slabstream
