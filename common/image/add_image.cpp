#include "common/image/add_image.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/base/check.h"
#include "common/image/local_image.h"
#include "common/parallel/parallel.h"

namespace slabstream {

void AddImage(LocalImage& sum, const LocalImage& share) {
  CHECK(sum.format == share.format && sum.voxel.empty() && share.voxel.empty() && sum.rows.empty() && share.rows.empty());
  CHECK(sum.bounds.Contains(share.bounds));
  const auto width = std::size_t(share.bounds.width());
  constexpr std::int32_t kRows = 16;
  ParallelForRanges(share.bounds.y_begin, share.bounds.y_end, kRows, [&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t y = begin; y < end; ++y) {
      const std::size_t from = std::size_t(y - share.bounds.y_begin) * width;
      const std::size_t to =
          std::size_t(y - sum.bounds.y_begin) * std::size_t(sum.bounds.width()) + std::size_t(share.bounds.x_begin - sum.bounds.x_begin);
      for (std::size_t i = 0; i < 4 * width; ++i) sum.rgba[4 * to + i] += share.rgba[4 * from + i];
      if (sum.depth.empty()) continue;
      for (std::size_t i = 0; i < width; ++i) sum.depth[to + i] = std::min(sum.depth[to + i], share.depth[from + i]);
    }
  });
}

}  // namespace slabstream
