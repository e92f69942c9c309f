#include "common/planning/team.h"

#include <algorithm>

#include "common/base/check.h"

namespace slabstream {

Team TeamOf(const Roster& roster, std::uint32_t teams, std::uint64_t frame) {
  CHECK_GE(teams, 1U);
  const std::size_t slots = roster.slots.size(), count = std::min<std::size_t>(teams, slots);
  std::vector<Roster> manned;
  for (std::size_t team = 0; team < count; ++team) {
    const auto begin = roster.slots.begin() + std::ptrdiff_t(team * slots / count);
    const auto end = roster.slots.begin() + std::ptrdiff_t((team + 1) * slots / count);
    if (std::any_of(begin, end, [](WorkerId worker) { return worker != 0; })) manned.push_back({{begin, end}});
  }
  if (manned.empty()) return {roster, {frame, 1}};
  return {manned[frame % manned.size()], {frame / manned.size(), std::uint32_t(manned.size())}};
}

}  // namespace slabstream
