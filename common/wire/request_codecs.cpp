#include <algorithm>
#include "common/planning/validate_request.h"
#include "common/wire/codecs.h"
#include "common/wire/wire_text.h"

namespace slabstream {

static_assert(v1::Projection_MAX == static_cast<int>(Projection::kPerspective));
static_assert(v1::AxisChoice_MAX == static_cast<int>(AxisChoice::kView) + 1);

// Validate checks most ranges of these values, once for the whole FrameRequest. Checked here: what a struct cannot hold, what must be known
// before, and what is not a number, so that the message names the field as the schema does.

v1::ImageSize ToProto(const ImageSize& in) {
  v1::ImageSize out;
  out.set_width(static_cast<std::uint32_t>(in.width));
  out.set_height(static_cast<std::uint32_t>(in.height));
  return out;
}

ImageSize FromProto(const v1::ImageSize& in, Checker& check) {
  return {.width = static_cast<int>(check.Range("width", in.width(), 1, kMaxImageSide)),
          .height = static_cast<int>(check.Range("height", in.height(), 1, kMaxImageSide))};
}

v1::ViewParameters ToProto(const ViewParameters& in) {
  v1::ViewParameters out;
  out.set_projection(WireEnum<v1::Projection>(in.projection, Projection::kOrthographic));
  out.set_azimuth_degrees(in.azimuth_degrees);
  out.set_elevation_degrees(in.elevation_degrees);
  out.set_roll_degrees(in.roll_degrees);
  out.set_zoom(in.zoom);
  out.set_fov_degrees(in.fov_degrees);
  return out;
}

ViewParameters FromProto(const v1::ViewParameters& in, Checker& check) {
  ViewParameters out;
  out.projection = check.OneOf("projection", in.projection(), Projection::kOrthographic, Projection::kPerspective);
  out.azimuth_degrees = check.Finite("azimuth_degrees", in.azimuth_degrees());
  out.elevation_degrees = check.Finite("elevation_degrees", in.elevation_degrees());
  out.roll_degrees = check.Finite("roll_degrees", in.roll_degrees());
  out.zoom = check.Finite("zoom", in.zoom());
  out.fov_degrees = check.Finite("fov_degrees", in.fov_degrees());
  return out;
}

v1::ColorPoint ToProto(const ColorPoint& in) {
  v1::ColorPoint out;
  out.set_value(in.value);
  out.set_r(in.color.r);
  out.set_g(in.color.g);
  out.set_b(in.color.b);
  return out;
}

ColorPoint FromProto(const v1::ColorPoint& in, Checker& check) {
  return {.value = check.Finite("value", in.value()),
          .color = {check.Finite("r", in.r()), check.Finite("g", in.g()), check.Finite("b", in.b())}};
}

v1::OpacityPoint ToProto(const OpacityPoint& in) {
  v1::OpacityPoint out;
  out.set_value(in.value);
  out.set_opacity(in.opacity);
  out.set_midpoint(in.midpoint);
  out.set_sharpness(in.sharpness);
  return out;
}

OpacityPoint FromProto(const v1::OpacityPoint& in, Checker& check) {
  return {.value = check.Finite("value", in.value()),
          .opacity = check.Finite("opacity", in.opacity()),
          .midpoint = check.Finite("midpoint", in.midpoint()),
          .sharpness = check.Finite("sharpness", in.sharpness())};
}

v1::TransferFunction ToProto(const TransferFunction& in) {
  v1::TransferFunction out;
  WriteAll(in.colors, out.mutable_colors());
  WriteAll(in.opacities, out.mutable_opacities());
  out.set_opacity_distance(in.opacity_distance);
  return out;
}

TransferFunction FromProto(const v1::TransferFunction& in, Checker& check) {
  TransferFunction out;
  out.colors = ReadAll("colors", in.colors(), kMaxTransferPoints, check);
  out.opacities = ReadAll("opacities", in.opacities(), kMaxTransferPoints, check);
  out.opacity_distance = check.Finite("opacity_distance", in.opacity_distance());
  return out;
}

v1::TransferChoice ToProto(const TransferChoice& in) {
  v1::TransferChoice out;
  if (const auto* preset = std::get_if<std::string>(&in.choice)) {
    out.set_preset(WireText(*preset, kMaxNameBytes));
  } else {
    *out.mutable_function() = ToProto(std::get<TransferFunction>(in.choice));
  }
  out.set_opacity_distance(in.opacity_distance);
  return out;
}

TransferChoice FromProto(const v1::TransferChoice& in, Checker& check) {
  TransferChoice out;
  switch (in.choice_case()) {
    case v1::TransferChoice::kPreset: out.choice = check.Text("preset", in.preset(), 1, kMaxNameBytes); break;
    case v1::TransferChoice::kFunction: out.choice = Read("function", in.function(), check); break;
    case v1::TransferChoice::CHOICE_NOT_SET: check.Fail("choice", "not set, expected preset or function"); break;
  }
  out.opacity_distance = check.Finite("opacity_distance", in.opacity_distance());
  return out;
}

v1::Shading ToProto(const Shading& in) {
  v1::Shading out;
  out.set_phong(in.phong);
  WriteAll(in.lights, out.mutable_lights());
  out.set_ambient(in.ambient);
  out.set_diffuse(in.diffuse);
  out.set_specular(in.specular);
  out.set_shininess(in.shininess);
  return out;
}

Shading FromProto(const v1::Shading& in, Checker& check) {
  Shading out;
  out.phong = in.phong();
  out.lights = ReadAll("lights", in.lights(), kMaxLights, check);
  out.ambient = check.Finite("ambient", in.ambient());
  out.diffuse = check.Finite("diffuse", in.diffuse());
  out.specular = check.Finite("specular", in.specular());
  out.shininess = check.Finite("shininess", in.shininess());
  return out;
}

v1::Policy ToProto(const Policy& in) {
  v1::Policy out;
  out.set_decomposition(WireText(in.decomposition, kMaxNameBytes));
  out.set_axis(WireEnum<v1::AxisChoice>(in.axis, AxisChoice::kX));
  out.set_groups(static_cast<std::uint32_t>(in.groups));
  out.set_combine(WireText(in.combine, kMaxNameBytes));
  out.set_load_metric(WireText(in.load_metric, kMaxNameBytes));
  out.set_assignment(WireText(in.assignment, kMaxNameBytes));
  out.set_balance(WireText(in.balance, kMaxNameBytes));
  out.set_pixel_error(in.pixel_error);
  out.set_teams(static_cast<std::uint32_t>(in.teams));
  return out;
}

Policy FromProto(const v1::Policy& in, Checker& check) {
  Policy out;
  out.decomposition = check.Text("decomposition", in.decomposition(), 1, kMaxNameBytes);
  out.axis = check.OneOf("axis", in.axis(), AxisChoice::kX, AxisChoice::kView);
  out.groups = static_cast<int>(check.Range("groups", in.groups(), 0, kMaxGroups));
  out.combine = check.Text("combine", in.combine(), 1, kMaxNameBytes);
  out.load_metric = check.Text("load_metric", in.load_metric(), 1, kMaxNameBytes);
  out.assignment = check.Text("assignment", in.assignment(), 1, kMaxNameBytes);
  out.balance = check.Text("balance", in.balance(), 1, kMaxNameBytes);
  out.pixel_error = check.Between("pixel_error", in.pixel_error(), 0, kMaxPixelError);
  out.teams = std::max(1, static_cast<int>(check.Range("teams", in.teams(), 0, kMaxTeams)));  // 0: left out
  return out;
}

v1::FrameRequest ToProto(const FrameRequest& in) {
  v1::FrameRequest out;
  out.set_dataset(WireText(in.dataset, kMaxNameBytes));
  out.set_renderer(WireText(in.renderer, kMaxNameBytes));
  for (const auto& [name, text] : in.parameters) {
    v1::Parameter& parameter = *out.add_parameters();
    parameter.set_name(WireText(name, kMaxNameBytes));
    parameter.set_text(WireText(text, kMaxNameBytes));
  }
  *out.mutable_size() = ToProto(in.size);
  *out.mutable_view() = ToProto(in.view);
  *out.mutable_transfer() = ToProto(in.transfer);
  *out.mutable_shading() = ToProto(in.shading);
  out.set_termination(in.termination);
  *out.mutable_policy() = ToProto(in.policy);
  out.set_previews(in.previews);
  return out;
}

FrameRequest FromProto(const v1::FrameRequest& in, Checker& check) {
  FrameRequest out;
  out.dataset = check.Text("dataset", in.dataset(), 1, kMaxNameBytes);
  if (!in.renderer().empty()) out.renderer = check.Text("renderer", in.renderer(), 1, kMaxNameBytes);
  const int parameters = check.Count("parameters", in.parameters_size(), kMaxParameters);
  for (int i = 0; i < parameters; ++i) {
    const auto scope = check.In("parameters", std::size_t(i));
    const std::string name = check.Text("name", in.parameters(i).name(), 1, kMaxNameBytes);
    check.That(out.parameters.emplace(name, check.Text("text", in.parameters(i).text(), 1, kMaxNameBytes)).second, "name", "given twice");
  }
  out.size = Read("size", in.size(), check);
  out.view = Read("view", in.view(), check);
  out.transfer = Read("transfer", in.transfer(), check);
  out.shading = Read("shading", in.shading(), check);
  out.termination = check.Finite("termination", in.termination());
  out.policy = Read("policy", in.policy(), check);
  out.previews = in.previews();
  if (check.ok()) check.Adopt(Validate(out));
  return out;
}

}  // namespace slabstream
