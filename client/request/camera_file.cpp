#include "client/request/camera_file.h"

#include <fmt/format.h>

#include <utility>

#include "client/request/request_options.h"
#include "common/files/files.h"
#include "common/view/default_view.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

constexpr double kMostSeconds = 1e6;

// `more`: a field beside those of the view.
Result<ViewParameters> ReadCamera(const Json& json, const std::vector<std::pair<std::string, JsonValue::Read>>& more = {}) {
  FrameRequest request;
  request.view = kUnstatedView;
  std::optional<std::string> mistake;
  auto fields = OptionFields(request, {"view."});
  fields.insert(fields.end(), more.begin(), more.end());
  JsonValue(json, "", mistake).Fields(fields);
  if (mistake) return Status::InvalidArgument(*mistake);
  if (Status status = Validate(request.view); !status.ok()) return status;
  return request.view;
}

// What `parse` makes of the file's text.
template <class T>
Result<T> ParseFile(const std::string& option, const std::string& path, std::size_t most_bytes, Result<T> (*parse)(const std::string&)) {
  const Result<std::string> text = ReadTextFile(path, most_bytes);
  if (!text.ok()) return Status(text.status().code(), fmt::format("{} {}", option, text.status().message()));
  Result<T> parsed = parse(*text);
  if (!parsed.ok()) return Status::InvalidArgument(fmt::format("{} {}: {}", option, path, parsed.status().message()));
  return parsed;
}

}  // namespace

Json CameraJson(const ViewParameters& view) {
  FrameRequest request;
  request.view = view;
  return OptionsJson(request, "view.");
}

std::string CameraText(const ViewParameters& view) { return CameraJson(view).dump(1) + "\n"; }

Result<ViewParameters> ParseCamera(const std::string& text) {
  const Result<Json> json = ParseJson(text);
  if (!json.ok()) return json.status();
  return ReadCamera(*json);
}

Result<PathText> ParseCameraPath(const std::string& text) {
  const Result<Json> json = ParseJson(text);
  if (!json.ok()) return json.status();
  if (!json->is_array() || json->size() < kMinPathCameras || json->size() > kMaxPathCameras) {
    return Status::InvalidArgument(fmt::format("a path is a list of {} to {} cameras", kMinPathCameras, kMaxPathCameras));
  }
  PathText path;
  for (const Json& camera : *json) {
    const std::size_t number = path.cameras.size() + 1;
    std::optional<double> seconds;
    const auto read_time = [&](const JsonValue& value) { seconds = value.Number({-kMostSeconds, kMostSeconds}); };
    const Result<ViewParameters> view = ReadCamera(camera, {{"time", read_time}});
    if (!view.ok()) return Status::InvalidArgument(fmt::format("camera {} of the path: {}", number, view.status().message()));
    if (number == 1) path.timed = seconds.has_value();
    if (seconds.has_value() != path.timed) {
      return Status::InvalidArgument(fmt::format("camera {} of the path has {} time, but the first one has {}", number,
                                                 seconds ? "a" : "no", seconds ? "none" : "one"));
    }
    path.cameras.push_back({seconds.value_or(double(number - 1)), *view});
  }
  return path;
}

Result<ViewParameters> ParseCameraFile(const std::string& option, const std::string& path) {
  return ParseFile(option, path, std::size_t{1} << 16, ParseCamera);
}

Result<std::optional<PathText>> ParsePathFile(const std::string& option, const std::string& path) {
  Result<PathText> parsed = ParseFile(option, path, std::size_t{1} << 20, ParseCameraPath);
  if (!parsed.ok()) return parsed.status();
  return std::optional(*std::move(parsed));
}

}  // namespace slabstream
