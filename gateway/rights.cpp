#include "gateway/rights.h"

#include <fmt/format.h>

#include <utility>

#include "client/request/request_options.h"
#include "client/request/values.h"
#include "common/base/printable.h"

namespace slabstream {
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

std::vector<std::string> NamedDatasets(const PictureFields& fields) {
  std::vector<std::string> named;
  for (const auto& [name, text] : fields) {
    if (name == "dataset") named.push_back(text);
    const RequestOption* const option = FindRequestOption(name);
    if (option == nullptr || option->path != "shapes") continue;
    const Result<ShapeChoice> shape = ParseShape(name, text);
    if (shape.ok()) named.push_back(shape->shape);  // what is wrong is refused by whoever makes the picture
  }
  return named;
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
