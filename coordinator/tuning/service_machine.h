// ServiceMachine: the machine model of a coordinator's own workers, as far as it knows them, for the simulation of frames to come.
#pragma once

#include <cstdint>
#include <span>

#include "common/planning/hosted_worker.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

// The link between hosts unless the coordinator is told otherwise: a preset of LinkPresets().
inline constexpr char kDefaultLink[] = "10gbit";
LinkModel DefaultLink();

struct ServiceSurroundings {
  LinkModel link = DefaultLink();  // between workers of different hosts
  std::uint64_t memory_scope = 0;  // the coordinator's own host; 0: unknown
  std::int32_t cores = 1;          // of that host
  bool encrypted = false;          // images that travel, over tcp
  friend bool operator==(const ServiceSurroundings&, const ServiceSurroundings&) = default;
};

// If all workers share a host, they share its cores: those of the coordinator's host if it is theirs, else as many as they have threads.
// They lend each other their images; if one of them does not, all images count as messages through the host's loopback. Otherwise each
// worker counts as a host of its own behind `link`, images travel in messages, and the slowest link decides.
MachineModel ServiceMachine(std::span<const HostedWorker> workers, const ServiceSurroundings& surroundings);

}  // namespace slabstream
