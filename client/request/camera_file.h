// Cameras and paths of cameras as JSON, for files and requests.
//
// A camera is an object of the view's options, "azimuth": 30. What it leaves out is the default view's. A path is a list of cameras, of
// which all or none have a "time" in seconds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/request/json_value.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/view/camera_path.h"

namespace slabstream {

Json CameraJson(const ViewParameters& view);
// What --save-camera writes.
std::string CameraText(const ViewParameters& view);
// InvalidArgument, one line.
Result<ViewParameters> ParseCamera(const std::string& text);

// Not as CameraPath wants it: the volume must fill in what the views leave out.
struct PathText {
  std::vector<PathCamera> cameras;  // evenly spaced if they are not timed
  bool timed = false;

  double seconds() const { return cameras.back().seconds - cameras.front().seconds; }
};
// InvalidArgument, one line that names the camera, counted from 1.
Result<PathText> ParseCameraPath(const std::string& text);

// The same of files, for an option. InvalidArgument, NotFound, ...: one line that begins with the option and the file.
Result<ViewParameters> ParseCameraFile(const std::string& option, const std::string& path);
Result<std::optional<PathText>> ParsePathFile(const std::string& option, const std::string& path);

}  // namespace slabstream
