#include "common/planning/frame_window.h"

#include <algorithm>

namespace slabstream {

FrameWindow WindowFor(std::size_t workers, std::uint32_t teams, std::int64_t frame_bytes, int fit) {
  const std::size_t team = (workers + teams - 1) / teams;
  const std::int64_t in_memory = kWindowBytes / std::max<std::int64_t>(frame_bytes, 1);
  const std::int64_t wanted = std::min(std::int64_t(std::min<std::size_t>(team, kMostInWindow)), in_memory);
  const int depth = std::min(int(std::max<std::int64_t>(wanted, kLeastInWindow)), fit) * int(teams);
  return {depth, depth};
}

}  // namespace slabstream
