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
  std::int64_t end = 0;                       // bytes of the file up to and including the line that ends the header

  // The value of the first of these keys that the header has.
  std::optional<std::string> Find(std::initializer_list<const char*> keys) const;
  std::optional<std::string> Find(const char* key) const { return Find({key}); }
  // Its numbers; `if_absent` if the header has none of the keys; nullopt unless the value is exactly `count` numbers. Numbers may be nan,
  // and grouped as "(1,0,0) (0,1,0) none".
  std::optional<std::vector<double>> Numbers(std::initializer_list<const char*> keys, std::size_t count,
                                             std::vector<double> if_absent) const;
};

// NRRD ignores the case of keys, MetaImage does not.
enum class KeyCase { kAsWritten, kLower };

// Reads lines until an empty one, one with the key `last_key`, or the end of the file. Skips lines that begin with # and lines without the
// separator. NotFound: cannot be opened. InvalidArgument: longer than kMaxTextHeader.
Result<TextHeader> ReadTextHeader(const std::string& path, char separator, KeyCase key_case, const std::string& last_key);

// A volume's size from the numbers of a header; a number that is not whole is refused like 0. InvalidArgument as CheckSize.
Result<Index3> ToSize(const std::string& path, const std::vector<double>& sides);

// A whole number, or nullopt.
std::optional<std::int64_t> ToInteger(const std::string& text);

std::string ToLower(std::string text);

}  // namespace slabstream
