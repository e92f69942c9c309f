// `down`: asks the service to end, waits for its processes, and ends those that do not react. It touches only processes of the state file
// that still have our name.
#include <fmt/format.h>

#include <iostream>
#include <utility>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/service/service_state.h"
#include "common/cli/program.h"

namespace slabstream {
namespace {

// What a coordinator that crashed has left behind.
Status EndRemains(const ServiceState& remains) {
  EndProcesses(remains, Duration::zero());
  ForgetState(remains);
  std::cout << fmt::format("the coordinator of {} had already ended; stopped its {} workers; logs are in {}\n", remains.endpoint,
                           remains.workers.size(), remains.log_directory);
  return Status::Ok();
}

Status EndOne(const ServiceChoice& choice) {
  const Result<ServiceChoice> named = NamedService(choice);
  if (!named.ok()) return named.status();
  // If none is named, the last service that runs is meant. If none runs, it is the last one whose coordinator has crashed.
  if (named->file.empty() && !FindState(named->endpoint)) {
    if (const auto remains = FindRemains(named->endpoint)) return EndRemains(*remains);
  }
  const Result<ServiceAddress> service = ResolveService(*named);
  if (!service.ok()) return service.status();
  const std::optional<ServiceState> state = FindState(service->endpoint);
  Status asked;
  {
    Result<ServiceConnection> connection = ServiceConnection::OpenRunning(*service);
    asked = connection.ok() ? connection->client().ShutDownService() : connection.status();
  }
  if (!state) {
    if (!asked.ok()) return asked;
    std::cout << fmt::format("{} was told to end\n", service->endpoint);
    return Status::Ok();
  }
  EndProcesses(*state, kEndPatience);
  RemoveState(*state);
  std::cout << fmt::format("{} is down ({} workers)\n", service->endpoint, state->workers.size());
  return Status::Ok();
}

// Those that do not end do not keep the others.
Status EndAll() {
  const std::vector<ServiceState> states = AllStates();
  if (states.empty()) std::cout << "no service that `up` started runs here\n";
  std::vector<Status> failures;
  for (const ServiceState& state : states) {
    if (state.unlisted && IsRunning(state.coordinator, kCoordinatorProgram)) continue;  // it ends with its `view`
    if (Status status = EndOne({.endpoint = state.endpoint, .file = {}}); !status.ok()) failures.push_back(std::move(status));
  }
  return ReportAll("slabstream down", failures);
}

}  // namespace

Status RunDown(const DownOptions& options) { return options.all ? EndAll() : EndOne(options.service); }

}  // namespace slabstream
