// Cameras as JSON, for files and requests.
//
// A camera is an object of the view's options, "azimuth": 30. What it leaves out is the default view's.
#pragma once

#include <string>

#include "client/request/json_value.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

Json CameraJson(const ViewParameters& view);
// What --save-camera writes.
std::string CameraText(const ViewParameters& view);
// InvalidArgument, one line.
Result<ViewParameters> ParseCamera(const std::string& text);

// The same of a file, for an option. InvalidArgument, NotFound, ...: one line that begins with the option and the file.
Result<ViewParameters> ParseCameraFile(const std::string& option, const std::string& path);

}  // namespace slabstream
