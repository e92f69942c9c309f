#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "common/planning/frame_plan.h"
#include "common/planning/placement.h"

namespace slabstream {
namespace {

FrameSetup MakeSetup(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary, TransferFunction transfer) {
  FrameSetup setup;
  setup.dataset = dataset;
  setup.description = summary.description;
  setup.range = summary.range;
  setup.renderer = request.renderer;
  const VolumeGeometry& geometry = summary.description.geometry;
  if (request.renderer == RendererKind::kSplat) {
    setup.camera = MakeCamera(request.view, request.size, geometry);
    setup.sheets = MakeSheetGrid(setup.camera, geometry);
  } else {
    setup.camera = MakeSupersampledCamera(request.view, request.size, geometry);
  }
  setup.transfer = std::move(transfer);
  setup.shading = request.shading;
  setup.termination = request.termination;
  return setup;
}

}  // namespace

Result<TransferFunction> ResolveTransfer(const TransferChoice& choice, const VolumeSummary& summary) {
  Result<TransferFunction> transfer = std::holds_alternative<std::string>(choice.choice)
                                          ? MakePreset(std::get<std::string>(choice.choice), summary)
                                          : Result<TransferFunction>(std::get<TransferFunction>(choice.choice));
  if (transfer.ok()) transfer->opacity_distance = choice.opacity_distance;
  return transfer;
}

PixelBounds FrameBounds(const FrameSetup& setup) {
  return setup.renderer == RendererKind::kSplat ? PixelBounds{0, 0, setup.sheets.width, setup.sheets.height}
                                                : PixelBounds{0, 0, setup.camera.width, setup.camera.height};
}

Result<FramePlan> PlanFrame(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary, const Roster& roster,
                            const CostModel& cost, const Layout* layout) {
  if (Status status = CheckNames(request.policy); !status.ok()) return status;
  Result<TransferFunction> transfer = ResolveTransfer(request.transfer, summary);
  if (!transfer.ok()) return transfer.status();

  FramePlan plan;
  plan.setup = MakeSetup(request, dataset, summary, *std::move(transfer));
  if (const SheetGrid& sheets = plan.setup.sheets; std::max(sheets.width, sheets.height) > kMaxGridSide) {
    return Status::InvalidArgument(
        fmt::format("an image along the slices of this view has {} x {} pixels, but at most {} a side are possible: "
                    "the slices lie too far apart for the width of their voxels",
                    sheets.width, sheets.height, kMaxGridSide));
  }
  plan.slots = std::uint32_t(roster.slots.size());
  plan.slab_axis = SlabAxis(request.policy, summary.description.geometry.size);
  plan.split = SplitOf(request.policy);
  plan.combine = request.policy.combine;
  plan.pixel_error = request.policy.pixel_error;

  // Where the boxes are, and whose.
  const std::uint32_t slots = std::max<std::uint32_t>(plan.slots, 1);
  plan.layout = layout != nullptr ? *layout
                                  : MakeLayout({.summary = &summary,
                                                .transfer = &plan.setup.transfer,
                                                .policy = &request.policy,
                                                .slots = slots,
                                                .slab_bytes_target = cost.slab_bytes_target});

  // Who sees what when: groups of `slots` boxes that show something, in visibility order.
  for (const BoxId id : VisibilityOrder(plan.layout.partition, plan.setup.camera)) {
    if (plan.layout.owners[id] == kNoSlot) continue;
    if (plan.groups.empty() || plan.groups.back().placements.size() == slots) plan.groups.emplace_back();
    plan.groups.back().placements.push_back({id, plan.layout.partition.boxes()[id], 0});
  }
  if (plan.groups.empty()) plan.groups.emplace_back();

  if (Status status = AssignWorkers(roster, plan); !status.ok()) return status;
  return plan;
}

}  // namespace slabstream
