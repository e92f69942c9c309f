// Planner: makes plans, and keeps what they are made from: chosen policies, layouts and measured costs.
//
// Any thread may call it, and no plan waits for another one. A plan may take seconds, since a layout may be refined several times. An open
// policy is chosen by simulated frames, which takes longer: Choose does that, and frames follow a cheap policy until then. The same calls,
// one after the other, give the same plans.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include "coordinator/layout_table.h"
#include "coordinator/plan_request.h"
#include "coordinator/policy_table.h"
#include "coordinator/tuning/service_machine.h"

namespace slabstream {

class Planner {
 public:
  // `surroundings`: what open policies are chosen for.
  explicit Planner(const ServiceSurroundings& surroundings = {}) : surroundings_(surroundings) {}

  // Errors as of MakeFrameSetup and PlanFrame; Cancelled: it was stopped; ResourceExhausted or Internal for exceptions.
  Result<std::shared_ptr<const PlannedFrame>> Plan(const PlanRequest& request);

  // The same if that takes less time than to wake another thread: the policy is not open, and its layout is made. Nothing: ask Plan.
  std::optional<Result<std::shared_ptr<const PlannedFrame>>> PlanAtHand(const PlanRequest& request);

  // Whether open policies of this client's frames are to be chosen; makes one such choice, unless it is told to stop.
  bool WantsChoice(PeerToken client) { return policies_.WantsChoice(client); }
  void Choose(PeerToken client, const std::stop_token& stop) { policies_.Choose(client, layouts_, stop); }

  // Learns from a finished frame. May take as long as a plan.
  void Learn(const FrameMeasured& measured);

 private:
  Result<std::shared_ptr<const PlannedFrame>> TryPlan(const PlanRequest& request);
  // The result points at the request and the policy.
  static LayoutTable::Request WantedLayout(const PlanRequest& request, const ResolvedPolicy& policy, const FrameSetup& setup);
  // Plan and fit.
  static Result<PlannedFrame> WithLayout(PlannedFrame planned, FrameSetup setup, std::shared_ptr<const Layout> layout);

  const ServiceSurroundings surroundings_;
  LayoutTable layouts_;
  PolicyTable policies_;
};

}  // namespace slabstream
