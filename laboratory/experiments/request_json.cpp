#include "laboratory/experiments/request_json.h"

#include <fmt/format.h>

#include <span>
#include <variant>

#include "client/request/camera_json.h"
#include "common/wire/digest.h"

namespace slabstream {
namespace {

// Structured bindings name every field of a type: if there is one more, they do not compile.

// Both only if there are any.
void AddSurfaces(const std::vector<Isosurface>& isosurfaces, const std::vector<GradientOpacityPoint>& gradient_opacities, Json& json) {
  for (const auto& [value, color, opacity] : isosurfaces) {
    const auto& [r, g, b] = color;
    json["isosurfaces"].push_back(Json::array({value, r, g, b, opacity}));
  }
  for (const auto& [slope, opacity] : gradient_opacities) json["gradient_opacities"].push_back(Json::array({slope, opacity}));
}

Json FunctionJson(const TransferFunction& function) {
  const auto& [colors, opacities, opacity_distance, isosurfaces, gradient_opacities] = function;
  Json color_points = Json::array(), opacity_points = Json::array();
  for (const auto& [value, color] : colors) {
    const auto& [r, g, b] = color;
    color_points.push_back(Json::array({value, r, g, b}));
  }
  for (const auto& [value, opacity, midpoint, sharpness] : opacities) {
    opacity_points.push_back(Json::array({value, opacity, midpoint, sharpness}));
  }
  Json json = {{"colors", color_points}, {"opacities", opacity_points}, {"opacity_distance", opacity_distance}};
  AddSurfaces(isosurfaces, gradient_opacities, json);
  return json;
}

Json SizeJson(const ImageSize& size) {
  const auto& [width, height] = size;
  return Json::array({width, height});
}

Json ShadingJson(const Shading& shading) {
  const auto& [model, lights, ambient, diffuse, specular, shininess] = shading;
  Json directions = Json::array();
  for (const Vec3& light : lights) directions.push_back(VectorJson(light));
  return {{"model", int(model)},         {"lights", directions},          {"ambient", Decimal(ambient)},
          {"diffuse", Decimal(diffuse)}, {"specular", Decimal(specular)}, {"shininess", Decimal(shininess)}};
}

Json PolicyJson(const Policy& policy) {
  const auto& [decomposition, split, axis, groups, assignment, balance, combine, pixel_error, teams] = policy;
  return {{"decomposition", decomposition},
          {"split", split},
          {"axis", NameOf(axis)},
          {"groups", groups},
          {"assignment", assignment},
          {"balance", balance},
          {"combine", combine},
          {"pixel_error", pixel_error},
          {"teams", teams}};
}

Json LabelsJson(const LabelChoice& labels) {
  const auto& [mode, tint, opacities, shown] = labels;
  Json json = {
      {"mode", mode == LabelMode::kTint ? "tint" : "surface"}, {"tint", tint}, {"opacities", Json::array()}, {"shown", Json::array()}};
  for (const auto& [value, opacity] : opacities) json["opacities"].push_back(Json::array({value, opacity}));
  for (const auto& [first, last] : shown) json["shown"].push_back(Json::array({first, last}));
  return json;
}

}  // namespace

std::string DigestText(std::string_view bytes) { return fmt::format("{:016x}", Digest(std::as_bytes(std::span(bytes)))); }

Json TransferJson(const TransferChoice& transfer) {
  const auto& [choice, opacity_distance, scalar_range, isosurfaces, gradient_opacities] = transfer;
  const auto* preset = std::get_if<std::string>(&choice);
  Json json = Json::object();
  if (preset != nullptr) {
    json["preset"] = *preset;
  } else {
    json["function"] = DigestText(FunctionJson(std::get<TransferFunction>(choice)).dump());
  }
  json["opacity_distance"] = opacity_distance;
  if (scalar_range) {
    const auto& [min, max, percentiles] = *scalar_range;
    json[percentiles ? "scalar_percentiles" : "scalar_range"] = Json::array({min, max});
  }
  AddSurfaces(isosurfaces, gradient_opacities, json);
  return json;
}

Json RequestJson(const FrameRequest& request) {
  const auto& [dataset, renderer, parameters, size, view, clipping, transfer, labels, overlay, shading, termination, policy, previews] =
      request;
  Json texts = Json::object();
  for (const auto& [name, text] : parameters) texts[name] = text;
  Json json = {{"dataset", dataset},
               {"renderer", renderer},
               {"parameters", texts},
               {"size", SizeJson(size)},
               {"view", ViewJson(view)},
               {"clipping", ClippingJson(clipping)},
               {"transfer", TransferJson(transfer)},
               {"shading", ShadingJson(shading)},
               {"termination", termination},
               {"previews", previews},
               {"policy", PolicyJson(policy)}};
  // Only if they are shown: keys of other trials stay what they were.
  if (labels) json["labels"] = LabelsJson(*labels);
  if (overlay) json["overlay"] = {{"transfer", TransferJson(overlay->transfer)}, {"weight", overlay->weight}};
  return json;
}

}  // namespace slabstream
