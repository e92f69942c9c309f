// Suspects: the parts of a frame that may be what kills workers. One death proves nothing, and neither do two: workers are also killed for
// other reasons, with whatever they hold. So a part that two workers have died with is tried once more, alone: on a worker that renders
// nothing else, while no other frame has anything under way. If this worker dies too, the frame is to blame.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/planning/frame_plan.h"

namespace slabstream {

class Suspects {
 public:
  using Part = std::optional<BoxId>;  // nullopt: the picture

  // A worker has died while it held these. Nullopt: it may be chance; else the name of a part that two other workers have died with before.
  std::optional<std::string> OnDeath(const std::vector<Part>& held);
  // A group was finished for the first time.
  void Acquit() { deaths_.clear(); }

  bool any() const;  // something is to be tried alone
  std::set<BoxId> boxes() const;

 private:
  static constexpr int kSuspect = 2, kGuilty = 3;
  std::map<Part, int> deaths_;  // deaths of workers that held the part
};

}  // namespace slabstream
