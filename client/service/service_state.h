// The record that `up` keeps of a service that it started, so that `down` and `status` find it: one JSON file a service, named after its
// endpoint, in $XDG_RUNTIME_DIR/slabstream if that variable names a directory of this user, or else in /tmp/slabstream-UID. The directory
// is the user's own (0700). The processes' logs are in it too.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/client.h"
#include "client/service/service_choice.h"
#include "common/base/status.h"
#include "common/base/time.h"

namespace slabstream {

inline constexpr const char* kDefaultEndpoint = "tcp://127.0.0.1:7420";

struct ServiceState {
  std::string endpoint;     // for clients, with the port that was chosen
  double started_unix = 0;  // seconds; two services may start within one
  pid_t coordinator = 0;
  std::vector<pid_t> workers;
  std::string log_directory;    // a subdirectory of StateDirectory()
  std::string keys_folder;      // empty: it has no keys
  std::string worker_endpoint;  // and for owners
  bool unlisted = false;        // one `view` started it: only who names its endpoint means it
  friend bool operator==(const ServiceState&, const ServiceState&) = default;
};

// Creates the directory if it does not exist. Unavailable, naming XDG_RUNTIME_DIR: it cannot be created or belongs to somebody else.
Result<std::string> StateDirectory();
// The files there whose names end so: ".json". Empty: none, or there is no such directory.
std::vector<std::string> StateFiles(std::string_view ending);

Status SaveState(const ServiceState& state);
void ForgetState(const ServiceState& state);  // keeps its logs, and what another service has saved for its endpoint since
void RemoveState(const ServiceState& state);  // and its logs

// The state of the service at `endpoint`, or of the last listed one started if `endpoint` is empty. nullopt: none whose coordinator runs.
std::optional<ServiceState> FindState(const std::string& endpoint);
// The same of a service whose coordinator has ended without its doing, so that its workers may still run.
std::optional<ServiceState> FindRemains(const std::string& endpoint);
// All services that `up` has a record of, the first one started first: also those whose coordinators have ended.
std::vector<ServiceState> AllStates();
// Ends the processes of the service that still run: takes the EndSteps, unless they end by themselves within `patience`.
inline constexpr Duration kEndPatience = std::chrono::seconds(5);
void EndProcesses(const ServiceState& state, Duration patience);

// `text` as a part of a file's name: letters, digits, '.' and '-' stay, anything else becomes '_'.
std::string FileNameOf(std::string text);

// The service that the user names: `choice`; else $SLABSTREAM_SERVICE, a service file; else $SLABSTREAM_ENDPOINT; else neither file nor
// endpoint. InvalidArgument: that variable holds no endpoint.
Result<ServiceChoice> NamedService(const ServiceChoice& choice);
// Its address (an endpoint beside a service file is another way to the same service, such as the near end of a tunnel); if none is named,
// that of the last service started here by this user: whoever else listens is not meant. A service that `up` started here with keys is
// reached as its admin. Errors: of NamedService and ReadServiceFile; InvalidArgument: the file is a worker's; Unavailable: none is named,
// and `up` of this user has started none here that runs.
Result<ServiceAddress> ResolveService(const ServiceChoice& choice);
// Where an owner of voxels finds its service: `text`, the path of a service file of role owner, or an endpoint for workers; if it is empty,
// what $SLABSTREAM_OWNER_SERVICE names; else the last service started here; else where one listens for workers by default.
// InvalidArgument: the endpoint is none.
Result<ServiceChoice> ResolveOwnerService(std::string text);

// Whether `pid` runs (a zombie does not) and is one of ours: its /proc/PID/stat names `program` (the kernel keeps 15 characters).
bool IsRunning(pid_t pid, const std::string& program);

inline constexpr const char* kCoordinatorProgram = "slabstream-coordinator";
inline constexpr const char* kWorkerProgram = "slabstream-worker";

}  // namespace slabstream
