#include "common/simulation/hand_outs.h"

#include <algorithm>

#include "common/planning/frame_occlusion.h"
#include "common/planning/frame_window.h"

namespace slabstream {

void HandOuts::OnPicture(std::uint32_t frame) { in_flight_.erase(std::find(in_flight_.begin(), in_flight_.end(), frame)); }

bool HandOuts::MayGoOn(std::uint32_t number) const {
  const Frame& frame = frames_[number];
  const FramePlan& plan = *inputs_[number].plan;
  return frame.next_group < plan.groups.size() && (!UsesOcclusion(plan.setup) || frame.open() < std::uint32_t(kMaskedGroups));
}

HandOuts::Next HandOuts::Take() {
  std::uint32_t unfinished = 0, teams = 1;
  std::int64_t frame_bytes = 0;
  for (const std::uint32_t frame : in_flight_) {
    const FramePlan& plan = *inputs_[frame].plan;
    unfinished += frames_[frame].open();
    frame_bytes = std::max(frame_bytes, FrameBytes(plan.setup));
    teams = std::max(teams, plan.turn.teams);
  }
  const FrameWindow window = WindowFor(workers_, teams, frame_bytes);
  if (unfinished >= std::uint32_t(window.groups)) return {};
  const auto open = std::find_if(in_flight_.begin(), in_flight_.end(), [&](std::uint32_t frame) { return MayGoOn(frame); });
  if (open != in_flight_.end()) return {Next::Kind::kGroup, *open, frames_[*open].next_group++};
  if (waiting_.empty() || in_flight_.size() >= std::size_t(window.frames)) return {};
  const std::uint32_t frame = waiting_.front();
  waiting_.pop_front();
  in_flight_.push_back(frame);
  return {Next::Kind::kPlan, frame};
}

}  // namespace slabstream
