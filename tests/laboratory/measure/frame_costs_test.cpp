#include "laboratory/measure/frame_costs.h"

#include <gtest/gtest.h>

#include "common/mesh/summarize_cells.h"
#include "simulator/simulate_frames.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Every box that the plan places has its cost, and the simulation takes them all.
TEST(FrameCosts, FitTheirPlan) {
  const Volume volume = AsGrid(MakeBlobs({{40, 32, 48}, {1, 1, 1}}, ScalarType::kUint8, 3));
  for (const RendererKind* renderer : Renderers()) {
    FrameRequest request;
    request.dataset = "blobs";
    request.renderer = renderer->name();
    request.size = {64, 48};
    request.policy.groups = 2;
    const FramePlan plan = PlanFrame(request, 1, SummaryOf(volume), Roster{{1, 2, 3}}).value();
    const PictureCost picture = MeasurePictureCost(volume, plan.setup, 1);
    EXPECT_GT(picture.finish_seconds, 0);
    EXPECT_GT(picture.receive_seconds, 0);
    const std::vector<BoxCost> costs = MeasureBoxCosts(volume, plan, 1);
    const std::vector<Placement> placements = PlacementsOf(plan);
    ASSERT_EQ(costs.size(), placements.size());
    FrameInput input{&plan, {}, picture.finish_seconds, picture.receive_seconds, picture.bytes};
    input.boxes.resize(plan.layout->partition.boxes().size());
    double render_seconds = 0;
    for (std::size_t i = 0; i < costs.size(); ++i) {
      const BoxCost& cost = costs[i];
      EXPECT_EQ(cost.box, placements[i].box);
      EXPECT_NEAR(cost.coverage.pixels(), double(cost.covered_pixels), 0.5);
      const CostSample sample = SampleOf(cost, plan.setup.camera);
      EXPECT_EQ(sample.work[std::size_t(WorkUnit::kBox)], 1);
      EXPECT_EQ(sample.work[std::size_t(WorkUnit::kDrawn)], double(cost.drawn_voxels));
      input.boxes[placements[i].id] = {cost.seconds, &cost.coverage, 0};
      render_seconds += cost.seconds;
    }
    const Timeline timeline = SimulateFrames(std::span(&input, 1), MachineModel()).value();
    EXPECT_NEAR(timeline.frames[0].stage_seconds[std::size_t(Stage::kRender)], render_seconds, 1e-9);
    EXPECT_GT(timeline.frames[0].image_bytes, 0);
  }
}

}  // namespace
}  // namespace slabstream
