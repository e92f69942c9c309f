// The machines on which experiments simulate frames: this machine's processors, joined by some link.
#pragma once

#include <string_view>
#include <vector>

#include "common/simulation/machine_model.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

// Measures this machine's constants for the simulation (laboratory/measure/calibrate.h), except those for pixels that travel between hosts.
Trial HostTrial();

// A host for each worker, of kCoresAHost cores of this machine's speed, joined by `link`: one core renders, one does everything else.
// HostTrial must have been run.
inline constexpr int kCoresAHost = 2;
MachineModel Cluster(const ExperimentContext& context, const LinkModel& link);
// The same for every repeat of HostTrial.
std::vector<MachineModel> Clusters(const ExperimentContext& context, const LinkModel& link);
LinkModel Link(std::string_view preset);  // of LinkPresets()

// The paper's machine, as far as the paper's figures describe it. An image of `pixels` pixels on its bus takes the same share of
// `frame_seconds`, the time of a frame on one processor, as it took on theirs. It has none of a service's costs around a frame (planning,
// messages to a coordinator, the picture's way to a client), which the authors did not have or did not count. A worker is one processor.
MachineModel PaperMachine(const ExperimentContext& context, double frame_seconds, double pixels);

}  // namespace slabstream
