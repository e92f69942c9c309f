#include "coordinator/frames/suspects.h"

#include <algorithm>

namespace slabstream {

std::optional<std::string> Suspects::OnDeath(const std::vector<Part>& held) {
  std::optional<std::string> guilty;
  for (const Part& part : held) {
    if (++deaths_[part] >= kGuilty) guilty = part ? "box " + std::to_string(*part) : "the picture";
  }
  return guilty;
}

bool Suspects::any() const {
  return std::ranges::any_of(deaths_, [](const auto& death) { return death.second >= kSuspect; });
}

std::set<BoxId> Suspects::boxes() const {
  std::set<BoxId> boxes;
  for (const auto& [part, count] : deaths_) {
    if (part && count >= kSuspect) boxes.insert(*part);
  }
  return boxes;
}

}  // namespace slabstream
