#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/renderers/registry.h"
#include "common/wire/codecs.h"
#include "common/wire/limits.h"

namespace slabstream {
namespace {

template <std::size_t kSize>
void WriteRow(const std::array<double, kSize>& in, google::protobuf::RepeatedField<double>* out) {
  out->Add(in.begin(), in.end());
}

template <std::size_t kSize = 4>
std::array<double, kSize> ReadRow(std::string_view field, const google::protobuf::RepeatedField<double>& in, Checker& check) {
  std::array<double, kSize> out{};
  if (in.size() != static_cast<int>(out.size())) {
    check.Fail(field, std::to_string(in.size()) + " values, expected " + std::to_string(out.size()));
    return out;
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto scope = check.In(field, i);
    out[i] = check.Finite("", in[static_cast<int>(i)]);
  }
  return out;
}

// A direction of unit length.
Vec3 ReadUnit(std::string_view field, const v1::Vec3& in, Checker& check) {
  constexpr double kTolerance = 1e-6;
  const Vec3 out = Read(field, in, check);
  check.That(std::abs(Length(out) - 1) <= kTolerance, field, "not a unit vector");
  return out;
}

// A side of the fine grid: whole final pixels, as many as a picture may have.
int ReadSide(std::string_view field, std::uint32_t value, std::uint32_t supersample, Checker& check) {
  const std::uint32_t side = check.Range(field, value, 1, std::uint64_t{kMaxImageSide} * supersample);
  if (side % supersample != 0)
    check.Fail(field, std::to_string(side) + " is not a multiple of supersample, " + std::to_string(supersample));
  return static_cast<int>(side);
}

void ReadRenderer(const v1::FrameSetup& in, FrameSetup& out, Checker& check) {
  const Result<const RendererKind*> renderer = RequireRenderer(check.Text("renderer", in.renderer(), 1, kMaxNameBytes));
  if (!renderer.ok()) return check.Adopt(renderer.status());
  SetRenderer(**renderer, out);
  const std::vector<RendererParameter>& parameters = out.renderer->parameters();
  if (std::size_t(in.parameters_size()) != parameters.size()) {
    return check.Fail("parameters", std::to_string(in.parameters_size()) + " values, expected " + std::to_string(parameters.size()));
  }
  std::vector<double> values;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto scope = check.In("parameters", i);
    values.push_back(check.Between("", in.parameters(int(i)), parameters[i].least, parameters[i].greatest()));
  }
  SetParameters(std::move(values), out);
}

}  // namespace

v1::Camera ToProto(const Camera& in) {
  v1::Camera out;
  out.set_projection(WireEnum<v1::Projection>(in.projection, Projection::kOrthographic));
  WriteRow(in.x_row, out.mutable_x_row());
  WriteRow(in.y_row, out.mutable_y_row());
  WriteRow(in.w_row, out.mutable_w_row());
  WriteRow(in.depth_row, out.mutable_depth_row());
  *out.mutable_eye() = ToProto(in.eye);
  *out.mutable_view_direction() = ToProto(in.view_direction);
  *out.mutable_right() = ToProto(in.right);
  *out.mutable_up() = ToProto(in.up);
  *out.mutable_spacing() = ToProto(in.spacing);
  out.set_width(static_cast<std::uint32_t>(in.width));
  out.set_height(static_cast<std::uint32_t>(in.height));
  out.set_supersample(static_cast<std::uint32_t>(in.supersample));
  out.set_traversal_axis(WireEnum<v1::Axis>(in.traversal_axis, Axis::kX));
  out.set_ascending(in.ascending);
  return out;
}

Camera FromProto(const v1::Camera& in, Checker& check) {
  Camera out;
  out.projection = check.OneOf("projection", in.projection(), Projection::kOrthographic, Projection::kPerspective);
  out.x_row = ReadRow("x_row", in.x_row(), check);
  out.y_row = ReadRow("y_row", in.y_row(), check);
  out.w_row = ReadRow("w_row", in.w_row(), check);
  out.depth_row = ReadRow("depth_row", in.depth_row(), check);
  out.eye = Read("eye", in.eye(), check);
  out.view_direction = ReadUnit("view_direction", in.view_direction(), check);
  out.right = ReadUnit("right", in.right(), check);
  out.up = ReadUnit("up", in.up(), check);
  out.spacing = PositiveFromProto("spacing", in.spacing(), check);
  const std::uint32_t supersample = check.Range("supersample", in.supersample(), 1, kMaxSupersample);
  check.That(std::has_single_bit(supersample), "supersample", std::to_string(supersample) + " is not a power of two");
  out.supersample = static_cast<int>(supersample);
  out.width = ReadSide("width", in.width(), supersample, check);
  out.height = ReadSide("height", in.height(), supersample, check);
  out.traversal_axis = check.OneOf("traversal_axis", in.traversal_axis(), Axis::kX, Axis::kZ);
  out.ascending = in.ascending();
  return out;
}

v1::SheetGrid ToProto(const SheetGrid& in) {
  v1::SheetGrid out;
  out.set_x_u(in.x_u);
  out.set_x_c(in.x_c);
  out.set_x_0(in.x_0);
  out.set_y_v(in.y_v);
  out.set_y_c(in.y_c);
  out.set_y_0(in.y_0);
  out.set_w_c(in.w_c);
  out.set_w_0(in.w_0);
  out.set_shear_u(in.shear_u);
  out.set_shear_v(in.shear_v);
  out.set_width(static_cast<std::uint32_t>(in.width));
  out.set_height(static_cast<std::uint32_t>(in.height));
  WriteRow(in.from_picture, out.mutable_from_picture());
  return out;
}

SheetGrid FromProto(const v1::SheetGrid& in, Checker& check) {
  constexpr double kMost = 1e12;  // keeps sums and products finite
  SheetGrid out;
  out.x_u = check.Between("x_u", in.x_u(), 1 / kMost, kMost);
  out.x_c = check.Between("x_c", in.x_c(), -kMost, kMost);
  out.x_0 = check.Between("x_0", in.x_0(), -kMost, kMost);
  out.y_v = check.Between("y_v", in.y_v(), 1 / kMost, kMost);
  out.y_c = check.Between("y_c", in.y_c(), -kMost, kMost);
  out.y_0 = check.Between("y_0", in.y_0(), -kMost, kMost);
  out.w_c = check.Between("w_c", in.w_c(), -kMost, kMost);
  out.w_0 = check.Between("w_0", in.w_0(), -kMost, kMost);
  out.shear_u = check.Between("shear_u", in.shear_u(), -kMost, kMost);
  out.shear_v = check.Between("shear_v", in.shear_v(), -kMost, kMost);
  out.width = static_cast<std::int32_t>(check.Range("width", in.width(), kGridColumnStep, kMaxGridSide));
  check.That(out.width % kGridColumnStep == 0, "width", "not a multiple of " + std::to_string(kGridColumnStep));
  out.height = static_cast<std::int32_t>(check.Range("height", in.height(), 1, kMaxGridSide));
  out.from_picture = ReadRow<9>("from_picture", in.from_picture(), check);
  return out;
}

v1::FrameSetup ToProto(const FrameSetup& in) {
  v1::FrameSetup out;
  out.set_dataset(in.dataset);
  *out.mutable_description() = ToProto(in.description);
  *out.mutable_range() = ToProto(in.range);
  out.set_renderer(std::string(in.renderer->name()));
  out.mutable_parameters()->Add(in.parameters.begin(), in.parameters.end());
  *out.mutable_camera() = ToProto(in.camera);
  *out.mutable_transfer() = ToProto(in.transfer);
  *out.mutable_shading() = ToProto(in.shading);
  out.set_termination(in.termination);
  out.set_halo(static_cast<std::uint32_t>(in.halo));
  if (!in.sheets.empty()) *out.mutable_sheets() = ToProto(in.sheets);
  return out;
}

FrameSetup FromProto(const v1::FrameSetup& in, Checker& check) {
  FrameSetup out;
  out.dataset = check.Range("dataset", in.dataset(), 1, std::numeric_limits<DatasetId>::max());
  out.description = Read("description", in.description(), check);
  out.range = Read("range", in.range(), check);
  ReadRenderer(in, out, check);
  out.camera = Read("camera", in.camera(), check);
  out.transfer = Read("transfer", in.transfer(), check);
  out.shading = Read("shading", in.shading(), check);
  out.termination = check.Between("termination", in.termination(), 0, kMaxTermination);
  out.halo = static_cast<std::int32_t>(check.Range("halo", in.halo(), 0, kMaxVolumeSide));
  if (check.ok() && in.has_sheets() != out.renderer->along_slices()) {
    check.Fail("sheets", in.has_sheets() ? "not expected by this renderer" : "missing");
  }
  if (in.has_sheets()) {
    out.sheets = Read("sheets", in.sheets(), check);
    for (const double k : {-0.5, out.description.geometry.size[out.camera.traversal_axis] - 0.5}) {
      check.That(out.sheets.w_c * k + out.sheets.w_0 > 0, "sheets", "a slice lies behind the eye");
      if (!check.ok()) break;
      const SlicePlacement slice = PlaceSlice(out.sheets, k);
      const FootprintSigma sigma = FootprintIn(out.sheets, slice);
      check.That(kFootprintCut * std::max(sigma.u, sigma.v) <= kHalo, "sheets", "footprints reach beyond the halo");
      check.That(std::max(slice.scale_u, slice.scale_v) <= kMaxSliceScale, "sheets", "a voxel is wider than 24 pixels");
    }
  }
  if (check.ok()) check.Adopt(Validate(out.transfer));
  if (check.ok()) check.Adopt(Validate(out.shading));
  return out;
}

v1::Placement ToProto(const Placement& in) {
  v1::Placement out;
  out.set_id(in.id);
  *out.mutable_box() = ToProto(in.box);
  out.set_worker(in.worker);
  return out;
}

Placement FromProto(const v1::Placement& in, Checker& check) {
  Placement out;
  out.id = in.id();
  out.box = Read("box", in.box(), check);
  out.worker = check.Range("worker", in.worker(), 1, std::numeric_limits<WorkerId>::max());
  return out;
}

v1::ScheduleName ToProto(const ScheduleName& in) {
  v1::ScheduleName out;
  out.set_scheme(in.scheme);
  out.set_ranks(in.ranks);
  out.set_root(in.root);
  return out;
}

ScheduleName FromProto(const v1::ScheduleName& in, Checker& check) {
  ScheduleName out;
  out.scheme = check.Text("scheme", in.scheme(), 0, kMaxNameBytes);
  out.ranks = check.Range("ranks", in.ranks(), 0, kMaxRanks);
  out.root = in.root();
  return out;
}

v1::GroupPlan ToProto(const GroupPlan& in) {
  v1::GroupPlan out;
  WriteAll(in.placements, out.mutable_placements());
  *out.mutable_schedule() = ToProto(in.schedule);
  out.set_color(WireEnum<v1::ColorCoding>(in.color, ColorCoding::kFloat32));
  return out;
}

GroupPlan FromProto(const v1::GroupPlan& in, Checker& check) {
  GroupPlan out;
  out.placements = ReadAll("placements", in.placements(), kMaxRanks, check);
  out.schedule = Read("schedule", in.schedule(), check);
  out.color = check.OneOf("color", in.color(), ColorCoding::kFloat32, ColorCoding::kFixed16);
  return out;
}

void CheckFits(const GroupPlan& group, const FrameSetup& setup, Checker& check) {
  const Box volume = setup.description.geometry.bounds();
  for (std::size_t i = 0; i < group.placements.size(); ++i) {
    const auto scope = check.In("placements", i);
    check.That(volume.Contains(group.placements[i].box), "box", "not inside the volume");
  }
  if (group.schedule.ranks != group.placements.size()) {
    check.Fail("schedule.ranks",
               std::to_string(group.schedule.ranks) + ", but there are " + std::to_string(group.placements.size()) + " placements");
  }
  if (check.ok()) check.Adopt(CheckScheduleName(group.schedule));
}

}  // namespace slabstream
