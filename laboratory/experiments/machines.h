// The machines on which experiments simulate frames: this machine's processors, joined by some link.
#pragma once

#include <string_view>
#include <vector>

#include "laboratory/experiments/frame_case.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

// Measures this machine's constants for the simulation (laboratory/measure/calibrate.h), except those for pixels that travel between hosts.
Trial HostTrial();

// A host for each worker, with cores of this machine's speed.
struct HostModel {
  int cores = 2;                // if there are two, one renders and one does everything else
  bool encrypted = false;       // what hosts send each other, which costs processor time
  bool direct_pictures = true;  // if it is encrypted: pictures do not pass the coordinator
};
// Such hosts, joined by `link`. HostTrial must have been run.
MachineModel Cluster(const ExperimentContext& context, const LinkModel& link, const HostModel& host = {});
// The same for every repeat of HostTrial.
std::vector<MachineModel> Clusters(const ExperimentContext& context, const LinkModel& link, const HostModel& host = {});
LinkModel Link(std::string_view preset);  // a name of LinkPresets()
// The preset of experiments that do not compare links.
inline constexpr std::string_view kLink = "10gbit";

}  // namespace slabstream
