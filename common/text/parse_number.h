// ParseNumber: a text that is a number as a whole, without spaces around it.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace slabstream {

// T: an integer or floating-point type. Nothing if `text` is no number, or does not fit T.
template <class T>
std::optional<T> ParseNumber(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace slabstream
