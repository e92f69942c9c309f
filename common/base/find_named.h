// Lists of entries with a `name`, as options and files spell it: find one, or list their names.
#pragma once

#include <algorithm>
#include <ranges>
#include <string>
#include <string_view>

namespace slabstream {

// Null: no entry has this name. Valid as long as `entries` is.
template <std::ranges::range Entries>
const std::ranges::range_value_t<Entries>* FindNamed(const Entries& entries, std::string_view name) {
  const auto found = std::ranges::find(entries, name, &std::ranges::range_value_t<Entries>::name);
  return found == std::ranges::end(entries) ? nullptr : &*found;
}

// "slab, beam, subcube"
template <std::ranges::range Entries>
std::string NamesOf(const Entries& entries) {
  std::string names;
  for (const auto& entry : entries) names.append(names.empty() ? "" : ", ").append(entry.name);
  return names;
}

}  // namespace slabstream
