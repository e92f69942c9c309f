// Lists of entries with a `name`, as options and files spell it: find one, or list their names.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace slabstream {

// Null: no entry has this name. Valid as long as `entries` is.
template <class Entry>
const Entry* FindNamed(const std::vector<Entry>& entries, std::string_view name) {
  const auto found = std::ranges::find(entries, name, &Entry::name);
  return found == entries.end() ? nullptr : &*found;
}

// "slab, beam, subcube"
template <class Entry>
std::string NamesOf(const std::vector<Entry>& entries) {
  std::string names;
  for (const Entry& entry : entries) names.append(names.empty() ? "" : ", ").append(entry.name);
  return names;
}

}  // namespace slabstream
