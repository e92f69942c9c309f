// How far the frames are, on stderr: a bar that is redrawn if that is a terminal, else a line whenever something changes.
#pragma once

#include <string>

#include "common/wire/client_messages.h"

namespace slabstream {

class ProgressDisplay {
 public:
  ProgressDisplay(bool wanted, int frame_count, const std::string& label = "");  // label: what each text begins with
  ~ProgressDisplay();                                                            // clears the bar
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void Show(int frame, const FrameProgress& progress);  // frame: from 0
  void FrameDone(int frame);

 private:
  void Draw(double done, const std::string& text);

  bool wanted_, terminal_;
  std::string label_;
  int frame_count_, frames_done_ = 0;
  std::string last_;  // what stands there, so that nothing is said twice
};

// "queued, 2 before it", "loading the volume", "3 of 7 groups, 4 workers, attempt 2".
std::string Describe(const FrameProgress& progress);

}  // namespace slabstream
