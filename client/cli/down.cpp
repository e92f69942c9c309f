// `down`: asks the service to end, waits for its processes, and ends those that do not react. It touches only processes of the state file
// that still have our name.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/service_state.h"
#include "client/cli/session.h"

namespace slabstream {
namespace {

constexpr Duration kPatience = std::chrono::seconds(5);  // before SIGTERM, and again before SIGKILL

using Process = std::pair<pid_t, std::string>;  // pid, program

// Whether all of them ended in time.
bool WaitForEnd(const std::vector<Process>& processes) {
  const auto runs = [](const Process& process) { return IsRunning(process.first, process.second); };
  for (const Time deadline = MonotonicNow() + kPatience; std::any_of(processes.begin(), processes.end(), runs);) {
    if (MonotonicNow() >= deadline) return false;
    ::usleep(20000);
  }
  return true;
}

void EndProcesses(const ServiceState& state) {
  std::vector<Process> processes;
  for (const pid_t worker : state.workers) processes.emplace_back(worker, kWorkerProgram);
  processes.emplace_back(state.coordinator, kCoordinatorProgram);
  for (const int signal : {SIGTERM, SIGKILL}) {
    if (WaitForEnd(processes)) return;
    for (const auto& [pid, program] : processes) {
      if (IsRunning(pid, program)) ::kill(pid, signal);
    }
  }
  WaitForEnd(processes);
}

}  // namespace

Status RunDown(const DownOptions& options) {
  const Result<std::string> endpoint = options.endpoint.empty() ? DefaultEndpoint() : Result<std::string>(options.endpoint);
  if (!endpoint.ok()) return endpoint.status();
  const std::optional<ServiceState> state = FindState(*endpoint);
  Status asked;
  {
    Result<Session> session = Session::OpenService(*endpoint);
    asked = session.ok() ? session->client().ShutDownService() : session.status();
  }
  if (!state) {
    if (!asked.ok()) return Status::Unavailable(fmt::format("no service runs at {}", *endpoint));
    std::cout << fmt::format("{} was told to end\n", *endpoint);
    return Status::Ok();
  }
  EndProcesses(*state);
  RemoveState(*state);
  std::cout << fmt::format("{} is down ({} workers)\n", *endpoint, state->workers.size());
  return Status::Ok();
}

}  // namespace slabstream
