// Short tables of pairs, such as names of a file format and what they mean.
#pragma once

#include <algorithm>
#include <optional>
#include <ranges>

namespace slabstream {

// What belongs to `first`; none: no pair has it.
template <std::ranges::range Pairs, class First>
std::optional<typename std::ranges::range_value_t<Pairs>::second_type> SecondOf(const Pairs& pairs, const First& first) {
  const auto found = std::ranges::find_if(pairs, [&](const auto& pair) { return pair.first == first; });
  return found == std::ranges::end(pairs) ? std::nullopt : std::optional(found->second);
}

}  // namespace slabstream
