// What workers are told to do.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/renderers/registry.h"
#include "common/volume/light_volume.h"
#include "common/wire/request_fields.h"

namespace slabstream {

void Fields(auto& io, Is<Camera> auto& m) {
  using P = v1::Camera;
  io.OneOf("projection", m.projection, &P::projection, &P::set_projection, Projection::kOrthographic, Projection::kPerspective);
  io.Row("x_row", m.x_row, &P::x_row, &P::mutable_x_row);
  io.Row("y_row", m.y_row, &P::y_row, &P::mutable_y_row);
  io.Row("w_row", m.w_row, &P::w_row, &P::mutable_w_row);
  io.Row("depth_row", m.depth_row, &P::depth_row, &P::mutable_depth_row);
  io.Message("eye", m.eye, &P::eye, &P::mutable_eye);
  io.Message("view_direction", m.view_direction, &P::view_direction, &P::mutable_view_direction);
  io.Message("right", m.right, &P::right, &P::mutable_right);
  io.Message("up", m.up, &P::up, &P::mutable_up);
  io.Message("spacing", m.spacing, &P::spacing, &P::mutable_spacing);
  io.Range("supersample", m.supersample, &P::supersample, &P::set_supersample, 1, kMaxSupersample);
  // Whole final pixels, as many as a picture may have.
  const std::uint64_t most = std::uint64_t{kMaxImageSide} * std::uint64_t(m.supersample);
  io.Range("width", m.width, &P::width, &P::set_width, 1, most);
  io.Range("height", m.height, &P::height, &P::set_height, 1, most);
  io.OneOf("traversal_axis", m.traversal_axis, &P::traversal_axis, &P::set_traversal_axis, Axis::kX, Axis::kZ);
  io.Any(m.ascending, &P::ascending, &P::set_ascending);
  io.Finite("target_depth", m.target_depth, &P::target_depth, &P::set_target_depth);
  io.Check([&](Checker& check) {
    constexpr double kTolerance = 1e-6;
    const auto unit = [](const Vec3& v) { return std::abs(Length(v) - 1) <= kTolerance; };
    check.That(unit(m.view_direction), "view_direction", "not a unit vector");
    check.That(unit(m.right), "right", "not a unit vector");
    check.That(unit(m.up), "up", "not a unit vector");
    CheckPositive("spacing", m.spacing, check);
    const std::string supersample = std::to_string(m.supersample);
    check.That(std::has_single_bit(unsigned(m.supersample)), "supersample", supersample + " is not a power of two");
    check.That(m.width % m.supersample == 0, "width", std::to_string(m.width) + " is not a multiple of supersample, " + supersample);
    check.That(m.height % m.supersample == 0, "height", std::to_string(m.height) + " is not a multiple of supersample, " + supersample);
  });
}

void Fields(auto& io, Is<SheetGrid> auto& m) {
  using P = v1::SheetGrid;
  constexpr double kMost = 1e12;  // keeps sums and products finite
  io.Between("x_u", m.x_u, &P::x_u, &P::set_x_u, 1 / kMost, kMost);
  io.Between("x_c", m.x_c, &P::x_c, &P::set_x_c, -kMost, kMost);
  io.Between("x_0", m.x_0, &P::x_0, &P::set_x_0, -kMost, kMost);
  io.Between("y_v", m.y_v, &P::y_v, &P::set_y_v, 1 / kMost, kMost);
  io.Between("y_c", m.y_c, &P::y_c, &P::set_y_c, -kMost, kMost);
  io.Between("y_0", m.y_0, &P::y_0, &P::set_y_0, -kMost, kMost);
  io.Between("w_c", m.w_c, &P::w_c, &P::set_w_c, -kMost, kMost);
  io.Between("w_0", m.w_0, &P::w_0, &P::set_w_0, -kMost, kMost);
  io.Between("shear_u", m.shear_u, &P::shear_u, &P::set_shear_u, -kMost, kMost);
  io.Between("shear_v", m.shear_v, &P::shear_v, &P::set_shear_v, -kMost, kMost);
  io.Between("footprint", m.footprint, &P::footprint, &P::set_footprint, 1, kMaxFootprint);
  io.Range("width", m.width, &P::width, &P::set_width, kGridColumnStep, kMaxGridSide);
  io.Range("height", m.height, &P::height, &P::set_height, 1, kMaxGridSide);
  io.Row("from_picture", m.from_picture, &P::from_picture, &P::mutable_from_picture);
  io.Check(
      [&](Checker& check) { check.That(m.width % kGridColumnStep == 0, "width", "not a multiple of " + std::to_string(kGridColumnStep)); });
}

void Fields(auto& io, Is<HalfSpace> auto& m) {
  using P = v1::HalfSpace;
  io.Message("normal", m.normal, &P::normal, &P::mutable_normal);
  io.Finite("offset", m.offset, &P::offset, &P::set_offset);
}

void Fields(auto& io, Is<ClipRegion> auto& m) {
  using P = v1::ClipRegion;
  io.Messages("sides", m.sides, &P::sides, &P::mutable_sides, kMaxClipSides);
  io.OneOf("mode", m.mode, &P::mode, &P::set_mode, ClipMode::kKeep, ClipMode::kCutAway);
}

void Fields(auto& io, Is<LabelLook::Entry> auto& m) {
  using P = v1::LabelEntry;
  io.Finite("r", m.color.r, &P::r, &P::set_r);
  io.Finite("g", m.color.g, &P::g, &P::set_g);
  io.Finite("b", m.color.b, &P::b, &P::set_b);
  io.Finite("opacity", m.opacity, &P::opacity, &P::set_opacity);
  io.Any(m.shown, &P::shown, &P::set_shown);
  io.Check([&](Checker& check) {
    const auto& [r, g, b] = m.color;
    for (const float share : {r, g, b, m.opacity}) check.That(share >= 0 && share <= 1, "", "a colour or an opacity that is not in [0, 1]");
  });
}

void Fields(auto& io, Is<LabelLook> auto& m) {
  using P = v1::LabelLook;
  io.OneOf("mode", m.mode, &P::mode, &P::set_mode, LabelMode::kTint, LabelMode::kSurface);
  io.Between("tint", m.tint, &P::tint, &P::set_tint, 0, 1);
  io.Messages("entries", m.entries, &P::entries, &P::mutable_entries, kMaxLabels);
}

void Fields(auto& io, Is<OverlayLook> auto& m) {
  using P = v1::OverlayLook;
  io.Message("transfer", m.transfer, &P::transfer, &P::mutable_transfer);
  io.Message("range", m.range, &P::range, &P::mutable_range);
  io.Between("weight", m.weight, &P::weight, &P::set_weight, 0, 1);
}

v1::StoredAt ProtoOf(const StoredAt&);
void Fields(auto& io, Is<StoredAt> auto& m) {
  using P = v1::StoredAt;
  io.Text("source", m.source, &P::source, &P::mutable_source, 1, kMaxSourceBytes);
  io.Range("level", m.level, &P::level, &P::set_level, 0, kMaxLevels - 1);
  io.Any(m.version, &P::version, &P::set_version);
  io.Message("block", m.block, &P::block, &P::mutable_block);
  io.Check([&](Checker& check) { check.That(m.block.begin == Index3{} && !m.block.empty(), "block", "does not begin at 0, or is empty"); });
}

v1::CoarserLevel ProtoOf(const CoarserLevel&);
void Fields(auto& io, Is<CoarserLevel> auto& m) {
  using P = v1::CoarserLevel;
  io.Range("dataset", m.dataset, &P::dataset, &P::set_dataset, 1, std::numeric_limits<DatasetId>::max());
  io.Message("description", m.description, &P::description, &P::mutable_description);
  io.Optional("stored", m.stored, &P::has_stored, &P::stored, &P::mutable_stored);
}

void Fields(auto& io, Is<FrameSetup> auto& m) {  // all but the renderer, its parameters, the sheets, the clip region and the front
  using P = v1::FrameSetup;
  io.Range("dataset", m.dataset, &P::dataset, &P::set_dataset, 1, std::numeric_limits<DatasetId>::max());
  io.Between("unit", m.unit, &P::unit, &P::set_unit, 1e-300, 1e300);
  io.Message("description", m.description, &P::description, &P::mutable_description);
  io.Message("layers", m.layers, &P::layers, &P::mutable_layers);
  io.Message("range", m.range, &P::range, &P::mutable_range);
  io.Optional("stored", m.stored, &P::has_stored, &P::stored, &P::mutable_stored);
  io.Messages("coarser", m.coarser, &P::coarser, &P::mutable_coarser, kMaxLevels - 1);
  io.Optional("light", m.light, &P::has_light, &P::light, &P::mutable_light);
  io.Message("camera", m.camera, &P::camera, &P::mutable_camera);
  io.Message("transfer", m.transfer, &P::transfer, &P::mutable_transfer);
  io.Optional("labels", m.looks.labels, &P::has_labels, &P::labels, &P::mutable_labels);
  io.Optional("overlay", m.looks.overlay, &P::has_overlay, &P::overlay, &P::mutable_overlay);
  io.Message("shading", m.shading, &P::shading, &P::mutable_shading);
  io.Between("termination", m.termination, &P::termination, &P::set_termination, 0, kMaxTermination);
  io.Range("halo", m.halo, &P::halo, &P::set_halo, 0, kMaxVolumeSide);
}

inline void Write(const OpaqueFront& in, v1::OpaqueFront& out) {
  out.set_tile(std::uint32_t(in.tile));
  out.set_unit(std::uint32_t(in.unit));
  out.set_tiles_x(std::uint32_t(in.tiles_x));
  out.set_tiles_y(std::uint32_t(in.tiles_y));
  for (const OpaqueFront::Depths& depths : in.tiles) out.mutable_depths()->append(depths.begin(), depths.end());
}
inline void Read(const v1::OpaqueFront& in, OpaqueFront& out, Checker& check) {
  out.tile = std::int32_t(check.Range("tile", in.tile(), kOcclusionTile, kMaxGridSide));
  out.unit = std::int32_t(check.Range("unit", in.unit(), 1, kMaxVolumeSide));
  out.tiles_x = std::int32_t(check.Range("tiles_x", in.tiles_x(), 1, OpaqueFront::kMostTiles));
  out.tiles_y = std::int32_t(check.Range("tiles_y", in.tiles_y(), 1, OpaqueFront::kMostTiles));
  if (!check.ok()) return;
  const std::size_t bytes = std::size_t(out.tiles_x) * std::size_t(out.tiles_y) * kOcclusionSteps;
  const std::string depths = check.Text("depths", in.depths(), bytes, bytes);
  if (!check.ok()) return;
  out.tiles.resize(bytes / kOcclusionSteps);
  for (std::size_t i = 0; i < bytes; ++i) out.tiles[i / kOcclusionSteps][i % kOcclusionSteps] = std::uint8_t(depths[i]);
}

inline void Write(const FrameSetup& in, v1::FrameSetup& out) {
  WriteFields(in, out);
  if (!in.front.empty()) Write(in.front, *out.mutable_front());
  out.set_renderer(std::string(in.renderer->name()));
  out.mutable_parameters()->Add(in.parameters.begin(), in.parameters.end());
  if (!in.sheets.empty()) Write(in.sheets, *out.mutable_sheets());
  if (!in.clip.empty()) Write(in.clip, *out.mutable_clip());
}

inline void ReadRenderer(const v1::FrameSetup& in, FrameSetup& out, Checker& check) {
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

inline void CheckSheets(const FrameSetup& setup, Checker& check) {
  for (const double k : {-0.5, setup.description.geometry.size[setup.camera.traversal_axis] - 0.5}) {
    check.That(setup.sheets.w_c * k + setup.sheets.w_0 > 0, "sheets", "a slice lies behind the eye");
    if (!check.ok()) break;
    const SlicePlacement slice = PlaceSlice(setup.sheets, k);
    const FootprintSigma sigma = FootprintIn(setup.sheets, slice);
    check.That(kFootprintCut * std::max(sigma.u, sigma.v) <= kHalo, "sheets", "footprints reach beyond the halo");
    check.That(std::max(slice.scale_u, slice.scale_v) <= kMaxSliceScale, "sheets", "a voxel is wider than 24 pixels");
  }
}

inline void CheckClip(const FrameSetup& setup, Checker& check) {
  constexpr double kTolerance = 1e-6;
  const auto scope = check.In("clip");
  for (std::size_t i = 0; i < setup.clip.sides.size(); ++i) {
    const auto side = check.In("sides", i);
    const Vec3& normal = setup.clip.sides[i].normal;
    check.That(std::abs(Length(normal / setup.description.geometry.spacing) - 1) <= kTolerance, "normal", "not of unit length");
  }
}

inline void CheckCoarser(const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("coarser");
  check.That(setup.renderer->Can(Ability::kLevels), "", "not expected by this renderer");
  for (std::size_t i = 0; i < setup.coarser.size(); ++i) {
    const auto level = check.In("", i);
    const VolumeDescription& description = setup.coarser[i].description;
    check.That(description.type == setup.description.type && description.mapping == setup.description.mapping, "description",
               "of other values than the volume");
    check.That(CanStandIn(description.geometry, setup.description.geometry), "description", "not of the same part of the world");
  }
}

inline void CheckLight(const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("light");
  if (!setup.light) return check.That(!setup.shading.needs_light_volume(), "", "missing");
  check.That(setup.renderer->Can(Ability::kShadows), "", "not expected by this renderer");
  const VolumeDescription& description = setup.light->description;
  check.That(IsLightSized(description.geometry), "description", "more voxels than a light volume has");
  check.That(description.type == setup.description.type && description.mapping == setup.description.mapping, "description",
             "of other values than the volume");
}

inline void Read(const v1::FrameSetup& in, FrameSetup& out, Checker& check) {
  ReadRenderer(in, out, check);  // sets the halo, too
  ReadFields(in, out, check);
  if (check.ok() && in.has_sheets() != out.renderer->along_slices()) {
    check.Fail("sheets", in.has_sheets() ? "not expected by this renderer" : "missing");
  }
  if (in.has_sheets()) {
    {
      const auto scope = check.In("sheets");
      Read(in.sheets(), out.sheets, check);
    }
    CheckSheets(out, check);
  }
  if (in.has_clip()) {
    {
      const auto scope = check.In("clip");
      Read(in.clip(), out.clip, check);
    }
    if (check.ok()) CheckClip(out, check);
  }
  if (check.ok() && in.has_front()) {
    const auto scope = check.In("front");
    Read(in.front(), out.front, check);
    if (check.ok()) check.Adopt(CheckFits(out.front, out));
  }
  if (check.ok() && !out.coarser.empty()) CheckCoarser(out, check);
  if (check.ok()) CheckLight(out, check);
  if (out.looks.labels) check.That(out.layers.labels.has_value(), "labels", "of a dataset without labels");
  if (out.looks.overlay) check.That(out.layers.overlay.has_value(), "overlay", "of a dataset without an overlay");
  if (check.ok() && out.renderer->Can(Ability::kCells))
    check.That(out.layers.cells, "renderer", "one of cells, which the dataset does not have");
  if (check.ok() && out.looks.labels) check.That(out.renderer->Can(Ability::kLabels), "renderer", "one that shows no labels");
  if (check.ok() && out.looks.overlay) check.That(out.renderer->Can(Ability::kOverlay), "renderer", "one that shows no overlays");
  if (check.ok() && out.looks.overlay) {
    const TransferFunction& transfer = out.looks.overlay->transfer;
    check.That(transfer.isosurfaces.empty() && transfer.gradient_opacities.empty() && transfer.regions.empty(), "overlay.transfer",
               "not of curves over values alone");
    check.Adopt(Validate(transfer));
  }
  if (check.ok()) check.Adopt(Validate(out.transfer));
  if (check.ok()) check.Adopt(Validate(out.shading));
}

v1::FilledBox ProtoOf(const FilledBox&);
void Fields(auto& io, Is<FilledBox> auto& m) {
  using P = v1::FilledBox;
  io.Message("box", m.box, &P::box, &P::mutable_box);
  io.Any(m.sample, &P::sample, &P::set_sample);
  io.Check([&](Checker& check) { check.That(std::isfinite(m.sample), "sample", "is not finite"); });
}

void Fields(auto& io, Is<Placement> auto& m) {
  using P = v1::Placement;
  io.Any(m.id, &P::id, &P::set_id);
  io.Message("box", m.box, &P::box, &P::mutable_box);
  io.Range("worker", m.worker, &P::worker, &P::set_worker, 1, kMaxWorkerId);
  io.Range("level", m.level, &P::level, &P::set_level, 0, kMaxLevels - 1);
  io.Messages("filled", m.filled, &P::filled, &P::mutable_filled, kMaxFilled);
}

void Fields(auto& io, Is<ScheduleName> auto& m) {
  using P = v1::ScheduleName;
  io.Text("scheme", m.scheme, &P::scheme, &P::mutable_scheme, 0, kMaxNameBytes);
  io.Range("ranks", m.ranks, &P::ranks, &P::set_ranks, 0, kMaxRanks);
  io.Numbers("roots", m.roots, &P::roots, &P::mutable_roots, kMaxShares);
}

void Fields(auto& io, Is<GroupPlan> auto& m) {
  using P = v1::GroupPlan;
  io.Messages("placements", m.placements, &P::placements, &P::mutable_placements, kMaxRanks);
  io.Message("schedule", m.schedule, &P::schedule, &P::mutable_schedule);
  io.OneOf("color", m.color, &P::color, &P::set_color, ColorCoding::kFloat32, ColorCoding::kStraight8);
}

}  // namespace slabstream
