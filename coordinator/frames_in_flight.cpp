#include "coordinator/frames_in_flight.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/planning/frame_occlusion.h"

namespace slabstream {

RunningFrame& FramesInFlight::Add(RunningFrame frame) {
  CHECK_EQ(frame.id(), next_id());
  last_id_ = frame.id();
  return frames_.emplace_back(std::move(frame));
}

void FramesInFlight::Remove(FrameId id) {
  frames_.remove_if([id](const RunningFrame& frame) { return frame.id() == id; });
  over_.insert(std::upper_bound(over_.begin(), over_.end(), id), id);
  std::erase_if(over_, [this](FrameId over) { return over < finished_before(); });
  if (over_.size() > kMaxCancelled) over_.erase(over_.begin());
}

RunningFrame* FramesInFlight::Find(FrameId id) {
  const auto frame = std::ranges::find(frames_, id, &RunningFrame::id);
  return frame == frames_.end() ? nullptr : &*frame;
}

RunningFrame* FramesInFlight::FindRequest(PeerToken client, RequestId request) {
  const auto frame = std::ranges::find_if(frames_, [&](const RunningFrame& f) { return f.request().Is(client, request); });
  return frame == frames_.end() ? nullptr : &*frame;
}

FrameWindow FramesInFlight::Window(std::size_t workers) const {
  std::int64_t frame_bytes = 0;
  std::uint32_t teams = 1;
  int fit = kMostInWindow;
  for (const RunningFrame& frame : frames_) {
    frame_bytes = std::max(frame_bytes, FrameBytes(frame.plan().setup));
    teams = std::max(teams, frame.plan().turn.teams);
    fit = std::min(fit, frame.fit());
  }
  return WindowFor(workers, teams, frame_bytes, fit);
}

// Frames of other sizes count as if they took as much as this one, or as the largest that runs: a mixture takes less.
bool FramesInFlight::HasRoomFor(const PlanMade& plan) const {
  const auto teams = std::size_t(plan.frame->plan.turn.teams);
  return frames_.empty() || frames_.size() < std::size_t(plan.fit) * teams;
}

std::size_t FramesInFlight::Room(std::size_t workers) const {
  const auto frames = std::size_t(Window(workers).frames);
  return frames - std::min(frames, frames_.size());
}

RunningFrame* FramesInFlight::OnTrial() {
  const auto frame = std::ranges::find_if(frames_, &RunningFrame::has_suspects);
  return frame == frames_.end() ? nullptr : &*frame;
}

bool FramesInFlight::OthersWait(const RunningFrame& frame) const {
  return std::ranges::any_of(frames_, [&](const RunningFrame& other) { return &other != &frame && other.waiting(); });
}

FramesInFlight::Choice FramesInFlight::Next(std::size_t workers) {
  if (RunningFrame* const tried = OnTrial()) return tried->CanHandOut() ? Choice{Step::kHandOut, tried} : Choice{};
  const FrameWindow window = Window(workers);
  std::uint32_t unfinished = 0;
  for (const RunningFrame& frame : frames_) unfinished += frame.unfinished_groups();
  if (unfinished >= std::uint32_t(window.groups)) return {};
  const auto next = std::ranges::find_if(frames_, [](const RunningFrame& frame) {
    const bool masked = UsesOcclusion(frame.plan().setup);
    return frame.CanHandOut() && (!masked || frame.unfinished_groups() < std::uint32_t(kMaskedGroups));
  });
  if (next != frames_.end()) return {Step::kHandOut, &*next};
  return {frames_.size() < std::size_t(window.frames) ? Step::kStart : Step::kWait};
}

}  // namespace slabstream
