// The order in which people list names with numbers in them: "s2" before "s10".
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

namespace slabstream {

// A key that sorts numbers inside names by value: each becomes a 0, the count of its digits, and its digits. Names that differ only in
// leading zeros have the same key.
inline std::string NaturalKey(std::string_view name) {
  constexpr const char* kDigits = "0123456789";
  std::string key;
  for (std::size_t i = 0; i < name.size();) {
    const std::size_t number = std::min(name.find_first_of(kDigits, i), name.size());
    key.append(name, i, number - i);
    i = std::min(name.find_first_not_of(kDigits, number), name.size());
    const std::size_t digits = std::min(name.find_first_not_of('0', number), i);
    if (number < i) key.append({'0', char(i - digits)}).append(name, digits, i - digits);
  }
  return key;
}

// For std::ranges::sort, as a projection of names: no two names are equal.
inline std::pair<std::string, std::string> InNaturalOrder(const std::string& name) { return {NaturalKey(name), name}; }

}  // namespace slabstream
