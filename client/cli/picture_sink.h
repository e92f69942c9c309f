// Where the finished pictures of a sequence of frames go: each into a file of its own (picture_files.h), or all into a movie (movie.h).
#pragma once

#include <string>

#include "client/client.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

// One of a sequence of frames.
struct FrameJob {
  FrameRequest request;
  std::string output;  // the file that the picture goes into; empty: none
  std::string source;  // SOURCE as it was typed, for records of pictures
};

// RenderFrames calls Put from threads of its own, and Finish after the last Put has returned.
class PictureSink {
 public:
  virtual ~PictureSink() = default;

  // Whether pictures come one after the other, in the order of their jobs. Else several may come at a time, in any order, and previews too.
  virtual bool in_order() const = 0;
  // Sets FrameRequest::straight8 and straight8_over as they suit the picture of this job. Any thread.
  virtual void ChooseCodes(const FrameJob& job, FrameRequest& request) const = 0;
  virtual Status Put(const Picture& picture, const FrameJob& job) = 0;
  // Instead of Put: this frame has failed. Never the first one in order.
  virtual Status Skip(const FrameJob& job) = 0;
  virtual Status Finish() = 0;
  // No picture will come any more. A Put or Finish that waits for somebody else returns soon, with an error. Any thread.
  virtual void Abandon() = 0;
};

}  // namespace slabstream
