// The value at a JSON pointer (RFC 6901, without its escapes): "/shape/0". Adds a member that is missing, and a value behind the last of a
// list.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "common/json/json.h"

namespace slabstream {

inline Json& JsonAt(Json& json, std::string_view pointer) {
  if (pointer.empty()) return json;
  const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
  const std::string step(pointer.substr(1, end - 1));
  if (!json.is_array()) return JsonAt(json[step], pointer.substr(end));
  const std::size_t index = std::stoul(step);
  if (index == json.size()) json.push_back(nullptr);
  return JsonAt(json[index], pointer.substr(end));
}

}  // namespace slabstream
