// The record that `up` keeps of a service that it started, so that `down` and `status` find it: one JSON file a service, named after its
// endpoint, in $XDG_RUNTIME_DIR/slabstream if that variable names a directory of this user, or else in /tmp/slabstream-UID. The directory
// is the user's own (0700). The processes' logs are in it too.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

inline constexpr const char* kDefaultEndpoint = "tcp://127.0.0.1:7420";

struct ServiceState {
  std::string endpoint;           // for clients, with the port that was chosen
  std::int64_t started_unix = 0;  // seconds
  pid_t coordinator = 0;
  std::vector<pid_t> workers;
  std::string log_directory;  // a subdirectory of StateDirectory()
  friend bool operator==(const ServiceState&, const ServiceState&) = default;
};

// Creates the directory if it does not exist. Unavailable, naming XDG_RUNTIME_DIR: it cannot be created or belongs to somebody else.
Result<std::string> StateDirectory();

Status SaveState(const ServiceState& state);
void RemoveState(const ServiceState& state);  // and its logs

// The state of the service at `endpoint`, or of the last one started if `endpoint` is empty. Only services with a running coordinator
// count; files of others are removed. nullopt: there is none.
std::optional<ServiceState> FindState(const std::string& endpoint);

// $SLABSTREAM_ENDPOINT, else that of the last service started, else kDefaultEndpoint. InvalidArgument: the variable holds no endpoint.
Result<std::string> DefaultEndpoint();

// Whether `pid` runs (a zombie does not) and is one of ours: its /proc/PID/stat names `program` (the kernel keeps 15 characters).
bool IsRunning(pid_t pid, const std::string& program);

inline constexpr const char* kCoordinatorProgram = "slabstream-coordinator";
inline constexpr const char* kWorkerProgram = "slabstream-worker";

}  // namespace slabstream
