// What a client asks for.
#pragma once

#include "common/wire/about.h"
#include "common/wire/validate_request.h"
#include "common/wire/value_fields.h"
#include "slabstream/v1/frame.pb.h"

namespace slabstream {

static_assert(v1::Projection_MAX == static_cast<int>(Projection::kPerspective));
static_assert(v1::ClipUnit_MAX == static_cast<int>(ClipUnit::kPercent));
static_assert(v1::ClipMode_MAX == static_cast<int>(ClipMode::kCutAway));
static_assert(v1::LabelMode_MAX == static_cast<int>(LabelMode::kHighlight));
static_assert(v1::AxisChoice_MAX == static_cast<int>(AxisChoice::kView) + 1);

// The order is that of help texts. Limits stand in the schema; Validate checks them, once for the whole FrameRequest. Checked here: what a
// struct cannot hold, what must be known before, and what is not a number.

void Fields(auto& io, Is<ImageSize> auto& m) {
  using P = v1::ImageSize;
  io.Range("width", m.width, &P::width, &P::set_width, 1, kMaxImageSide);
  io.Range("height", m.height, &P::height, &P::set_height, 1, kMaxImageSide);
}

void Fields(auto& io, Is<ViewParameters> auto& m) {
  using P = v1::ViewParameters;
  io.OneOf("projection", m.projection, &P::projection, &P::set_projection, Projection::kOrthographic, Projection::kPerspective);
  io.Optional("azimuth_degrees", m.azimuth_degrees, &P::has_azimuth_degrees, &P::azimuth_degrees, &P::set_azimuth_degrees);
  io.Optional("elevation_degrees", m.elevation_degrees, &P::has_elevation_degrees, &P::elevation_degrees, &P::set_elevation_degrees);
  io.Any("of_patient", m.of_patient, &P::of_patient, &P::set_of_patient);
  io.Optional("look_at", m.look_at, &P::has_look_at, &P::look_at, &P::mutable_look_at);
  io.Optional("fit", m.fit, &P::has_fit, &P::fit, &P::set_fit);
  io.Optional("eye", m.eye, &P::has_eye, &P::eye, &P::mutable_eye);
  io.Optional("up", m.up, &P::has_up, &P::up, &P::mutable_up);
  io.Finite("distance", m.distance, &P::distance, &P::set_distance);
  io.Finite("roll_degrees", m.roll_degrees, &P::roll_degrees, &P::set_roll_degrees);
  io.Finite("zoom", m.zoom, &P::zoom, &P::set_zoom);
  io.Finite("fov_degrees", m.fov_degrees, &P::fov_degrees, &P::set_fov_degrees);
}

void Fields(auto& io, Is<ClipBox> auto& m) {
  using P = v1::ClipBox;
  io.Message("low", m.low, &P::low, &P::mutable_low);
  io.Message("high", m.high, &P::high, &P::mutable_high);
  io.OneOf("unit", m.unit, &P::unit, &P::set_unit, ClipUnit::kWorld, ClipUnit::kPercent);
}

void Fields(auto& io, Is<ClipPlane> auto& m) {
  using P = v1::ClipPlane;
  io.Message("normal", m.normal, &P::normal, &P::mutable_normal);
  io.Finite("offset", m.offset, &P::offset, &P::set_offset);
}

void Fields(auto& io, Is<ClipSlab> auto& m) {  // all but the index
  using P = v1::ClipSlab;
  io.Message("normal", m.normal, &P::normal, &P::mutable_normal);
  io.Optional("through", m.through, &P::has_through, &P::through, &P::mutable_through);
  io.Finite("thickness", m.thickness, &P::thickness, &P::set_thickness);
}

inline void Write(const ClipSlab& in, v1::ClipSlab& out) {
  WriteFields(in, out);
  if (in.index) out.set_slice(std::uint32_t(*in.index) + 1);
}
inline void Read(const v1::ClipSlab& in, ClipSlab& out, Checker& check) {
  ReadFields(in, out, check);
  const auto slice = std::int32_t(check.Range("slice", in.slice(), 0, kMaxVolumeSide));
  if (slice > 0) out.index = slice - 1;
}

void Fields(auto& io, Is<Clipping> auto& m) {
  using P = v1::Clipping;
  io.Optional("box", m.box, &P::has_box, &P::box, &P::mutable_box);
  io.Messages("clip_planes", m.planes, &P::clip_planes, &P::mutable_clip_planes, kMaxClipPlanes);
  io.OneOf("mode", m.mode, &P::mode, &P::set_mode, ClipMode::kKeep, ClipMode::kCutAway);
  io.Optional("slab", m.slab, &P::has_slab, &P::slab, &P::mutable_slab);
}

// P: the message that has the colour in fields of its own.
template <class P>
void ColorFields(auto& io, auto& color) {
  io.Finite("r", color.r, &P::r, &P::set_r);
  io.Finite("g", color.g, &P::g, &P::set_g);
  io.Finite("b", color.b, &P::b, &P::set_b);
}

void Fields(auto& io, Is<ColorPoint> auto& m) {
  using P = v1::ColorPoint;
  io.Finite("value", m.value, &P::value, &P::set_value);
  ColorFields<P>(io, m.color);
}

void Fields(auto& io, Is<OpacityPoint> auto& m) {
  using P = v1::OpacityPoint;
  io.Finite("value", m.value, &P::value, &P::set_value);
  io.Finite("opacity", m.opacity, &P::opacity, &P::set_opacity);
  io.Finite("midpoint", m.midpoint, &P::midpoint, &P::set_midpoint);
  io.Finite("sharpness", m.sharpness, &P::sharpness, &P::set_sharpness);
}

void Fields(auto& io, Is<Isosurface> auto& m) {
  using P = v1::Isosurface;
  io.Finite("value", m.value, &P::value, &P::set_value);
  ColorFields<P>(io, m.color);
  io.Finite("opacity", m.opacity, &P::opacity, &P::set_opacity);
}

void Fields(auto& io, Is<GradientOpacityPoint> auto& m) {
  using P = v1::GradientOpacityPoint;
  io.Finite("slope", m.slope, &P::slope, &P::set_slope);
  io.Finite("opacity", m.opacity, &P::opacity, &P::set_opacity);
}

void Fields(auto& io, Is<Material> auto& m) {
  using P = v1::Material;
  io.Finite("ambient", m.ambient, &P::ambient, &P::set_ambient);
  io.Finite("diffuse", m.diffuse, &P::diffuse, &P::set_diffuse);
  io.Finite("specular", m.specular, &P::specular, &P::set_specular);
  io.Finite("shininess", m.shininess, &P::shininess, &P::set_shininess);
}

void Fields(auto& io, Is<RegionCorner> auto& m) {
  using P = v1::RegionCorner;
  io.Finite("value", m.value, &P::value, &P::set_value);
  io.Finite("slope", m.slope, &P::slope, &P::set_slope);
}

void Fields(auto& io, Is<TransferRegion> auto& m) {
  using P = v1::TransferRegion;
  io.Messages("corners", m.corners, &P::corners, &P::mutable_corners, kMaxRegionCorners);
  ColorFields<P>(io, m.color);
  io.Finite("opacity", m.opacity, &P::opacity, &P::set_opacity);
  io.Finite("softness", m.softness, &P::softness, &P::set_softness);
}

void Fields(auto& io, Is<TransferFunction> auto& m) {
  using P = v1::TransferFunction;
  io.Messages("colors", m.colors, &P::colors, &P::mutable_colors, kMaxTransferPoints);
  io.Messages("opacities", m.opacities, &P::opacities, &P::mutable_opacities, kMaxTransferPoints);
  io.Finite("opacity_distance", m.opacity_distance, &P::opacity_distance, &P::set_opacity_distance);
  io.Messages("isosurfaces", m.isosurfaces, &P::isosurfaces, &P::mutable_isosurfaces, kMaxIsosurfaces);
  io.Messages("gradient_opacities", m.gradient_opacities, &P::gradient_opacities, &P::mutable_gradient_opacities, kMaxTransferPoints);
  io.Optional("material", m.material, &P::has_material, &P::material, &P::mutable_material);
  io.Messages("regions", m.regions, &P::regions, &P::mutable_regions, kMaxTransferRegions);
}

void Fields(auto& io, Is<ScalarRange> auto& m) {
  using P = v1::ScalarRange;
  io.Finite("min", m.min, &P::min, &P::set_min);
  io.Finite("max", m.max, &P::max, &P::set_max);
  io.Any("percentiles", m.percentiles, &P::percentiles, &P::set_percentiles);
}

void Fields(auto& io, Is<TransferChoice> auto& m) {
  using P = v1::TransferChoice;
  io.Either("preset", m.choice, &P::preset, &P::mutable_preset, "function", &P::has_function, &P::function, &P::mutable_function);
  io.Optional("scalar_range", m.scalar_range, &P::has_scalar_range, &P::scalar_range, &P::mutable_scalar_range);
  io.Finite("opacity_distance", m.opacity_distance, &P::opacity_distance, &P::set_opacity_distance);
  io.Messages("isosurfaces", m.isosurfaces, &P::isosurfaces, &P::mutable_isosurfaces, kMaxIsosurfaces);
  io.Messages("gradient_opacities", m.gradient_opacities, &P::gradient_opacities, &P::mutable_gradient_opacities, kMaxTransferPoints);
}

void Fields(auto& io, Is<LabelRange> auto& m) {
  using P = v1::LabelRange;
  io.Any("first", m.first, &P::first, &P::set_first);
  io.Any("last", m.last, &P::last, &P::set_last);
  io.Text("name", m.name, &P::name, &P::mutable_name, 0, kMaxNameBytes);
}

void Fields(auto& io, Is<LabelOpacity> auto& m) {
  using P = v1::LabelOpacity;
  io.Any("value", m.value, &P::value, &P::set_value);
  io.Finite("opacity", m.opacity, &P::opacity, &P::set_opacity);
}

void Fields(auto& io, Is<LabelChoice> auto& m) {
  using P = v1::LabelChoice;
  io.OneOf("mode", m.mode, &P::mode, &P::set_mode, LabelMode::kTint, LabelMode::kHighlight);
  io.Finite("tint", m.tint, &P::tint, &P::set_tint);
  io.Messages("opacities", m.opacities, &P::opacities, &P::mutable_opacities, kMaxLabels);
  io.Messages("shown", m.shown, &P::shown, &P::mutable_shown, kMaxLabelRanges);
}

void Fields(auto& io, Is<OverlayChoice> auto& m) {
  using P = v1::OverlayChoice;
  io.Either("preset", m.choice, &P::preset, &P::mutable_preset, "function", &P::has_function, &P::function, &P::mutable_function);
  io.Optional("scalar_range", m.scalar_range, &P::has_scalar_range, &P::scalar_range, &P::mutable_scalar_range);
  io.Finite("weight", m.weight, &P::weight, &P::set_weight);
}

void Fields(auto& io, Is<Shading> auto& m) {
  using P = v1::Shading;
  io.OneOf("model", m.model, &P::model, &P::set_model, ShadingModel::kPhong, ShadingModel::kDepthGradient);
  io.Messages("lights", m.lights, &P::lights, &P::mutable_lights, kMaxLights);
  io.Optional("ambient", m.ambient, &P::has_ambient, &P::ambient, &P::set_ambient);
  io.Optional("diffuse", m.diffuse, &P::has_diffuse, &P::diffuse, &P::set_diffuse);
  io.Optional("specular", m.specular, &P::has_specular, &P::specular, &P::set_specular);
  io.Optional("shininess", m.shininess, &P::has_shininess, &P::shininess, &P::set_shininess);
  io.Finite("shadows", m.shadows, &P::shadows, &P::set_shadows);
  io.Finite("ambient_occlusion", m.ambient_occlusion, &P::ambient_occlusion, &P::set_ambient_occlusion);
  io.Finite("occlusion_radius", m.occlusion_radius, &P::occlusion_radius, &P::set_occlusion_radius);
}

void Fields(auto& io, Is<Policy> auto& m) {
  using P = v1::Policy;
  io.Text("decomposition", m.decomposition, &P::decomposition, &P::mutable_decomposition, 1, kMaxNameBytes);
  io.OneOf("axis", m.axis, &P::axis, &P::set_axis, AxisChoice::kX, AxisChoice::kView);
  io.Text("balance_by", m.balance_by, &P::balance_by, &P::mutable_balance_by, 1, kMaxNameBytes);
  io.Text("assignment", m.assignment, &P::assignment, &P::mutable_assignment, 1, kMaxNameBytes);
  io.Text("balance", m.balance, &P::balance, &P::mutable_balance, 1, kMaxNameBytes);
  io.Range("groups", m.groups, &P::groups, &P::set_groups, 0, kMaxGroups);
  io.Range("teams", m.teams, &P::teams, &P::set_teams, 1, kMaxTeams);
  io.Text("combine", m.combine, &P::combine, &P::mutable_combine, 0, kMaxNameBytes);
  io.Finite("pixel_error", m.pixel_error, &P::pixel_error, &P::set_pixel_error);
}

void Fields(auto& io, Is<FrameRequest> auto& m) {
  using P = v1::FrameRequest;
  io.Text("dataset", m.dataset, &P::dataset, &P::mutable_dataset, 1, kMaxNameBytes);
  io.Message("size", m.size, &P::size, &P::mutable_size);
  io.Message("view", m.view, &P::view, &P::mutable_view);
  io.Message("clipping", m.clipping, &P::clipping, &P::mutable_clipping);
  io.Text("renderer", m.renderer, &P::renderer, &P::mutable_renderer, 1, kMaxNameBytes);
  io.TextMap("parameters", m.parameters, &P::parameters, &P::mutable_parameters, kMaxParameters);
  io.Message("transfer", m.transfer, &P::transfer, &P::mutable_transfer);
  io.Message("shading", m.shading, &P::shading, &P::mutable_shading);
  io.Finite("termination", m.termination, &P::termination, &P::set_termination);
  io.Finite("brightness", m.brightness, &P::brightness, &P::set_brightness);
  io.Finite("detail", m.detail, &P::detail, &P::set_detail);
  io.Text("level", m.level, &P::level, &P::mutable_level, 1, kMaxNameBytes);
  io.Optional("labels", m.labels, &P::has_labels, &P::labels, &P::mutable_labels);
  io.Optional("overlay", m.overlay, &P::has_overlay, &P::overlay, &P::mutable_overlay);
  io.Message("policy", m.policy, &P::policy, &P::mutable_policy);
  io.Any("previews", m.previews, &P::previews, &P::set_previews);
  io.Any("straight8", m.straight8, &P::straight8, &P::set_straight8);
}

// What a client left out has its standard value.
inline void Read(const v1::FrameRequest& in, FrameRequest& out, Checker& check) {
  ReadFields(WithStandards(in), out, check);
  if (check.ok()) check.Adopt(Validate(out));
}

}  // namespace slabstream
