// What a person meant who typed a name that does not exist: a command, an option, a choice, a dataset. Pure.
#pragma once

#include <algorithm>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace slabstream {

// The name that is most like `text`: it differs in case or dashes alone, `text` begins it or is a part of it (3 letters
// or more), or few letters are wrong, missing, too many or swapped. Empty: none is alike. If several are equally alike,
// it is the first. Valid as `names` are.
std::string_view MostAlike(std::string_view text, std::span<const std::string_view> names);

// The end of a message about a name that does not exist: "; did you mean 'raycast'?", or nothing.
std::string DidYouMean(std::string_view text, std::span<const std::string_view> names);

// MostAlike for a list of entries with a `name` (find_named.h), or of texts.
template <std::ranges::range Entries>
requires(!std::convertible_to<Entries, std::span<const std::string_view>>) std::string
    DidYouMean(std::string_view text, const Entries& entries) {
  std::vector<std::string_view> names;
  for (const auto& entry : entries) {
    if constexpr (requires { entry.name; }) {
      names.push_back(entry.name);
    } else {
      names.push_back(entry);
    }
  }
  return DidYouMean(text, std::span<const std::string_view>(names));
}

}  // namespace slabstream
