// Planner: makes plans, and keeps what they are made from: layouts and measured costs.
//
// Any thread may call it, and no plan waits for another one. A plan may take seconds, since a layout may be refined several times. The same
// calls, one after the other, give the same plans.
#pragma once

#include <memory>
#include <optional>

#include "coordinator/plan_request.h"
#include "coordinator/planner/layout_table.h"

namespace slabstream {

class Planner {
 public:
  // Errors as of MakeFrameSetup and PlanFrame; Cancelled: it was stopped; ResourceExhausted or Internal for exceptions.
  Result<std::shared_ptr<const PlannedFrame>> Plan(const PlanRequest& request);

  // The same if that takes less time than to wake another thread: its layout is made. Nothing: ask Plan.
  std::optional<Result<std::shared_ptr<const PlannedFrame>>> PlanAtHand(const PlanRequest& request);

  // Learns from a finished frame. May take as long as a plan.
  void Learn(const FrameMeasured& measured);

 private:
  Result<std::shared_ptr<const PlannedFrame>> TryPlan(const PlanRequest& request);
  // The result points at the request.
  static LayoutTable::Request WantedLayout(const PlanRequest& request, const FrameSetup& setup);
  // Plan and fit.
  static Result<PlannedFrame> WithLayout(const PlanRequest& asked, FrameSetup setup, std::shared_ptr<const Layout> layout);

  LayoutTable layouts_;
};

}  // namespace slabstream
