// FramePredictor: predicts the time of a frame with one layout and one way to combine, by the simulation that experiments use
// (simulator/model), with estimated boxes (box_estimator.h). Pure and deterministic.
//
// It simulates a coarse frame: pixels are merged until ranks x tiles are at most kMostTiles, and costs per pixel grow accordingly.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/stats/prediction.h"
#include "coordinator/tuning/box_estimator.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

class FramePredictor {
 public:
  static constexpr std::int64_t kMostTiles = std::int64_t{1} << 17;  // of all ranks of a group
  static constexpr std::int64_t kMostFrameTiles = 1024;
  static constexpr std::uint64_t kMostSteps = 8192;  // of a frame: schedules of more are too long to be tried

  // `render_scale`: measured / predicted time of boxes so far. All arguments must live as long as this.
  FramePredictor(const FrameSetup& setup, const VolumeSummary& summary, const OccupancyGrid& occupied, const WorkField* measured,
                 const MachineModel& machine, std::uint32_t slots, double render_scale);

  // A layout with estimated boxes, ready for any scheme.
  struct Prepared {
    FramePlan plan;  // of the coarse frame; without schedules
    std::vector<BoxEstimator::Estimate> boxes;
  };
  Prepared Prepare(Layout layout) const;  // `layout` has as many slots as this

  // `combine` is a scheme (ParseCombining). None: its schedule has more than kMostSteps steps, extrapolated from fewer ranks.
  std::optional<FramePrediction> Predict(Prepared& prepared, const std::string& combine) const;

 private:
  bool Affordable(const Prepared& prepared, const std::string& combine) const;

  const std::uint32_t slots_;
  const double render_scale_;
  const std::int32_t pixel_side_;
  const FrameSetup coarse_;
  const BoxEstimator estimator_;
  const double finish_seconds_, receive_seconds_;
  MachineModel machine_;  // its pixels are coarse
  Roster roster_;
};

}  // namespace slabstream
