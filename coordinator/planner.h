// Planner: makes plans, and keeps what they are made from: chosen policies, layouts and measured costs.
//
// Any thread may call it; calls wait for each other. The service gives it a thread of its own, since a plan may take seconds: an open
// policy is chosen by simulated frames, and a layout may be refined several times. The same calls in the same order give the same plans.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "coordinator/layout_table.h"
#include "coordinator/plan_request.h"
#include "coordinator/policy_table.h"
#include "coordinator/tuning/service_machine.h"

namespace slabstream {

class Planner {
 public:
  // `surroundings`: what open policies are chosen for.
  explicit Planner(const ServiceSurroundings& surroundings = {}) : surroundings_(surroundings) {}

  // Errors as of MakeFrameSetup and PlanFrame; ResourceExhausted or Internal for exceptions.
  Result<std::shared_ptr<const PlannedFrame>> Plan(const PlanRequest& request);

  // The same if that takes less time than to wake another thread: the policy is not open, its layout is made and stays, and nobody plans
  // at the moment. Nothing: ask Plan.
  std::optional<Result<std::shared_ptr<const PlannedFrame>>> PlanAtHand(const PlanRequest& request);

  // Learns from a finished frame.
  void Learn(const FrameMeasured& measured);

 private:
  Result<std::shared_ptr<const PlannedFrame>> TryPlan(const PlanRequest& request);
  static Result<std::shared_ptr<const PlannedFrame>> WithLayout(PlannedFrame planned, FrameSetup setup,
                                                                std::shared_ptr<const Layout> layout);

  const ServiceSurroundings surroundings_;
  std::mutex mutex_;  // guards what follows
  LayoutTable layouts_;
  PolicyTable policies_;
};

}  // namespace slabstream
