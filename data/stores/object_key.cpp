#include "data/stores/object_key.h"

#include <fmt/format.h>

#include <climits>

#include "common/base/printable.h"

namespace slabstream {

Status CheckObjectKey(std::string_view store, std::string_view key) {
  const auto wrong = [&](std::string_view why) {
    return Printable(Status::InvalidArgument(fmt::format("{}: '{}' names no object: {}", store, key, why)));
  };
  if (key.size() >= PATH_MAX) return wrong(fmt::format("it has {} bytes, at most {} are allowed", key.size(), PATH_MAX - 1));
  if (key.find('\0') != std::string_view::npos) return wrong("it holds a zero byte");
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('/', begin), key.size());
    const std::string_view part = key.substr(begin, end - begin);
    if (part.empty()) return wrong("a part of it is empty");
    if (part == "." || part == "..") return wrong(fmt::format("a part of it is '{}'", part));
    begin = end + 1;
  }
  return Status::Ok();
}

Status CheckFolderKey(std::string_view store, std::string_view folder) {
  return folder.empty() ? Status::Ok() : CheckObjectKey(store, folder);
}

}  // namespace slabstream
