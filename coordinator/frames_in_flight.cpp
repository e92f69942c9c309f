#include "coordinator/frames_in_flight.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace slabstream {

RunningFrame& FramesInFlight::Add(RunningFrame frame) {
  CHECK(HasRoom());
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
  const auto frame = std::find_if(frames_.begin(), frames_.end(), [id](const RunningFrame& f) { return f.id() == id; });
  return frame == frames_.end() ? nullptr : &*frame;
}

RunningFrame* FramesInFlight::FindRequest(PeerToken client, RequestId request) {
  const auto frame = std::find_if(frames_.begin(), frames_.end(), [&](const RunningFrame& f) { return f.request().Is(client, request); });
  return frame == frames_.end() ? nullptr : &*frame;
}

std::uint32_t FramesInFlight::unfinished_groups() const {
  std::uint32_t count = 0;
  for (const RunningFrame& frame : frames_) count += frame.unfinished_groups();
  return count;
}

RunningFrame* FramesInFlight::NextToHandOut() {
  const auto frame = std::find_if(frames_.begin(), frames_.end(), [](const RunningFrame& f) { return f.CanHandOut(); });
  return frame == frames_.end() ? nullptr : &*frame;
}

}  // namespace slabstream
