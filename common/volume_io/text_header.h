// The text header of a NRRD or MetaImage file: lines "key: value" or "key = value".
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"

namespace slabstream {

inline constexpr std::size_t kMaxTextHeader = std::size_t{1} << 20;  // bytes

struct TextHeader {
  std::string first_line;
  std::map<std::string, std::string> fields;  // both sides without blanks around them
  std::int64_t end = 0;                       // bytes of the file up to and with the line that ends the header

  // The value of the first of these keys that is there.
  std::optional<std::string> Find(std::initializer_list<const char*> keys) const;
  std::optional<std::string> Find(const char* key) const { return Find({key}); }
  // Its numbers, `if_absent` without any of the keys; nullopt if it does not hold `count` numbers and nothing else. Numbers may be
  // nan, and grouped as "(1,0,0) (0,1,0) none".
  std::optional<std::vector<double>> Numbers(std::initializer_list<const char*> keys, std::size_t count,
                                             std::vector<double> if_absent) const;
};

// NRRD does not tell capitals from small letters in keys, MetaImage does.
enum class KeyCase { kAsWritten, kLower };

// Reads lines until an empty one, one with the key `last_key`, or the end of the file. Lines that begin with # and lines
// without the separator are passed over. NotFound: cannot be opened. InvalidArgument: longer than kMaxTextHeader.
Result<TextHeader> ReadTextHeader(const std::string& path, char separator, KeyCase key_case, const std::string& last_key);

// A volume's size from the numbers of a header; what is no whole number is as wrong as 0. InvalidArgument as CheckSize.
Result<Index3> ToSize(const std::string& path, const std::vector<double>& sides);

// A whole number, or nullopt.
std::optional<std::int64_t> ToInteger(const std::string& text);

std::string ToLower(std::string text);

}  // namespace slabstream
