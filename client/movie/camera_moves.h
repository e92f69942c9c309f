// The views of a movie's frames: turns about the volume's z axis, or a path of cameras. All frames frame what shows in any of them, so the
// volume does not breathe.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/view/camera_path.h"
#include "common/wire/client_messages.h"

namespace slabstream {

struct CameraMove {
  int turns = 1;                         // full turns, which begin at the request's azimuth; 0: the view is fixed
  std::vector<PathCamera> cameras = {};  // instead of turns; what their views leave out is the volume's
};

using AskView = std::function<Result<ViewReply>(ViewQuery)>;  // to the service

// `frames` > 0 of them, complete. The path begins with the first frame and ends with the last one. `volumes`: a request for each dataset
// and time that the movie shows, at least one; they have the same view. Errors are the service's and those of CameraPath.
Result<std::vector<ViewParameters>> ViewsOfMovie(const CameraMove& move, int frames, std::span<const FrameRequest> volumes,
                                                 const AskView& ask);

}  // namespace slabstream
