#include "common/planning/frame_plan.h"

#include <algorithm>
#include <string>
#include <utility>

#include "common/planning/brick_visibility.h"
#include "common/planning/layer_bricks.h"
#include "common/planning/placement.h"
#include "common/planning/resolve_look.h"
#include "common/renderers/registry.h"

namespace slabstream {
namespace {

// A slab is flat: if it faces the view, its picture is framed by its sides, not by a ball round them.
double RadiusOfSlab(const BrickVisibility::Ball& ball, const FrameRequest& request, const VolumeGeometry& geometry) {
  const Camera camera = MakeCamera(request.view, request.size, geometry);
  const auto reach = [&](const Vec3& v) { return Dot(Absolute(v), ball.half_extent); };
  const double shorter = std::min(camera.width, camera.height);
  return std::min(ball.radius, std::max(reach(camera.right) * shorter / camera.width, reach(camera.up) * shorter / camera.height));
}

}  // namespace

Result<FrameSetup> MakeFrameSetup(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary) {
  Result<VolumeLook> look = ResolveLook(request, summary);
  if (!look.ok()) return look.status();
  FrameSetup setup;
  setup.dataset = dataset;
  setup.description = summary.description;
  setup.layers = summary.layers();
  setup.range = summary.range;
  SetRenderer(*FindRenderer(request.renderer), setup);
  SetParameters(ParseParameters(*setup.renderer, request.parameters).value(), setup);
  const VolumeGeometry& geometry = summary.description.geometry;
  setup.transfer = std::move(look->transfer);
  setup.clip = std::move(look->clip);
  setup.looks = std::move(look->layers);
  ViewParameters view = request.view;
  if (view.fit) {
    const BrickVisibility visibility(summary, setup.renderer->DrawnTable(setup.transfer, summary),
                                     LayerBricks(summary, *setup.renderer, setup.looks));
    const auto ball = visibility.VisibleBall(setup.clip);
    if (ball) view = FitView(view, geometry, ball->centre, request.clipping.slab ? RadiusOfSlab(*ball, request, geometry) : ball->radius);
  }
  if (Status status = CheckView(view, geometry); !status.ok()) return status;
  if (Status status = setup.renderer->SetView(view, request.size, setup); !status.ok()) return status;
  setup.shading = request.shading;
  for (Vec3& light : setup.shading.lights) light = geometry.orientation.FromWorld(light);
  setup.termination = request.termination;
  return setup;
}

std::vector<Placement> PlacementsOf(const FramePlan& plan) {
  std::vector<Placement> placements;
  for (const GroupPlan& group : plan.groups) placements.insert(placements.end(), group.placements.begin(), group.placements.end());
  return placements;
}

Result<FramePlan> PlanFrame(const FrameRequest& request, const ResolvedPolicy& policy, DatasetId dataset, const VolumeSummary& summary,
                            const Roster& roster, std::shared_ptr<const Layout> layout, const Turn& turn) {
  Result<FrameSetup> setup = MakeFrameSetup(request, dataset, summary);
  if (!setup.ok()) return setup.status();
  FramePlan plan;
  plan.turn = turn;
  plan.setup = *std::move(setup);
  plan.layout = std::move(layout);
  plan.slots = std::uint32_t(roster.slots.size());
  plan.slab_axis = policy.axis;
  plan.combine = policy.combine;
  plan.pixel_error = policy.pixel_error;
  PlaceBoxes(plan);
  if (Status status = AssignWorkers(roster, plan); !status.ok()) return status;
  return plan;
}

Result<FramePlan> PlanFrame(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary, const Roster& roster,
                            std::shared_ptr<const Layout> layout, const Turn& turn, std::int64_t box_bytes_target) {
  const Result<ResolvedPolicy> policy = ResolvePolicy(request, summary.description.geometry);
  if (!policy.ok()) return policy.status();
  if (layout == nullptr) {
    const Result<VolumeLook> look = ResolveLook(request, summary);
    if (!look.ok()) return look.status();
    layout = std::make_shared<const Layout>(MakeLayout({.summary = &summary,
                                                        .transfer = &look->transfer,
                                                        .policy = &*policy,
                                                        .renderer = FindRenderer(request.renderer),
                                                        .clip = &look->clip,
                                                        .looks = &look->layers,
                                                        .slots = std::max<std::uint32_t>(std::uint32_t(roster.slots.size()), 1),
                                                        .box_bytes_target = box_bytes_target}));
  }
  return PlanFrame(request, *policy, dataset, summary, roster, std::move(layout), turn);
}

}  // namespace slabstream
