#include "coordinator/frames/frames_in_flight.h"

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

std::uint32_t FramesInFlight::unfinished_groups() const {
  std::uint32_t unfinished = 0;
  for (const RunningFrame& frame : frames_) unfinished += frame.unfinished_groups();
  return unfinished;
}

bool FramesInFlight::RunsFor(PeerToken client) const {
  return std::ranges::any_of(frames_, [client](const RunningFrame& frame) { return frame.request().client == client; });
}

// If f frames such as one fit, it takes at most the f-th part of the room.
bool FramesInFlight::HasRoomFor(const PlanMade& plan) const {
  constexpr double kRounding = 1e-9;
  double taken = 1.0 / *plan.frame->fit;
  for (const RunningFrame& frame : frames_) taken += 1.0 / frame.fit();
  return frames_.empty() || taken <= plan.frame->plan.turn.teams + kRounding;
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

bool FramesInFlight::MayStart(PeerToken client, const PlanMade& plan, std::size_t workers) {
  if (OnTrial() != nullptr) return false;
  const FrameWindow window = Window(workers);
  if (frames_.size() < std::size_t(window.frames) && unfinished_groups() < std::uint32_t(window.groups)) return true;
  if (RunsFor(client)) return false;
  // Beyond the window, images take kWindowBytes more than in it.
  std::int64_t largest = FrameBytes(plan.frame->plan.setup), bytes = largest;
  for (const RunningFrame& frame : frames_) {
    const std::int64_t of_frame = FrameBytes(frame.plan().setup);
    largest = std::max(largest, of_frame);
    bytes += of_frame;
  }
  return bytes <= kWindowBytes + window.frames * largest;
}

// A worker that holds f frames such as one holds as many groups of it (HasRoomFor).
bool FramesInFlight::HasRoomForGroup(const RunningFrame& of) const {
  double taken = 1.0 / of.fit();
  std::int64_t bytes = FrameBytes(of.plan().setup);
  for (const RunningFrame& frame : frames_) {
    const std::uint32_t groups = std::max(frame.unfinished_groups(), 1U);
    taken += double(groups) / frame.fit();
    bytes += groups * FrameBytes(frame.plan().setup);
  }
  return taken <= of.plan().turn.teams && bytes <= kWindowBytes;
}

RunningFrame* FramesInFlight::NextToHandOut(std::size_t workers) {
  if (RunningFrame* const tried = OnTrial()) return tried->CanHandOut() ? tried : nullptr;
  const FrameWindow window = Window(workers);
  const bool full = unfinished_groups() >= std::uint32_t(window.groups);
  const auto on_their_way = [this](PeerToken client) {
    std::uint32_t groups = 0;
    for (const RunningFrame& frame : frames_) groups += frame.request().client == client ? frame.unfinished_groups() : 0;
    return groups;
  };
  const auto may_go_beyond = [&](const RunningFrame& frame) {
    const std::uint32_t groups = on_their_way(frame.request().client);
    return groups == 0 || (groups == 1 && HasRoomForGroup(frame));
  };
  const auto next = std::ranges::find_if(frames_, [&](const RunningFrame& frame) {
    const bool masked = UsesOcclusion(frame.plan().setup);
    return frame.CanHandOut() && (!masked || frame.unfinished_groups() < std::uint32_t(kMaskedGroups)) && (!full || may_go_beyond(frame));
  });
  return next == frames_.end() ? nullptr : &*next;
}

}  // namespace slabstream
