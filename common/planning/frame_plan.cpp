#include "common/planning/frame_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "common/frame/frame_unit.h"
#include "common/math/row4.h"
#include "common/planning/frame_occlusion.h"
#include "common/planning/framing.h"
#include "common/planning/placement.h"
#include "common/planning/standard_combining.h"
#include "common/renderers/registry.h"
#include "common/shapes/packed_shape.h"
#include "common/volume/light_volume.h"

namespace slabstream {

namespace {

// `name`: of the field. InvalidArgument: too many voxels for a light volume, and nobody holds them.
Result<CoarserLevel> LightVolumeFrom(const std::string& name, const CoarserVolume& from, double unit) {
  const VolumeSummary& summary = *from.summary;
  CoarserLevel light = {from.dataset, summary.description, summary.stored};
  VolumeGeometry& geometry = light.description.geometry;
  const Index3& size = geometry.size;
  if (!summary.stored) {
    light.dataset = LightVolumeOf(from.dataset);
    geometry = LightGeometry(geometry);
  } else if (!IsLightSized(geometry)) {
    return Status::InvalidArgument(
        fmt::format("shadows and ambient-occlusion need a level of {} of at most {} voxels a side, and its coarsest one has "
                    "{} x {} x {}; slabstream convert makes levels",
                    name, kMaxLightSide, size.x, size.y, size.z));
  }
  geometry = InUnit(geometry, unit);
  return light;
}

std::int64_t PicturePixels(const Camera& camera) {
  return std::int64_t{camera.width / camera.supersample} * (camera.height / camera.supersample);
}

// Whether any fragment may lie in the box: a shape reaches it.
bool HoldsShapes(const Box& voxels, const FrameSetup& setup) {
  const Box box = setup.description.geometry.InDataSpace(voxels);
  return std::ranges::any_of(setup.shapes, [&](const ShapeSetup& shape) {
    return std::ranges::all_of(kAxes,
                               [&](Axis axis) { return shape.low[axis] <= box.end[axis] && shape.high[axis] >= box.begin[axis] - 1; });
  });
}

// Boxes that show nothing have no owner. Those with shapes are drawn all the same: they composite the fragments that they hold.
std::shared_ptr<const Layout> WithShapes(std::shared_ptr<const Layout> layout, const FrameSetup& setup, std::size_t slots) {
  if (setup.shapes.empty() || setup.format != PixelFormat::kRgba || slots == 0) return layout;
  std::shared_ptr<Layout> changed;
  for (std::size_t box = 0; box < layout->owners.size(); ++box) {
    if (layout->owners[box] != kNoSlot || !HoldsShapes(layout->partition.boxes()[box], setup)) continue;
    if (changed == nullptr) changed = std::make_shared<Layout>(*layout);
    changed->owners[box] = std::uint32_t(box % slots);
  }
  return changed != nullptr ? std::shared_ptr<const Layout>(std::move(changed)) : layout;
}

double FarthestDepth(const FrameSetup& setup) {
  double farthest = setup.camera.target_depth;
  for (const ShapeSetup& shape : setup.shapes) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p = {(corner & 1 ? shape.high : shape.low).x, (corner & 2 ? shape.high : shape.low).y,
                      (corner & 4 ? shape.high : shape.low).z};
      farthest = std::max(farthest, Apply(setup.camera.depth_row, p));
    }
  }
  return farthest;
}

// Towards a light beside the viewer, above on the left.
Vec3 BesideViewer(const Camera& camera) { return 0.7 * camera.up - 0.6 * camera.right - camera.view_direction; }

}  // namespace

Result<FrameSetup> MakeFrameSetup(const ResolvedRequest& resolved) {
  const FrameRequest& request = resolved.frame;
  const VolumeSummary& summary = *resolved.summary;
  const VolumeGeometry& geometry = summary.description.geometry;
  if (Status status = CheckDrawable(geometry); !status.ok()) return status;
  FrameSetup setup;
  setup.dataset = resolved.volume.dataset();
  setup.unit = FrameUnitOf(geometry);
  const auto in_unit = [unit = setup.unit](VolumeDescription description) {
    description.geometry = InUnit(description.geometry, unit);
    return description;
  };
  setup.description = in_unit(summary.description);
  setup.cells = !summary.cells.empty();
  setup.range = summary.range;
  setup.stored = summary.stored;
  for (const CoarserVolume& level : resolved.coarser) {
    setup.coarser.push_back({level.dataset, in_unit(level.summary->description), level.summary->stored});
  }
  SetRenderer(*resolved.volume.renderer(), setup);
  SetParameters(ParseParameters(*setup.renderer, request.parameters).value(), setup);
  setup.transfer = InUnit(resolved.volume.transfer(), setup.unit);
  const ClipRegion& clip = resolved.volume.clip();
  setup.clip = InUnit(clip, setup.unit);
  setup.weight = resolved.weight;
  setup.flat = request.clipping.slab.has_value();
  for (std::size_t i = 0; i < resolved.fields.others.size(); ++i) {
    const FieldVolume& other = resolved.fields.others[i];
    const ClassifiedField& shown = resolved.volume.fields()[i];
    FieldSetup field{.levels = {}, .of_volume = other.of_volume, .look = shown.look, .labels = shown.labels};
    for (const CoarserVolume& level : other.levels) {
      field.levels.push_back({level.dataset, in_unit(level.summary->description), level.summary->stored});
    }
    field.look.transfer = InUnit(field.look.transfer, setup.unit);
    setup.fields.push_back(std::move(field));
  }
  std::vector<CoarserVolume> shapes = resolved.fields.shapes;
  shapes.insert(shapes.end(), resolved.fields.planes.begin(), resolved.fields.planes.end());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const CoarserVolume& shape = shapes[i];
    ShapeSetup& shown = setup.shapes.emplace_back(ShapeSetup{.bytes = {shape.dataset, shape.summary->description, {}}});
    shown.look = resolved.shapes[i];
    if (!shown.look.width_in_pixels) shown.look.width /= setup.unit;
    shown.to_data = FromWorld(geometry);
    std::tie(shown.low, shown.high) = shown.to_data.Bounds(shape.summary->shape->low, shape.summary->shape->high);
  }
  if (Status status = CheckView(request.view, geometry); !status.ok()) return status;
  if (Status status = setup.renderer->SetView(InUnit(request.view, setup.unit), request.size, setup); !status.ok()) return status;
  if (Status status = CheckDrawable(setup.camera); !status.ok()) return status;
  for (ShapeSetup& shape : setup.shapes) {
    // What is drawn reaches beyond the vertices by its width.
    const double pixel = setup.camera.PixelSizeAt(setup.camera.projection == Projection::kPerspective ? FarthestDepth(setup) : 1);
    const double width =
        shape.look.width > 0 && !shape.look.width_in_pixels ? shape.look.width : pixel * std::max(shape.look.width, kStandardPointWidth);
    const Vec3 reach = width * (Vec3{1, 1, 1} / setup.camera.spacing);
    shape.low = shape.low - reach;
    shape.high = shape.high + reach;
  }
  setup.shading = setup.transfer.material ? OnMaterial(request.shading, *setup.transfer.material) : request.shading;
  setup.transfer.material.reset();  // workers find it in the shading
  for (Vec3& light : setup.shading.lights) light = geometry.orientation.FromWorld(light);
  if (setup.shading.shadows > 0 && setup.shading.lights.empty()) setup.shading.lights = {Normalized(BesideViewer(setup.camera))};
  if (setup.shading.needs_light_volume()) {
    const std::string name = fmt::format("dataset \"{}\"", request.dataset);
    Result<CoarserLevel> light = LightVolumeFrom(name, resolved.light.value_or(CoarserVolume{setup.dataset, resolved.summary}), setup.unit);
    if (!light.ok()) return light.status();
    setup.light = *std::move(light);
    for (std::size_t i = 0; i + 1 < resolved.fields.values(); ++i) {
      const FieldVolume& other = resolved.fields.others[i];
      light = LightVolumeFrom(fmt::format("field {} of {}", other.number, name), other.light.value_or(other.levels.front()), setup.unit);
      if (!light.ok()) return light.status();
      setup.fields[i].light = *std::move(light);
    }
  }
  setup.termination = request.termination;
  return setup;
}

std::vector<WorkerId> DisplaysOf(const GroupPlan& group, WorkerId display) {
  const std::vector<Rank>& roots = group.schedule.roots;
  if (roots.size() == 1) return {display};
  std::vector<WorkerId> displays;
  for (const Rank root : roots) displays.push_back(group.placements[root].worker);
  return displays;
}

std::optional<std::size_t> ShareOf(const GroupPlan& group, WorkerId display, WorkerId worker) {
  const std::vector<WorkerId> displays = DisplaysOf(group, display);
  const auto found = std::ranges::find(displays, worker);
  return found == displays.end() ? std::nullopt : std::optional(std::size_t(found - displays.begin()));
}

std::vector<Placement> PlacementsOf(const FramePlan& plan) {
  std::vector<Placement> placements;
  for (const GroupPlan& group : plan.groups) placements.insert(placements.end(), group.placements.begin(), group.placements.end());
  return placements;
}

Result<FramePlan> PlanFrame(FrameSetup setup, const ResolvedPolicy& policy, const Roster& roster, std::shared_ptr<const Layout> layout,
                            const Turn& turn, const ClientTakes& client) {
  FramePlan plan;
  plan.client = client;
  plan.turn = turn;
  plan.setup = std::move(setup);
  plan.layout = WithShapes(std::move(layout), plan.setup, roster.slots.size());
  plan.slots = std::uint32_t(roster.slots.size());
  plan.slab_axis = policy.axis;
  plan.combine = policy.combine.empty() ? StandardCombining(roster.slots.size(), PicturePixels(plan.setup.camera)) : policy.combine;
  plan.alternates = policy.assignment->alternates;
  plan.pixel_error = policy.pixel_error;
  PlaceBoxes(plan);
  // Parts of several levels become as many boxes as memory needs, whatever the number of groups.
  if (plan.groups.size() > std::size_t(kMaxGroups)) {
    return Status::ResourceExhausted(
        fmt::format("the picture takes {} groups of boxes, and at most {} are possible: a coarser level (--detail), more memory or more "
                    "workers take fewer",
                    plan.groups.size(), kMaxGroups));
  }
  // Nothing is in front of a single box.
  const bool several = plan.groups.size() > 1 || plan.groups.front().placements.size() > 1;
  if (several && UsesOcclusion(plan.setup)) plan.setup.front = FindOpaqueFront(plan.layout->extinction, plan.setup);
  if (Status status = AssignWorkers(roster, plan); !status.ok()) return status;
  plan.tiles = PlanTiles(plan);
  return plan;
}

Result<FramePlan> PlanFrame(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary, const Roster& roster,
                            std::int64_t box_bytes_target) {
  const Result<ResolvedRequest> resolved = ResolveRequest(request, dataset, std::make_shared<const VolumeSummary>(summary));
  if (!resolved.ok()) return resolved.status();
  Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return setup.status();
  auto layout = std::make_shared<const Layout>(MakeLayout({.summary = &summary,
                                                           .volume = &resolved->volume,
                                                           .policy = &resolved->policy,
                                                           .slots = std::max<std::uint32_t>(std::uint32_t(roster.slots.size()), 1),
                                                           .box_bytes_target = box_bytes_target}));
  return PlanFrame(*std::move(setup), resolved->policy, roster, std::move(layout), {},
                   {.straight8 = request.straight8 && !request.straight8_over});
}

}  // namespace slabstream
