#include "gateway/assets.h"

#include <algorithm>
#include <vector>

#include "gateway/content_coding.h"

namespace slabstream {

const Asset* FindAsset(std::string_view path) {
  if (path == "/") path = "/index.html";
  const auto found = std::ranges::find(Assets(), path, &Asset::path);
  return found == Assets().end() ? nullptr : &*found;
}

const std::string& GzippedBytes(const Asset& asset) {
  static const std::vector<std::string> compressed = [] {
    std::vector<std::string> all;
    for (const Asset& each : Assets()) all.push_back(Gzipped(each.bytes));
    return all;
  }();
  return compressed.at(std::size_t(&asset - Assets().data()));
}

}  // namespace slabstream
