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

}  // namespace slabstream
