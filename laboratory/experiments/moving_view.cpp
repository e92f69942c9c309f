#include "laboratory/experiments/moving_view.h"

#include <algorithm>

#include "common/planning/balance.h"
#include "common/planning/placement.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/measure/box_costs.h"

namespace slabstream {
namespace {

constexpr int kRenderings = 3;

KeyedFrame ForMoving(ExperimentContext& context, const FrameCase& first, int frames) {
  return WithoutCombining(context, "moving view", first, {{"frames", frames}, {"turn", kMovingFrames}});
}

Json MeasureMoving(ExperimentContext& context, FrameCase frame, int frames) {
  const LayoutKnowledge knowledge = KnowLayout(context, frame);
  MeasuredLayouts layouts = LayoutsOf(knowledge, frame.workers);
  const auto voxel_bytes = double(BytesPerSample(knowledge.volume.summary->description.type));
  const double first_azimuth = frame.view.azimuth_degrees;
  std::shared_ptr<const Layout> layout;
  Json numbers = {{"imbalance", Json::array()}, {"slowest_ms", Json::array()}, {"moved_bytes", Json::array()}};
  for (int i = 0; i < frames; ++i) {
    frame.view.azimuth_degrees = first_azimuth + 360.0 * i / kMovingFrames;
    const std::shared_ptr<const Layout> next = layouts.Next(RequestOf(frame));
    const double moved = i == 0 ? 0 : double(MovedVoxels(*layout, *next)) * voxel_bytes;
    layout = next;
    const FramePlan plan = PlanOf(context, frame, layout);
    const std::vector<Placement> placements = PlacementsOf(plan);
    std::vector<double> seconds(std::size_t(frame.workers));
    std::vector<std::int64_t> nanoseconds;
    for (const BoxCost& cost : MeasureBoxCosts(*knowledge.volume.volume, plan, kRenderings)) {
      seconds[placements[nanoseconds.size()].worker - 1] += cost.seconds;
      nanoseconds.push_back(std::int64_t(cost.seconds * 1e9));
    }
    layouts.Learn(plan, nanoseconds);
    numbers["imbalance"].push_back(Imbalance(seconds));
    numbers["slowest_ms"].push_back(*std::ranges::max_element(seconds) * 1e3);
    numbers["moved_bytes"].push_back(moved);
  }
  return numbers;
}

}  // namespace

Json MovingKey(ExperimentContext& context, const FrameCase& first, int frames) { return ForMoving(context, first, frames).key; }

Trial MovingTrial(ExperimentContext& context, const FrameCase& first, int frames) {
  const KeyedFrame keyed = ForMoving(context, first, frames);
  return keyed.MakeTrial(
      context, [&context, frame = keyed.frame, frames] { return MeasureMoving(context, frame, frames); }, frames * 20.0);
}

}  // namespace slabstream
