#include "laboratory/measure/validate.h"

#include <gtest/gtest.h>

#include "common/mesh/summarize_cells.h"
#include "common/planning/placement.h"
#include "laboratory/measure/plan_renderings.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

ValidationCase SmallCase(const RendererKind* renderer, int workers) {
  ValidationCase what{.name = "blobs", .workers = workers};
  what.volume = std::make_shared<const Volume>(AsGrid(MakeBlobs({{40, 32, 48}, {1, 1, 1}}, ScalarType::kUint8, 3)));
  what.request.renderer = renderer->name();
  what.request.size = {64, 48};
  return what;
}

// Whatever the machine does meanwhile: both sides are there for every view, and their parts fit into the whole.
TEST(Validation, HasBothSidesOfEveryView) {
  for (const RendererKind* renderer : Renderers()) {
    for (const int workers : {1, 2}) {
      const Result<ValidationRow> row = ValidateSimulation(SmallCase(renderer, workers), {.views = 3, .turns = 1});
      ASSERT_TRUE(row.ok()) << row.status().message();
      ASSERT_EQ(row->views.size(), 3U);
      EXPECT_EQ(row->slowdown.count, workers == 2 ? 3 : 0);
      for (const ValidatedView& view : row->views) {
        for (const FrameParts& parts : {view.measured, view.simulated}) {
          EXPECT_GT(parts.render, 0);
          EXPECT_GT(parts.picture, 0);
          EXPECT_GT(parts.latency, parts.render + parts.picture);
        }
        EXPECT_EQ(view.measured_low, view.measured.latency);  // of one turn
        EXPECT_EQ(view.simulated_high, view.simulated.latency);
      }
    }
  }
}

TEST(Validation, TurnsFromTheAzimuthOfTheRequest) {
  ValidationCase what = SmallCase(Splatting(), 1);
  what.request.view.azimuth_degrees = 30;
  what.request.view.roll_degrees = 5;
  const Result<ValidationRow> row = ValidateSimulation(what, {.views = 2, .turns = 1});
  ASSERT_TRUE(row.ok()) << row.status().message();
  ASSERT_EQ(row->views.size(), 2U);
  EXPECT_EQ(row->views[0].view, what.request.view);
  EXPECT_EQ(row->views[1].view.azimuth_degrees, 210);
  EXPECT_EQ(row->views[1].view.roll_degrees, 5);
}

TEST(Validation, RefusesMoreWorkersThanItCanMeasureSideBySide) {
  const Result<ValidationRow> row = ValidateSimulation(SmallCase(Splatting(), 3), {});
  EXPECT_EQ(row.status().code(), StatusCode::kInvalidArgument);
}

TEST(PlanRenderings, MeasureEveryBoxOfThePlan) {
  const ValidationCase what = SmallCase(Splatting(), 2);
  FrameRequest request = what.request;
  request.dataset = "blobs";
  request.policy.groups = 2;
  const FramePlan plan = PlanFrame(request, 1, SummaryOf(*what.volume), Roster{{1, 2}}).value();
  PlanRenderings renderings(*what.volume, 2);
  const PlanSeconds seconds = renderings.Measure(plan);
  ASSERT_EQ(seconds.boxes.size(), plan.layout->partition.boxes().size());
  for (const Placement& placement : PlacementsOf(plan)) EXPECT_GT(seconds.boxes[placement.id], 0) << placement.id;
}

}  // namespace
}  // namespace slabstream
