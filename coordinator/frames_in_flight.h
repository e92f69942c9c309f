// FramesInFlight: the frames that run now, oldest first, and which earlier ones are over. At most kMaxFramesInFlight run, so that the next
// frame's first group renders while the last one combines.
#pragma once

#include <list>
#include <vector>

#include "common/planning/frame_window.h"
#include "coordinator/running_frame.h"

namespace slabstream {

class FramesInFlight {
 public:
  bool HasRoom() const { return frames_.size() < std::size_t(kMaxFramesInFlight); }
  FrameId next_id() const { return last_id_ + 1; }
  RunningFrame& Add(RunningFrame frame);  // frame.id() == next_id(), HasRoom()
  void Remove(FrameId id);                // it is over

  RunningFrame* Find(FrameId id);                                  // null: not in flight
  RunningFrame* FindRequest(PeerToken client, RequestId request);  // null: not in flight
  std::uint32_t unfinished_groups() const;                         // of all frames
  RunningFrame* NextToHandOut();                                   // the oldest frame with a group left; null: none

  // What workers may forget: all frames before finished_before(), and cancelled(), the newest kMaxCancelled that are over though their id
  // is larger.
  FrameId finished_before() const { return frames_.empty() ? next_id() : frames_.front().id(); }
  const std::vector<FrameId>& cancelled() const { return over_; }

  std::size_t size() const { return frames_.size(); }
  auto begin() { return frames_.begin(); }
  auto end() { return frames_.end(); }
  auto begin() const { return frames_.begin(); }
  auto end() const { return frames_.end(); }

 private:
  std::list<RunningFrame> frames_;  // references stay valid
  std::vector<FrameId> over_;       // not smaller than finished_before(), ascending
  FrameId last_id_ = 0;
};

}  // namespace slabstream
