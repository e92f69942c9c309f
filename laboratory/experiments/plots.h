// Plots that several experiments share.
#pragma once

#include <string>

#include "common/simulation/timeline.h"
#include "laboratory/experiments/frame_case.h"
#include "laboratory/report/axis.h"
#include "laboratory/report/document.h"

namespace slabstream {

// Numbers of workers, with a mark at each.
AxisSpec WorkersAxis(AxisScale scale = AxisScale::kLog);

// The work of the first `most_workers` workers in [from, to) seconds of a simulated run (spans kept): a lane for each thread of a worker,
// and one for what arrives there.
Figure TimelineFigure(const std::string& name, const std::string& title, const Timeline& timeline, double from, double to,
                      const std::string& caption, std::uint32_t most_workers = 12);

// The cost of each box, on three cuts through the middle of the volume.
Figure BoxCostFigure(const std::string& name, const std::string& title, const MeasuredFrame& frame, const std::string& caption);

}  // namespace slabstream
