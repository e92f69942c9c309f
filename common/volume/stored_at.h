// StoredAt: where whoever sees the same files reads the voxels of a dataset itself, and in which blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/volume/box.h"

namespace slabstream {

inline constexpr std::size_t kMaxSourceBytes = std::size_t{128} << 10;  // 4096 owners

inline constexpr std::string_view kOwnersMark = "owned:";  // how the text of owners begins
inline bool NamesOwners(std::string_view source) { return source.starts_with(kOwnersMark); }

struct StoredAt {
  std::string source;         // an absolute path, perhaps with options for reading it, or owners (data/owned/owned_source.h)
  int level = 0;              // the source's level
  std::uint64_t version = 0;  // the version of its files: whoever finds another one there sees other files
  // Begins at 0 and has the size of the blocks in which the source is read; they lie at multiples of it.
  Box block = {{0, 0, 0}, {1, 1, 1}};
  friend bool operator==(const StoredAt&, const StoredAt&) = default;
};

}  // namespace slabstream
