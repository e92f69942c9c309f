// The files of the viewer, which are part of the program. The table is made from a folder at build time (embed_assets.cmake).
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace slabstream {

struct Asset {
  std::string_view path;  // "/assets/page.js"
  std::string_view type;  // "text/javascript"
  std::string_view bytes;
};

std::span<const Asset> Assets();
// "/" is "/index.html". Null: there is none.
const Asset* FindAsset(std::string_view path);
// The bytes of one of Assets(), compressed when any of them is first asked for.
const std::string& GzippedBytes(const Asset& asset);

}  // namespace slabstream
