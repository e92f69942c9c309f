#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "common/planning/frame_plan.h"
#include "common/planning/placement.h"

namespace slabstream {
namespace {

Status CheckGrid(const SheetGrid& sheets) {
  if (std::max(sheets.width, sheets.height) <= kMaxGridSide) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("an image along the slices of this view has {} x {} pixels, but at most {} a side are possible: "
                  "the slices lie too far apart for the width of their voxels",
                  sheets.width, sheets.height, kMaxGridSide));
}

}  // namespace

Result<FrameSetup> MakeFrameSetup(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary) {
  Result<TransferFunction> transfer = ResolveTransfer(request.transfer, summary);
  if (!transfer.ok()) return transfer.status();
  FrameSetup setup;
  setup.dataset = dataset;
  setup.description = summary.description;
  setup.range = summary.range;
  setup.renderer = request.renderer;
  SetView(request.view, request.size, setup);
  if (request.renderer == RendererKind::kSplat) {
    if (Status status = CheckGrid(setup.sheets); !status.ok()) return status;
  }
  setup.transfer = *std::move(transfer);
  setup.shading = request.shading;
  setup.termination = request.termination;
  return setup;
}

Result<TransferFunction> ResolveTransfer(const TransferChoice& choice, const VolumeSummary& summary) {
  Result<TransferFunction> transfer = std::holds_alternative<std::string>(choice.choice)
                                          ? MakePreset(std::get<std::string>(choice.choice), summary)
                                          : Result<TransferFunction>(std::get<TransferFunction>(choice.choice));
  if (transfer.ok()) transfer->opacity_distance = choice.opacity_distance;
  return transfer;
}

void SetView(const ViewParameters& view, ImageSize size, FrameSetup& setup) {
  const VolumeGeometry& geometry = setup.description.geometry;
  if (setup.renderer == RendererKind::kSplat) {
    setup.camera = MakeCamera(view, size, geometry);
    setup.sheets = MakeSheetGrid(setup.camera, geometry);
  } else {
    setup.camera = MakeSupersampledCamera(view, size, geometry);
  }
}

PixelBounds FrameBounds(const FrameSetup& setup) {
  return setup.renderer == RendererKind::kSplat ? PixelBounds{0, 0, setup.sheets.width, setup.sheets.height}
                                                : PixelBounds{0, 0, setup.camera.width, setup.camera.height};
}

std::int64_t FrameBytes(const FrameSetup& setup) {
  const bool depth = FormatOf(setup.renderer) == PixelFormat::kDepth;
  return FrameBounds(setup).pixel_count() * std::int64_t(depth ? 6 * sizeof(float) : 4 * sizeof(float));
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
                            const CostModel& cost, std::shared_ptr<const Layout> layout, const Turn& turn) {
  const Result<ResolvedPolicy> policy = ResolvePolicy(request, summary.description.geometry);
  if (!policy.ok()) return policy.status();
  if (layout == nullptr) {
    const Result<TransferFunction> transfer = ResolveTransfer(request.transfer, summary);
    if (!transfer.ok()) return transfer.status();
    layout = std::make_shared<const Layout>(MakeLayout({.summary = &summary,
                                                        .transfer = &*transfer,
                                                        .policy = &*policy,
                                                        .renderer = request.renderer,
                                                        .slots = std::max<std::uint32_t>(std::uint32_t(roster.slots.size()), 1),
                                                        .slab_bytes_target = cost.slab_bytes_target}));
  }
  return PlanFrame(request, *policy, dataset, summary, roster, std::move(layout), turn);
}

}  // namespace slabstream
