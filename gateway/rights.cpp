#include "gateway/rights.h"

#include <fmt/format.h>

#include <utility>

#include "client/pictures/picture_writer.h"
#include "common/base/printable.h"

namespace slabstream {
namespace {

constexpr std::optional<Right> kNo = std::nullopt;

std::map<std::string, RouteRights, std::less<>> MakeRights() {
  using enum Right;
  std::map<std::string, RouteRights, std::less<>> rights = {
      // path, its right by GET, and by POST
      {"/livez", {kNone, kNo}},
      {"/readyz", {kNone, kNo}},
      {"/metrics", {kWatch, kNo}},
      {"/api/v1/openapi.json", {kNone, kNo}},
      {"/api/v1/options", {kNone, kNo}},
      {"/api/v1/access", {kView, kNo}},
      {"/api/v1/status", {kView, kNo}},
      {"/api/v1/datasets", {kView, kNo}},
      {"/api/v1/command", {kView, kView}},
      {"/api/v1/turntable.mp4", {kView, kView}},
      {"/api/v1/histogram", {kView, kNo}},
      {"/api/v1/joint-histogram", {kView, kNo}},
      {"/api/v1/labels", {kView, kNo}},
      {"/api/v1/value", {kView, kNo}},
      {"/api/v1/profile", {kView, kNo}},
      {"/api/v1/statistics", {kView, kNo}},
      {"/api/v1/pick", {kView, kView}},
      {"/api/v1/transfer", {kView, kNo}},
      {"/api/v1/parameters", {kView, kSteer}},
      {"/api/v1/upload", {kNo, kSend}},
      {"/api/v1/view", {kView, kNo}},
  };
  for (const PictureFileTypeNames& names : PictureFileTypes()) {
    for (const char* kind : {"render", "slice"}) rights[fmt::format("/api/v1/{}{}", kind, names.ending)] = {kView, kView};
  }
  return rights;
}

}  // namespace

const std::map<std::string, RouteRights, std::less<>>& AllRights() {
  static const auto rights = MakeRights();
  return rights;
}

std::optional<std::string> WhyNot(Right right, const Access& access) {
  if (access.view_only && (right == Right::kSteer || right == Right::kSend)) return "the token is view-only";
  if (access.datasets && (right == Right::kWatch || right == Right::kSend)) {
    return fmt::format("the token is for dataset {} alone", Printable(fmt::format("{}", fmt::join(*access.datasets, ", "))));
  }
  return std::nullopt;
}

Json AccessJson(const Access& access, bool takes_files) {
  using enum Right;
  Json rights = Json::array();
  for (const auto& [right, name] :
       {std::pair(kView, "view"), std::pair(kWatch, "watch"), std::pair(kSteer, "steer"), std::pair(kSend, "send")}) {
    if (!WhyNot(right, access) && (takes_files || right != kSend)) rights.push_back(name);
  }
  return {{"rights", std::move(rights)},
          {"datasets", access.datasets ? Json(*access.datasets) : Json()},
          {"exp", access.until != Access::kForEver ? Json(access.until) : Json()}};
}

std::optional<std::string> WhyNotShown(std::string_view dataset, const Access& access) {
  if (access.Shows(dataset)) return std::nullopt;
  return fmt::format("the token does not show dataset '{}'", Printable(std::string(dataset.substr(0, 128))));
}

StatusReply ShownStatus(StatusReply status, const Access& access) {
  if (!access.datasets) return status;
  std::erase_if(status.datasets, [&](const DatasetStatus& dataset) { return !access.Shows(dataset.name); });
  status.web.clear();
  return status;
}

Status ShownStatus(Status status, const Access& access) {
  if (!access.datasets || status.code() != StatusCode::kNotFound) return status;
  return Status::NotFound("there is no such dataset");
}

}  // namespace slabstream
