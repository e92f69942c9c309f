// The machines on which experiments simulate frames: this one's processors, joined by some link.
#pragma once

#include <string_view>

#include "common/simulation/machine_model.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

// Measures this machine's constants as the simulation wants to know them (laboratory/measure/calibrate.h), but for pixels that travel
// between hosts.
Trial HostTrial();

// A host for each worker, of kCoresAHost cores of this machine's speed, joined by `link`: one core for rendering, one for all else.
// HostTrial must have been run.
inline constexpr int kCoresAHost = 2;
MachineModel Cluster(const ExperimentContext& context, const LinkModel& link);
LinkModel Link(std::string_view preset);  // of LinkPresets()

// The paper's machine as far as the paper's figures go: a bus on which an image of `pixels` pixels takes the share of a frame of
// `frame_seconds` on one processor that it took on theirs, and nothing of what a service does around a frame (planning, messages to a
// coordinator, the picture's way to a client), which its authors did not have or did not count. A worker is one processor.
MachineModel PaperMachine(const ExperimentContext& context, double frame_seconds, double pixels);

}  // namespace slabstream
