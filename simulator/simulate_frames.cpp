#include "simulator/simulate_frames.h"

#include <fmt/format.h>

#include <cmath>

#include "common/wire/client_messages.h"
#include "simulator/frame_simulation.h"

namespace slabstream {
namespace {

bool Finite(double value) { return std::isfinite(value) && value >= 0; }

Status Wrong(std::size_t frame, const std::string& what) { return Status::InvalidArgument(fmt::format("frames[{}]: {}", frame, what)); }

Status CheckBox(std::size_t frame, const FrameInput& input, const Placement& placement) {
  if (placement.worker == 0) return Wrong(frame, fmt::format("box {} has no worker", placement.id));
  if (placement.id >= input.boxes.size()) {
    return Wrong(frame, fmt::format("box {} has no cost: there are {}", placement.id, input.boxes.size()));
  }
  const RenderCost& cost = input.boxes[placement.id];
  if (!Finite(cost.seconds) || !Finite(cost.voxel_bytes)) {
    return Wrong(frame, fmt::format("box {} costs {} s and {} bytes, but must cost finite amounts of at least 0", placement.id,
                                    cost.seconds, cost.voxel_bytes));
  }
  const PixelBounds bounds = FrameBounds(input.plan->setup);
  if (cost.coverage != nullptr && (cost.coverage->frame_width != bounds.width() || cost.coverage->frame_height != bounds.height())) {
    return Wrong(frame, fmt::format("the coverage of box {} is of a frame of {} x {} pixels, but the plan's has {} x {}", placement.id,
                                    cost.coverage->frame_width, cost.coverage->frame_height, bounds.width(), bounds.height()));
  }
  return Status::Ok();
}

Status CheckFrame(std::size_t frame, const FrameInput& input) {
  if (input.plan == nullptr || input.plan->groups.empty()) return Wrong(frame, "has no plan with a group");
  if (input.plan->display == 0) return Wrong(frame, "has no display worker");
  if (!Finite(input.finish_seconds)) {
    return Wrong(frame, fmt::format("finish_seconds is {}, but must be finite and at least 0", input.finish_seconds));
  }
  if (!Finite(input.receive_seconds)) {
    return Wrong(frame, fmt::format("receive_seconds is {}, but must be finite and at least 0", input.receive_seconds));
  }
  for (std::size_t g = 0; g < input.plan->groups.size(); ++g) {
    const GroupPlan& group = input.plan->groups[g];
    if (Status status = CheckScheduleName(group.schedule); !status.ok()) return Wrong(frame, status.message());
    if (group.schedule.ranks != group.placements.size()) {
      return Wrong(frame, fmt::format("the schedule of group {} is of {} ranks, but there are {} boxes", g, group.schedule.ranks,
                                      group.placements.size()));
    }
    for (const Placement& placement : group.placements) {
      if (Status status = CheckBox(frame, input, placement); !status.ok()) return status;
    }
  }
  return Status::Ok();
}

}  // namespace

Result<Timeline> SimulateFrames(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options) {
  if (Status status = Validate(machine); !status.ok()) return status;
  if (options.in_flight < 1 || options.in_flight > int(kMaxOpenRequests)) {
    return Status::InvalidArgument(fmt::format("in_flight is {}, but must be in [1, {}]", options.in_flight, kMaxOpenRequests));
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (Status status = CheckFrame(i, frames[i]); !status.ok()) return status;
  }
  return FrameSimulation(frames, machine, options).Run();
}

}  // namespace slabstream
