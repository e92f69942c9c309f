#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "common/decomposition/decomposition.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/frame_plan.h"
#include "common/planning/placement.h"

namespace slabstream {
namespace {

template <class Entry>
Status UnknownName(std::string_view field, std::string_view name, const std::vector<Entry>& entries) {
  std::string known;
  for (const Entry& entry : entries) known += (known.empty() ? "" : ", ") + std::string(entry.name);
  return Status::InvalidArgument(fmt::format("{} is '{}', but must be one of: {}", field, name, known));
}

Result<TransferFunction> ResolveTransfer(const TransferChoice& choice, const VolumeSummary& summary) {
  Result<TransferFunction> transfer = std::holds_alternative<std::string>(choice.choice)
                                          ? MakePreset(std::get<std::string>(choice.choice), summary)
                                          : Result<TransferFunction>(std::get<TransferFunction>(choice.choice));
  if (transfer.ok()) transfer->opacity_distance = choice.opacity_distance;
  return transfer;
}

// z, about which views turn: slabs one above the other hide little of each other from most sides, so none of them is rendered in vain. The
// longest side where z has less than half as many slices. It depends on the volume alone, so that turning it moves no voxel.
Axis AutomaticAxis(const Index3& size) {
  Axis longest = Axis::kZ;
  for (Axis axis : {Axis::kY, Axis::kX}) {
    if (size[axis] > 2 * size.z && size[axis] > size[longest]) longest = axis;
  }
  return longest;
}

// The fewest groups whose slabs stay under the target, whatever the view. Slabs thinner than the halo would hold more of it than voxels of
// their own.
int ChooseGroups(const VolumeDescription& description, Axis axis, std::int64_t slots, const CostModel& cost) {
  const std::int64_t slices = description.geometry.size[axis];
  const std::int64_t slice_bytes = description.voxel_bytes() / slices;
  const std::int64_t most = std::clamp<std::int64_t>(slices / (slots * kHalo), 1, kMaxGroups);
  for (std::int64_t groups = 1; groups < most; ++groups) {
    const std::int64_t own_slices = (slices + slots * groups - 1) / (slots * groups);
    if (std::min(own_slices + 2 * kHalo, slices) * slice_bytes <= cost.slab_bytes_target) return int(groups);
  }
  return int(most);
}

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

PixelBounds FrameBounds(const FrameSetup& setup) {
  return setup.renderer == RendererKind::kSplat ? PixelBounds{0, 0, setup.sheets.width, setup.sheets.height}
                                                : PixelBounds{0, 0, setup.camera.width, setup.camera.height};
}

Result<FramePlan> PlanFrame(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary, const Roster& roster,
                            const CostModel& cost) {
  const DecompositionEntry* decomposition = FindDecomposition(request.policy.decomposition);
  if (decomposition == nullptr) return UnknownName("policy.decomposition", request.policy.decomposition, Decompositions());
  if (FindCombiningScheme(request.policy.combine) == nullptr)
    return UnknownName("policy.combine", request.policy.combine, CombiningSchemes());
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
  plan.combine = request.policy.combine;
  const VolumeDescription& description = summary.description;
  plan.slab_axis = request.policy.axis == AxisChoice::kAuto ? AutomaticAxis(description.geometry.size) : Axis(request.policy.axis);

  // Where the boxes are.
  const auto slots = std::max<std::int64_t>(plan.slots, 1);
  const std::int64_t groups = request.policy.groups > 0 ? request.policy.groups : ChooseGroups(description, plan.slab_axis, slots, cost);
  const int boxes = int(std::min<std::int64_t>(groups * slots, description.geometry.bounds().voxel_count()));
  plan.partition = decomposition->make({&summary, boxes, plan.slab_axis});

  // Who sees what when: groups of `slots` boxes in visibility order, without those that show nothing.
  const BrickVisibility visibility(summary, plan.setup.transfer);
  const std::vector<BoxId> order = VisibilityOrder(plan.partition, plan.setup.camera);
  for (std::size_t first = 0; first < order.size(); first += std::size_t(slots)) {
    GroupPlan& group = plan.groups.emplace_back();
    for (std::size_t i = first; i < std::min(first + std::size_t(slots), order.size()); ++i) {
      const Box& box = plan.partition.boxes()[order[i]];
      if (visibility.AnyVisible(SlabBox(box, plan.setup))) group.placements.push_back({order[i], box, 0});
    }
  }

  if (Status status = AssignWorkers(roster, plan); !status.ok()) return status;
  return plan;
}

}  // namespace slabstream
