// The machines on which experiments simulate frames: this one's processors, joined by some link.
#pragma once

#include <string_view>

#include "client/experiment/frame_case.h"
#include "common/simulation/machine_model.h"

namespace slabstream {

// Measures this machine as the simulation wants to know it (client/lab/calibrate.h), with `workers` workers of one thread each.
Trial HostTrial(int workers);
// How much two renderers of this picture slow each other down.
Trial NeighbourTrial(ExperimentContext& context, const FrameCase& frame);

// This machine with frame.workers workers, as the embedded service runs them. Its HostTrial and the frame's NeighbourTrial must have been
// run.
MachineModel ThisMachine(const ExperimentContext& context, const FrameCase& frame);

// A host for each worker, of kCoresAHost cores of this machine's speed, joined by `link`: one core for rendering, one for all else.
// HostTrial(1) must have been run.
inline constexpr int kCoresAHost = 2;
MachineModel Cluster(const ExperimentContext& context, const LinkModel& link);
LinkModel Link(std::string_view preset);  // of LinkPresets()

// The paper's machine as far as the paper's figures go: a bus on which an image of `pixels` pixels takes the share of a frame of
// `frame_seconds` on one processor that it took on theirs, and nothing of what a service does around a frame (planning, messages to a
// coordinator, the picture's way to a client), which its authors did not have or did not count. A worker is one processor.
MachineModel PaperMachine(const ExperimentContext& context, double frame_seconds, double pixels);

}  // namespace slabstream
