// What readers of shapes take apart: the text or the numbers of a file that is in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "data/volume_io/binary_header.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

// The first line of `rest`, without blanks around it; `rest` goes on behind it.
inline std::string_view TakeLine(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return Trimmed(line);
}

// The first word, which ends at a blank or an end of line; "": there is none.
inline std::string_view TakeWord(std::string_view& rest) {
  const auto blank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
  std::size_t begin = 0;
  while (begin < rest.size() && blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !blank(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

template <class T = double>
std::optional<T> ToNumber(std::string_view word) {
  return ParseNumber<T>(word.substr(word.starts_with('+') ? 1 : 0));
}

// A word of a message: files may hold anything.
inline std::string_view Shortened(std::string_view word) { return word.substr(0, 40); }

// The number at a byte, where one of the type lies.
inline double NumberAt(const BinaryHeader& bytes, SampleType type, std::size_t offset) {
  return VisitSampleType(type, [&]<class T>(const T*) { return double(bytes.At<T>(offset)); });
}

inline std::span<const std::byte> BytesOf(std::string_view text) { return std::as_bytes(std::span(text)); }

// The whole number, as numbers of vertices are; -1: it is none.
inline std::int64_t ToWhole(double number) {
  constexpr double kMost = 1LL << 53;
  return number >= -kMost && number <= kMost && number == double(std::int64_t(number)) ? std::int64_t(number) : -1;
}

}  // namespace slabstream
