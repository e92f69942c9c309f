// HandOuts: which group the coordinator hands out next, by the service's rule: as many unfinished groups and frames as the window allows
// (common/planning/frame_window.h), those of older frames first, and of a frame whose groups carry masks a few at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "common/simulation/simulate_frames.h"

namespace slabstream {

class HandOuts {
 public:
  // `frames` outlive the object.
  HandOuts(std::span<const FrameInput> frames, std::size_t workers) : inputs_(frames), workers_(workers), frames_(frames.size()) {}

  void OnRequest(std::uint32_t frame) { waiting_.push_back(frame); }
  void OnGroupDone(std::uint32_t frame) { ++frames_[frame].groups_done; }
  void OnPicture(std::uint32_t frame);

  // What is to be done now; it counts as done.
  struct Next {
    enum class Kind : std::uint8_t { kNothing, kPlan, kGroup } kind = Kind::kNothing;
    std::uint32_t frame = 0, group = 0;
  };
  Next Take();

 private:
  struct Frame {
    std::uint32_t next_group = 0, groups_done = 0;
    std::uint32_t open() const { return next_group - groups_done; }
  };
  bool MayGoOn(std::uint32_t frame) const;

  const std::span<const FrameInput> inputs_;
  const std::size_t workers_;
  std::vector<Frame> frames_;
  std::deque<std::uint32_t> waiting_;    // not planned yet
  std::deque<std::uint32_t> in_flight_;  // oldest first
};

}  // namespace slabstream
