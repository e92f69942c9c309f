#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/frame/shape_grid.h"
#include "common/planning/frame_occlusion.h"
#include "common/renderers/registry.h"
#include "common/volume/light_volume.h"
#include "common/wire/limits.h"
#include "common/wire/rules.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

constexpr double kTolerance = 1e-6;

void CheckSheets(const FrameSetup& setup, Checker& check) {
  if (setup.sheets.empty() == setup.renderer->along_slices())
    return check.Fail("sheets", setup.sheets.empty() ? "missing" : "not expected by this renderer");
  if (setup.sheets.empty()) return;
  for (const double k : {-0.5, setup.description.geometry.size[setup.camera.traversal_axis] - 0.5}) {
    check.That(setup.sheets.w_c * k + setup.sheets.w_0 > 0, "sheets", "a slice lies behind the eye");
    if (!check.ok()) break;
    const SlicePlacement slice = PlaceSlice(setup.sheets, k);
    const FootprintSigma sigma = FootprintIn(setup.sheets, slice);
    check.That(kFootprintCut * std::max(sigma.u, sigma.v) <= kHalo, "sheets", "footprints reach beyond the halo");
    check.That(std::max(slice.scale_u, slice.scale_v) <= kMaxSliceScale, "sheets", "a voxel is wider than 24 pixels");
  }
}

void CheckClip(const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("clip");
  for (std::size_t i = 0; i < setup.clip.sides.size(); ++i) {
    const auto side = check.In("sides", i);
    const Vec3& normal = setup.clip.sides[i].normal;
    check.That(std::abs(Length(normal / setup.description.geometry.spacing) - 1) <= kTolerance, "normal", "not of unit length");
  }
}

bool HasValuesOf(const VolumeDescription& a, const VolumeDescription& b) { return a.type == b.type && a.mapping == b.mapping; }

void CheckCoarser(const FrameSetup& setup, Checker& check) {
  if (setup.coarser.empty()) return;
  const auto scope = check.In("coarser");
  check.That(setup.renderer->Can(Ability::kLevels), "", "not expected by this renderer");
  for (std::size_t i = 0; i < setup.coarser.size(); ++i) {
    const auto level = check.In("", i);
    const VolumeDescription& description = setup.coarser[i].description;
    check.That(HasValuesOf(description, setup.description), "description", "of other values than the volume");
    check.That(CanStandIn(description.geometry, setup.description.geometry), "description", "not of the same part of the world");
  }
}

// `light`: of the volume, or of a field, which has values as `values`.
void CheckLight(const std::optional<CoarserLevel>& light, const VolumeDescription& values, const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("light");
  if (!light) return check.That(!setup.shading.needs_light_volume(), "", "missing");
  check.That(setup.shading.needs_light_volume() && setup.renderer->Can(Ability::kShadows), "", "not expected");
  check.That(IsLightSized(light->description.geometry), "description", "more voxels than a light volume has");
  check.That(HasValuesOf(light->description, values), "description", "of other values than the voxels");
}

void CheckCellsAndLabels(const FrameSetup& setup, Checker& check) {
  const RendererKind& renderer = *setup.renderer;
  if (renderer.Can(Ability::kCells)) check.That(setup.cells, "renderer", "one of cells, which the dataset does not have");
  check.That(!IsOfLabels(setup.description.type), "description.type", "one of labels");
  const FieldSetup* const labels = LabelsOf(setup);
  if (labels == nullptr) return;
  check.That(renderer.Can(Ability::kLabels), "renderer", "one that shows no labels");
  check.That(!labels->labels->smooth || renderer.Can(Ability::kSmoothLabels), "renderer", "one that does not smooth labels");
}

void CheckFields(const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("fields");
  const std::size_t values = setup.fields.size() - (LabelsOf(setup) == nullptr ? 0 : 1);
  check.That(values == 0 || setup.renderer->Can(Ability::kFields), "", "not expected by this renderer");
  check.That(values < kMaxShownFields, "", "too many");
  for (std::size_t i = 0; i < setup.fields.size(); ++i) {
    const auto of_field = check.In("", i);
    const auto& [levels, of_volume, look, light, labels] = setup.fields[i];
    check.That(!levels.empty(), "levels", "missing");
    check.That(of_volume.size() == setup.coarser.size() + 1, "of_volume", "not one for each level of the volume");
    check.That(std::ranges::all_of(of_volume, [&](std::uint32_t level) { return level < levels.size(); }), "of_volume",
               "a level that is missing");
    for (const CoarserLevel& level : levels) {
      check.That(HasValuesOf(level.description, levels.front().description), "levels", "of other values than the first one");
    }
    check.That(!labels || i + 1 == setup.fields.size(), "labels", "not the last field");
    if (labels) continue;
    check.That(!IsOfLabels(levels.front().description.type), "levels", "of labels");
    if (!levels.empty()) CheckLight(light, levels.front().description, setup, check);
    const TransferFunction& transfer = look.transfer;
    check.That(transfer.curves_alone(), "look.transfer", "not of curves over values alone");
    check.That(look.blend != Blend::kAuto, "look.blend", "not settled");
    check.Adopt(Validate(transfer));
  }
}

void CheckShapes(const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("shapes");
  for (std::size_t i = 0; i < setup.shapes.size(); ++i) {
    const auto of_shape = check.In("", i);
    const CoarserLevel& bytes = setup.shapes[i].bytes;
    const ShapeLook& look = setup.shapes[i].look;
    check.That(bytes.description.type == ScalarType::kUint8 && !bytes.stored, "bytes", "not bytes that the coordinator holds");
    check.That(look.opacity > 0, "look.opacity", "not greater than 0");
    const std::size_t colors = look.coloring == ShapeColoring::kValues ? kShapeMapColors : 0;
    check.That(look.map.size() == colors, "look.map", "not as many colours as the colouring has");
    check.That(look.low < look.high, "look.high", "not greater than low");
  }
}

// The volume alone may be rectilinear, and then shapes are all that is shown beside it (CheckRectilinear,
// common/planning/resolved_request.cpp).
void CheckStretch(const FrameSetup& setup, Checker& check) {
  const auto is_even = [](const CoarserLevel& level) { return !level.description.geometry.rectilinear(); };
  check.That(std::ranges::all_of(setup.coarser, is_even), "coarser", "a rectilinear grid");
  for (const FieldSetup& field : setup.fields) check.That(std::ranges::all_of(field.levels, is_even), "fields", "a rectilinear grid");
  if (!setup.description.geometry.rectilinear()) return;
  check.That(setup.renderer->Can(Ability::kRectilinear), "renderer", "one that draws no rectilinear grid");
  const bool alone = setup.coarser.empty() && setup.fields.empty() && !setup.light;
  check.That(alone, "description", "a rectilinear grid beside levels, fields or a light volume");
}

// `m` names every worker of the group and the display worker, nobody twice.
void CheckPeers(const GroupAssignment& m, Checker& check) {
  std::vector<WorkerId> known;
  known.reserve(m.peers.size());
  for (const Peer& peer : m.peers) known.push_back(peer.worker);
  std::sort(known.begin(), known.end());
  check.That(std::adjacent_find(known.begin(), known.end()) == known.end(), "peers", "a worker appears twice");
  const auto require = [&](WorkerId worker) {
    if (!std::binary_search(known.begin(), known.end(), worker)) check.Fail("peers", "worker " + std::to_string(worker) + " is missing");
  };
  require(m.display);
  for (const Placement& placement : m.group.placements) require(placement.worker);
}

void CheckTiles(const GroupAssignment& m, Checker& check) {
  const auto scope = check.In("tiles");
  check.That(m.tiles.empty() || (!m.setup.shapes.empty() && m.key.group == 0), "", "without shapes, or not with the first group");
  const std::uint32_t count = ShapeGrid(FrameBounds(m.setup)).count();
  for (std::size_t i = 0; i < m.tiles.size(); ++i) {
    const auto of_order = check.In("", i);
    const TileOrder& order = m.tiles[i];
    check.That(order.from != order.to, "to", "the sender");
    const bool ascend = std::ranges::adjacent_find(order.tiles, std::ranges::greater_equal()) == order.tiles.end();
    check.That(ascend && (order.tiles.empty() || order.tiles.back() < count), "tiles", "not ascending numbers of the frame's tiles");
  }
}

void CheckHidden(const GroupAssignment& m, Checker& check) {
  const auto scope = check.In("hidden");
  check.That(m.hidden.empty() || m.key.group > 0, "", "a mask for the first group, in front of which there is nothing");
  check.Adopt(CheckFits(m.hidden, m.setup));
}

// The plan fits the setup: boxes inside the volume, as many ranks as placements, a schedule that exists.
void CheckGroup(const GroupPlan& group, const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("group");
  const Box volume = setup.description.geometry.bounds();
  for (std::size_t i = 0; i < group.placements.size(); ++i) {
    const auto placement = check.In("placements", i);
    check.That(volume.Contains(group.placements[i].box), "box", "not inside the volume");
    check.That(group.placements[i].level <= setup.coarser.size(), "level", "not one of the setup");
    check.That(group.placements[i].filled.empty() || (setup.stored && group.placements[i].level == 0), "filled",
               "of a coarser level, or of voxels that the coordinator holds");
  }
  if (group.schedule.ranks != group.placements.size()) {
    check.Fail("schedule.ranks",
               std::to_string(group.schedule.ranks) + ", but there are " + std::to_string(group.placements.size()) + " placements");
  }
  check.That(MayCode(setup.format, group.color), "color", "that of another format");
  if (check.ok()) check.Adopt(CheckScheduleName(group.schedule));
  if (!check.ok()) return;
  const std::vector<Rank>& runs = group.schedule.runs;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    const auto of_run = std::span(group.placements).subspan(runs[run], EndOfRun(group.schedule, run) - runs[run]);
    const bool of_one = std::ranges::all_of(of_run, [&](const Placement& placement) { return placement.worker == of_run.front().worker; });
    check.That(of_one, "schedule.runs", "a run of several workers");
  }
}

// The shares of a frame of several groups would have to be accumulated.
void CheckShares(const GroupAssignment& m, Checker& check) {
  if (m.group.schedule.roots.size() == 1 || !check.ok()) return;
  const auto scope = check.In("group.schedule.roots");
  check.That(m.group_count == 1 && !m.previews, "", "several, in a frame of several groups or with previews");
  std::vector<WorkerId> displays = DisplaysOf(m.group, m.display);
  std::ranges::sort(displays);
  check.That(std::ranges::adjacent_find(displays) == displays.end(), "", "several ranks of a worker");
}

}  // namespace

void Rules(const Camera& m, Checker& check) {
  // Whole final pixels, as many as a picture may have.
  const std::uint64_t most = std::uint64_t{kMaxImageSide} * std::uint64_t(m.supersample);
  check.Range("width", std::uint64_t(m.width), 1, most);
  check.Range("height", std::uint64_t(m.height), 1, most);
  const auto unit = [](const Vec3& v) { return std::abs(Length(v) - 1) <= kTolerance; };
  check.That(unit(m.view_direction), "view_direction", "not a unit vector");
  check.That(unit(m.right), "right", "not a unit vector");
  check.That(unit(m.up), "up", "not a unit vector");
  CheckPositive("spacing", m.spacing, check);
  const std::string supersample = std::to_string(m.supersample);
  check.That(std::has_single_bit(unsigned(m.supersample)), "supersample", supersample + " is not a power of two");
  check.That(m.width % m.supersample == 0, "width", std::to_string(m.width) + " is not a multiple of supersample, " + supersample);
  check.That(m.height % m.supersample == 0, "height", std::to_string(m.height) + " is not a multiple of supersample, " + supersample);
}

void Rules(const SheetGrid& m, Checker& check) {
  check.That(m.width % kGridColumnStep == 0, "width", "not a multiple of " + std::to_string(kGridColumnStep));
}

void Rules(const StoredAt& m, Checker& check) {
  check.That(m.block.begin == Index3{} && !m.block.empty(), "block", "does not begin at 0, or is empty");
}

void Rules(const FrameSetup& m, Checker& check) {
  CheckSheets(m, check);
  CheckClip(m, check);
  if (check.ok() && !m.front.empty()) {
    const auto scope = check.In("front");
    check.Adopt(CheckFits(m.front, m));
  }
  CheckCoarser(m, check);
  CheckLight(m.light, m.description, m, check);
  CheckCellsAndLabels(m, check);
  CheckFields(m, check);
  CheckShapes(m, check);
  CheckStretch(m, check);
  if (check.ok()) check.Adopt(Validate(m.transfer));
  if (check.ok()) check.Adopt(Validate(m.shading));
}

void Rules(const GroupAssignment& m, Checker& check) {
  check.Range("group_count", m.group_count, m.key.group + 1, kMaxGroups);
  check.Range("first_group", m.first_group, 0, m.key.group);
  check.Range("groups_done", m.groups_done, 0, m.key.group);
  CheckPeers(m, check);
  CheckTiles(m, check);
  CheckHidden(m, check);
  CheckGroup(m.group, m.setup, check);
  CheckShares(m, check);
}

void Rules(const FrameImage& m, Checker& check) {
  check.Range("groups_done", m.groups_done, 0, m.group_count);
  check.Range("share", m.share, 0, m.share_count - 1);
}

}  // namespace slabstream
