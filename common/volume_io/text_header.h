// The text header of a NRRD or MetaImage file: lines "key: value" or "key = value". ITK reads their geometry; this finds the samples.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "common/base/status.h"

namespace slabstream {

inline constexpr std::size_t kMaxTextHeader = std::size_t{1} << 20;  // bytes

struct TextHeader {
  std::map<std::string, std::string> fields;  // both sides without blanks around them
  std::int64_t end = 0;                       // bytes of the file up to and with the line that ends the header

  std::optional<std::string> Find(const std::string& key) const;
};

// NRRD does not tell capitals from small letters in keys, MetaImage does.
enum class KeyCase { kAsWritten, kLower };

// Reads lines until an empty one, one with the key `last_key`, or the end of the file. Lines that begin with # and lines
// without the separator are passed over. NotFound: cannot be opened. InvalidArgument: longer than kMaxTextHeader.
Result<TextHeader> ReadTextHeader(const std::string& path, char separator, KeyCase key_case, const std::string& last_key);

// A whole number, or nullopt.
std::optional<std::int64_t> ToInteger(const std::string& text);

std::string ToLower(std::string text);

}  // namespace slabstream
