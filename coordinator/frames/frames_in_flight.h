// FramesInFlight: the frames that run now, oldest first, and which earlier ones are over. The window (common/planning/frame_window.h)
// limits the running frames and their groups. But no client waits because of the frames of others. A client without a frame may have one
// frame beyond the window, as far as memory allows. A client without a group on its way may have one group beyond the window, and a second
// one as far as memory allows: voxels of the next group are read, and workers that are done with theirs go on, while the first one is
// rendered. Workers share their time among clients.
#pragma once

#include <list>
#include <vector>

#include "common/planning/frame_window.h"
#include "coordinator/frames/running_frame.h"

namespace slabstream {

class FramesInFlight {
 public:
  FrameId next_id() const { return last_id_ + 1; }
  RunningFrame& Add(RunningFrame frame);  // frame.id() == next_id()
  void Remove(FrameId id);                // it is over

  RunningFrame* Find(FrameId id);                                  // null: not in flight
  RunningFrame* FindRequest(PeerToken client, RequestId request);  // null: not in flight

  // The oldest frame that may hand out a group to `workers` workers; null: none may.
  RunningFrame* NextToHandOut(std::size_t workers);
  // The oldest frame that has suspects. As long as it has any, no other frame is handed out or started. Null: no frame has suspects.
  RunningFrame* OnTrial();
  // Whether any frame but this one waits for workers.
  bool OthersWait(const RunningFrame& frame) const;
  // How many more frames `workers` workers may have under way, whoever asks for them.
  std::size_t Room(std::size_t workers) const;
  // Whether `workers` workers may be given another frame, of this client and plan.
  bool MayStart(PeerToken client, const PlanMade& plan, std::size_t workers);
  // Whether the workers' memory has room for a frame of this plan beside those that run.
  bool HasRoomFor(const PlanMade& plan) const;
  bool RunsFor(PeerToken client) const;

  // Frames that workers may forget: all before finished_before(), and those in cancelled(). These are the newest kMaxCancelled of the later
  // frames that are over.
  FrameId finished_before() const { return frames_.empty() ? next_id() : frames_.front().id(); }
  const std::vector<FrameId>& cancelled() const { return over_; }

  std::size_t size() const { return frames_.size(); }
  auto begin() { return frames_.begin(); }
  auto end() { return frames_.end(); }
  auto begin() const { return frames_.begin(); }
  auto end() const { return frames_.end(); }

 private:
  FrameWindow Window(std::size_t workers) const;
  std::uint32_t unfinished_groups() const;
  bool HasRoomForGroup(const RunningFrame& of) const;  // beyond the window

  std::list<RunningFrame> frames_;  // references stay valid
  std::vector<FrameId> over_;       // not smaller than finished_before(), ascending
  FrameId last_id_ = 0;
};

}  // namespace slabstream
