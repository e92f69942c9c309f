#include "laboratory/measure/frame_costs.h"

#include <gtest/gtest.h>

#include "common/mesh/lattice.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Every box that the plan places has its cost, in the place where the simulation looks for it, and the simulation takes it.
TEST(FrameCosts, FitTheirPlan) {
  const Volume volume = AsGrid(MakeBlobs({{40, 32, 48}, {1, 1, 1}}, ScalarType::kUint8, 3));
  for (const RendererKind* renderer : Renderers()) {
    FrameRequest request;
    request.dataset = "blobs";
    request.renderer = renderer->name();
    request.size = {64, 48};
    request.policy.groups = 2;
    const FramePlan plan = PlanFrame(request, 1, SummaryOf(volume), Roster{{1, 2, 3}}).value();
    const FrameCosts costs = MeasureFrameCosts(volume, plan, 1);
    EXPECT_GT(costs.picture.finish_seconds, 0);
    EXPECT_GT(costs.picture.receive_seconds, 0);
    double render_seconds = 0;
    for (const GroupPlan& group : plan.groups) {
      for (const Placement& placement : group.placements) {
        const BoxCost& cost = costs.boxes.at(placement.id);
        EXPECT_EQ(cost.box, placement.box);
        EXPECT_NEAR(cost.coverage.pixels(), double(cost.covered_pixels), 0.5);
        const CostSample sample = SampleOf(cost, plan.setup.camera);
        EXPECT_EQ(sample.work[std::size_t(WorkUnit::kBox)], 1);
        EXPECT_EQ(sample.work[std::size_t(WorkUnit::kDrawn)], double(cost.drawn_voxels));
        render_seconds += cost.seconds;
      }
    }
    const FrameInput input = costs.Input(plan);
    const Timeline timeline = SimulateFrames(std::span(&input, 1), MachineModel()).value();
    EXPECT_NEAR(timeline.frames[0].stage_seconds[std::size_t(Stage::kRender)], render_seconds, 1e-9);
    EXPECT_GT(timeline.frames[0].image_bytes, 0);
  }
}

}  // namespace
}  // namespace slabstream
