// Tables beside the results: what a timeline or a partition looks like.
#pragma once

#include <string>

#include "laboratory/experiments/frame_case.h"
#include "laboratory/results/results.h"
#include "simulator/model/timeline.h"

namespace slabstream {

// A row a span of work and a row a message, of a simulated run with kept spans: worker (from 1), lane, frame, group (from 1), stage, begin,
// end (s).
void AttachTimeline(Results& results, const std::string& name, const Timeline& timeline);

// A row a box: its number, first and one-past-last voxel on each axis, worker (from 1), seconds, and the volume's size on each axis.
void AttachBoxes(Results& results, const std::string& name, const MeasuredFrame& frame);

}  // namespace slabstream
