#include "gateway/assets.h"

#include <algorithm>

namespace slabstream {

const Asset* FindAsset(std::string_view path) {
  if (path == "/") path = "/index.html";
  const auto found = std::ranges::find(Assets(), path, &Asset::path);
  return found == Assets().end() ? nullptr : &*found;
}

}  // namespace slabstream
