#include <algorithm>
#include <string>
#include <utility>

#include "common/planning/frame_plan.h"
#include "common/planning/placement.h"
#include "common/renderers/registry.h"

namespace slabstream {
Result<FrameSetup> MakeFrameSetup(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary) {
  Result<TransferFunction> transfer = ResolveTransfer(request.transfer, summary);
  if (!transfer.ok()) return transfer.status();
  FrameSetup setup;
  setup.dataset = dataset;
  setup.description = summary.description;
  setup.range = summary.range;
  SetRenderer(*FindRenderer(request.renderer), setup);
  SetParameters(ParseParameters(*setup.renderer, request.parameters).value(), setup);
  if (Status status = setup.renderer->SetView(request.view, request.size, setup); !status.ok()) return status;
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

std::vector<Placement> PlacementsOf(const FramePlan& plan) {
  std::vector<Placement> placements;
  for (const GroupPlan& group : plan.groups) placements.insert(placements.end(), group.placements.begin(), group.placements.end());
  return placements;
}

Policy SettledPolicy(const FrameRequest& request, const VolumeGeometry& geometry) {
  Policy policy = request.policy;
  if (policy.axis == AxisChoice::kView) policy.axis = AxisChoice(MakeCamera(request.view, request.size, geometry).traversal_axis);
  return policy;
}

Result<FramePlan> PlanFrame(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary, const Roster& roster,
                            const CostModel& cost, const Layout* layout, const Turn& turn) {
  const Policy policy = SettledPolicy(request, summary.description.geometry);
  if (Status status = CheckChosen(policy); !status.ok()) return status;
  Result<FrameSetup> setup = MakeFrameSetup(request, dataset, summary);
  if (!setup.ok()) return setup.status();

  FramePlan plan;
  plan.turn = turn;
  plan.setup = *std::move(setup);
  plan.slots = std::uint32_t(roster.slots.size());
  plan.slab_axis = SlabAxis(policy, summary.description.geometry.size);
  plan.split = SplitOf(policy);
  plan.combine = policy.combine;
  plan.pixel_error = policy.pixel_error;

  // Where the boxes are, and whose.
  const std::uint32_t slots = std::max<std::uint32_t>(plan.slots, 1);
  plan.layout = layout != nullptr ? *layout
                                  : MakeLayout({.summary = &summary,
                                                .transfer = &plan.setup.transfer,
                                                .policy = &policy,
                                                .renderer = plan.setup.renderer,
                                                .slots = slots,
                                                .slab_bytes_target = cost.slab_bytes_target});

  PlaceBoxes(plan);
  if (Status status = AssignWorkers(roster, plan); !status.ok()) return status;
  return plan;
}

}  // namespace slabstream
