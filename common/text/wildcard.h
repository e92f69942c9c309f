// Patterns of names: * stands for any characters, also for none, and ? for one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "common/text/utf8.h"

namespace slabstream {

// Characters are those of UTF-8; a byte that begins no character counts as one. Whatever the pattern is, the number of steps is at most
// about the product of both lengths.
inline bool MatchesPattern(std::string_view name, std::string_view pattern) {
  const auto after = [&](std::size_t at) { return at + std::max<std::size_t>(1, Utf8CharacterBytes(name.substr(at))); };
  std::size_t n = 0, p = 0, last_star = std::string_view::npos, taken = 0;  // `taken`: what the last star stands for ends here
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      last_star = p++;
      taken = n;
    } else if (p < pattern.size() && pattern[p] == '?') {
      ++p;
      n = after(n);
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (last_star != std::string_view::npos) {
      p = last_star + 1;
      n = taken = after(taken);
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

}  // namespace slabstream
