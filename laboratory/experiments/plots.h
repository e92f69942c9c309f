// Plots that several experiments draw from the same things.
#pragma once

#include <string>

#include "common/simulation/timeline.h"
#include "laboratory/experiments/frame_case.h"
#include "laboratory/report/axis.h"
#include "laboratory/report/document.h"

namespace slabstream {

// Numbers of workers, each of which is marked.
AxisSpec WorkersAxis(AxisScale scale = AxisScale::kLog);

// What the workers do in [from, to) seconds of a simulated run (spans kept): a lane for each thread of a worker, one for what arrives
// there. The first `most_workers` of them.
Figure TimelineFigure(const std::string& name, const std::string& title, const Timeline& timeline, double from, double to,
                      const std::string& caption, std::uint32_t most_workers = 12);

// What each box costs, on three cuts through the middle of the volume.
Figure BoxCostFigure(const std::string& name, const std::string& title, const MeasuredFrame& frame, const std::string& caption);

}  // namespace slabstream
