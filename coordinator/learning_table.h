// What the tables that learn from finished frames have in common.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/stats/report.h"

namespace slabstream {

// `list`: most recently used first.
template <class List>
void KeepFirst(List& list, std::size_t count) {
  while (list.size() > count) list.pop_back();
}

// Rendering without what is done once a padded box, which the next frame does not repeat. 0: none is reported.
inline std::int64_t LastingRenderNs(const RankReport& report) {
  const auto stage = [&report](Stage s) { return report.stage_ns[std::size_t(s)]; };
  return std::max<std::int64_t>(stage(Stage::kRender) - stage(Stage::kPrepare), 0);
}

}  // namespace slabstream
