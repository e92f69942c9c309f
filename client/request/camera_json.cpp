#include "client/request/camera_json.h"

#include <array>
#include <optional>
#include <string_view>

namespace slabstream {
namespace {

Vec3 ReadPoint(const JsonValue& value) {
  std::vector<double> numbers;
  value.Each([&](const JsonValue& v) { numbers.push_back(v.Number({-kMaxWorldCoordinate, kMaxWorldCoordinate})); });
  if (numbers.size() == 3) return {numbers[0], numbers[1], numbers[2]};
  value.Complain(value.Shown() + " must be three numbers");
  return {};
}

}  // namespace

// The structured binding names every field: if there is one more, it does not compile.
Json ViewJson(const ViewParameters& view) {
  const auto& [projection, azimuth, elevation, roll, zoom, fov, look_at, eye, up, distance, fit, of_patient] = view;
  Json json = {
      {"projection", NameOf(projection)}, {"azimuth", azimuth}, {"elevation", elevation}, {"roll", roll}, {"zoom", zoom}, {"fov", fov}};
  if (look_at) json["look_at"] = VectorJson(*look_at);
  if (eye) json["eye"] = VectorJson(*eye);
  if (up) json["up"] = VectorJson(*up);
  if (distance > 0) json["distance"] = distance;
  if (fit) json["fit"] = true;
  if (of_patient) json["of_patient"] = true;
  return json;
}

Json ClippingJson(const Clipping& clipping) {
  const auto& [box, slab, planes, mode] = clipping;
  Json json = {{"mode", int(mode)}};
  if (box) {
    const auto& [low, high, unit] = *box;
    json["box"] = {{"low", VectorJson(low)}, {"high", VectorJson(high)}, {"unit", int(unit)}};
  }
  if (slab) {
    const auto& [normal, through, index, thickness] = *slab;
    json["slab"] = {{"normal", VectorJson(normal)}, {"thickness", thickness}};
    if (through) json["slab"]["through"] = VectorJson(*through);
    if (index) json["slab"]["index"] = *index;
  }
  for (const auto& [normal, offset] : planes) json["planes"].push_back({{"normal", VectorJson(normal)}, {"offset", offset}});
  return json;
}

std::vector<std::pair<std::string, JsonValue::Read>> ViewFields(ViewParameters& view) {
  static constexpr std::array<std::string_view, 2> kProjections = {NameOf(Projection::kOrthographic), NameOf(Projection::kPerspective)};
  const NumberRange angle{-kMaxAngleDegrees, kMaxAngleDegrees};
  const auto number = [](double& target, NumberRange range) { return [&target, range](const JsonValue& v) { target = v.Number(range); }; };
  const auto point = [](std::optional<Vec3>& target) { return [&target](const JsonValue& v) { target = ReadPoint(v); }; };
  return {{"projection",
           [&view](const JsonValue& v) {
             view.projection = v.OneOf(kProjections) == 0 ? Projection::kOrthographic : Projection::kPerspective;
           }},
          {"azimuth", number(view.azimuth_degrees, angle)},
          {"elevation", number(view.elevation_degrees, angle)},
          {"roll", number(view.roll_degrees, angle)},
          {"zoom", number(view.zoom, {kMinZoom, kMaxZoom})},
          {"fov", number(view.fov_degrees, {kMinFovDegrees, kMaxFovDegrees})},
          {"look_at", point(view.look_at)},
          {"eye", point(view.eye)},
          {"up", point(view.up)},
          {"distance", number(view.distance, {0, kMaxWorldCoordinate})},
          {"fit", [&view](const JsonValue& v) { view.fit = v.Boolean(); }},
          {"of_patient", [&view](const JsonValue& v) { view.of_patient = v.Boolean(); }}};
}

Result<ViewParameters> ParseCamera(const std::string& text) {
  const Result<Json> json = ParseJson(text);
  if (!json.ok()) return json.status();
  ViewParameters view;
  std::optional<std::string> mistake;
  JsonValue(*json, "", mistake).Fields(ViewFields(view));
  if (mistake) return Status::InvalidArgument(*mistake);
  if (Status status = Validate(view); !status.ok()) return status;
  return view;
}

}  // namespace slabstream
