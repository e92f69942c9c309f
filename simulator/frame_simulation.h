// FrameSimulation: what stands behind SimulateFrames. A SimulatedService under conditions of cost: plans are given, work takes the time
// that the machine model and the costs of boxes say, links carry bytes, nothing fails. Instead of pixels an image has its coverage. One
// object runs once.
//
// The machines do nothing by themselves here: heartbeats and time-outs are set beyond the end of the run.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "simulator/conditions.h"
#include "simulator/model/network.h"
#include "simulator/model/timeline.h"
#include "simulator/model/union_coverage.h"
#include "simulator/simulate_frames.h"
#include "simulator/simulated_service.h"

namespace slabstream {

// What the workers did for one simulated frame, added up as the service's statistics do.
class FrameAccount {
 public:
  explicit FrameAccount(std::size_t workers) : render_seconds_(workers), busy_(workers) {}

  // Work of one lane, [begin, end]. `end` does not decrease from call to call.
  void Add(std::uint32_t worker, Lane lane, double begin, double end);

  // Writes imbalance and idle share; `result` says when the frame was planned and done, `slots` how many workers it was planned for.
  void Close(std::size_t slots, SimulatedFrame& result) const;

 private:
  std::vector<double> render_seconds_;                        // by worker
  std::vector<std::vector<std::pair<double, double>>> busy_;  // by worker: when any lane works; apart, in order of time
};

class FrameSimulation : private Conditions {
 public:
  // All valid (SimulateFrames checks).
  FrameSimulation(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options);

  Timeline Run();

 private:
  struct Group {
    UnionCoverage coverage;
    std::uint32_t steps = 0;      // steps of its schedule
    std::size_t shares_left = 1;  // not done as far as the coordinator knows
  };
  struct Frame {
    std::map<std::uint32_t, Group> groups;  // handed out, and not done as far as the coordinator knows
    FrameAccount account;                   // from its plan until its picture is received
    double picture_there = 0;               // when a direct picture is at the client
  };

  const FramePlan& plan(std::uint32_t frame) const { return *inputs_[frame].plan; }
  std::uint32_t FrameOf(const GroupKey& key) const { return frame_of_.at(key.frame); }
  Group& GroupOf(const GroupKey& key) { return frames_.at(FrameOf(key)).groups.at(key.group); }
  double now() const { return service_.now() - origin_; }  // on the timeline

  // ---- the client
  void Submit();
  void OnPicture(std::uint32_t frame);

  // ---- Conditions
  using Conditions::Perform;
  std::optional<WorkCost> Begin(Job& job) override {
    return std::visit([&](const auto& action) { return CostOf(job, action); }, job.action);
  }
  void OnWorked(const Job& job, const LaneTask& task) override;
  WorkerEvent Answer(Job& job) override;
  void Perform(Node node, SendChunkRequest& action) override;
  Arrivals ToWorker(Node to, CoordinatorToWorker& message, double sent) override;
  Arrivals ToCoordinator(Node from, WorkerToCoordinator& message) override;
  Arrivals ToPeer(Node to, Job& sends) override;
  void BeforeStep(const FrameEvent& event) override;
  void Perform(ToClient& action) override;
  void Perform(const ToDatasets& action) override;
  void Perform(const CountDataset&) override {}
  void Perform(const PlanRequest& action) override;

  using Cost = std::optional<WorkCost>;
  Cost CostOf(const Job&, const StartRender& action) const;
  Cost CostOf(const Job&, const StoreChunk&) const { return {}; }
  Cost CostOf(const Job&, const StartCombine& action);
  Cost CostOf(const Job&, const FindHidden& action) const;
  Cost CostOf(Job& job, const SendPartial& action);
  Cost CostOf(const Job&, const SendFrame& action) const;
  double MessageBytes(const GroupKey& key, const UnionCoverage::Amount& amount) const;
  void BeginGroup(const GroupAssignment& assignment);
  // When the last byte arrives of a message that leaves at `sent`. Fills in the message's times.
  double Travel(SimulatedMessage message, double sent);

  const std::span<const FrameInput> inputs_;
  const MachineModel& machine_;
  const SimulationOptions options_;
  const std::vector<WorkerId> ids_;  // the workers of the plans, ascending. The machines know worker i as i + 1
  Network network_;
  SimulatedService service_;
  double origin_ = 0;  // when the timeline begins: workers have registered before
  double planner_free_ = 0;

  std::uint32_t submitted_ = 0, planned_ = 0, received_ = 0;  // frames
  std::map<FrameId, std::uint32_t> frame_of_;
  std::map<std::uint32_t, Frame> frames_;              // frames that are under way
  double coordinator_passed_ = 0, client_passed_ = 0;  // they are done with the pictures so far
  Timeline timeline_;
};

}  // namespace slabstream
