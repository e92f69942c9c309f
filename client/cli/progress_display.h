// The progress of frames on stderr.
#pragma once

#include <string>

#include "client/cli/progress_bar.h"
#include "common/base/read_share.h"
#include "common/wire/client_messages.h"

namespace slabstream {

class ProgressDisplay {
 public:
  ProgressDisplay(bool wanted, int frame_count, const std::string& label = "");  // label: begins each text

  void Show(int frame, const FrameProgress& progress, const std::string& source);  // frame: from 0; of which volume
  void FrameDone(int frame);

 private:
  ProgressBar bar_;
  std::string label_;
  int frame_count_, frames_done_ = 0;
};

// "queued, 2 before it", "reading scan.nii.gz: 45 % (310 MiB/s)", "3 of 7 groups, 4 workers, attempt 2".
std::string Describe(const FrameProgress& progress, const std::string& source);
// "reading scan.nii.gz: 45 % (310 MiB/s)". `source`: a path with options, or the name of a dataset.
std::string Describe(const ReadShare& read, const std::string& source);

}  // namespace slabstream
