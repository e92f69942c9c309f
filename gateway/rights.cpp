#include "gateway/rights.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

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

std::vector<std::string> DatasetsOf(const FrameRequest& request) {
  std::vector<std::string> names = {request.dataset};
  for (const ShapeChoice& choice : request.shapes) names.push_back(choice.shape);
  return names;
}

Status Asker::MayRead(const std::vector<std::string>& datasets) const {
  const auto shown = [this](const std::string& name) { return access.Shows(name); };
  if (!std::ranges::all_of(datasets, shown)) return ShownStatus(Status::NotFound(""), access);
  if (reading) std::ranges::for_each(datasets, reading);
  return Status::Ok();
}

std::optional<std::size_t> WhoMakesRoom(std::span<const SessionPlace> places, std::string_view holder, Time now) {
  std::map<std::string_view, std::size_t> counts;
  for (const SessionPlace& place : places) ++counts[place.holder];
  const auto is_idle = [&](const SessionPlace& place) { return now - place.used >= kIdleAfter; };
  const auto rank = [&](const SessionPlace& place) { return std::tuple(is_idle(place), counts[place.holder], now - place.used); };
  const auto first = std::ranges::max_element(places, {}, rank);
  if (first == places.end() || !(is_idle(*first) || counts[first->holder] >= counts[holder] + 2)) return std::nullopt;
  return std::size_t(first - places.begin());
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
