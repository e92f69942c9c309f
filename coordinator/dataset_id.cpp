#include "coordinator/dataset_id.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "common/wire/digest.h"

namespace slabstream {

DatasetId IdOf(const std::string& name, const Volume& volume) {
  const auto& [geometry, type, mapping] = volume.description;
  const auto& [size, spacing] = geometry;
  const std::string text =
      fmt::format("{} {} {} {} {} {} {} {} {} {} {:x} {}", size.x, size.y, size.z, spacing.x, spacing.y, spacing.z, int(type),
                  mapping.scale, mapping.offset, volume.block.bytes.size(), Digest(volume.block.bytes), name);
  return std::max<DatasetId>(Digest(std::as_bytes(std::span(text))), 1);
}

}  // namespace slabstream
