#include "client/request/camera_file.h"

#include <fmt/format.h>

#include <optional>

#include "client/request/request_options.h"
#include "common/base/files.h"
#include "common/view/default_view.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

Result<ViewParameters> ReadCamera(const Json& json) {
  FrameRequest request;
  request.view = kUnstatedView;
  std::optional<std::string> mistake;
  JsonValue(json, "", mistake).Fields(OptionFields(request, {"view."}));
  if (mistake) return Status::InvalidArgument(*mistake);
  if (Status status = Validate(request.view); !status.ok()) return status;
  return request.view;
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

Result<ViewParameters> ParseCameraFile(const std::string& option, const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 16;
  const Result<std::string> text = ReadTextFile(path, kMostBytes);
  if (!text.ok()) return Status(text.status().code(), fmt::format("{} {}", option, text.status().message()));
  Result<ViewParameters> view = ParseCamera(*text);
  if (!view.ok()) return Status::InvalidArgument(fmt::format("{} {}: {}", option, path, view.status().message()));
  return view;
}

}  // namespace slabstream
