// `logs`: what the processes of a service that `up` started on this host have logged.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/interrupt.h"
#include "client/cli/log_lines.h"
#include "client/service/service_state.h"
#include "common/base/printable.h"
#include "common/cli/program.h"
#include "common/transport/socket.h"

namespace slabstream {
namespace {

constexpr Duration kLogPollInterval = std::chrono::milliseconds(200);

// New lines of all logs in the folder, files that have come since included.
class Logs {
 public:
  explicit Logs(std::string folder) : folder_(std::move(folder)) {}

  Status Print(const std::string& since) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
      if (entry.path().extension() == ".log") files_.try_emplace(entry.path().string(), entry.path().string());
    }
    std::vector<std::vector<std::string>> lines;
    for (auto& [path, file] : files_) {
      std::vector<std::string>& all = lines.emplace_back();
      for (std::vector<std::string> more = file.ReadMore(); !more.empty(); more = file.ReadMore()) {
        all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
      }
    }
    for (const std::string& line : MergeLogLines(lines, since)) std::cout << Printable(line) << '\n';
    return FlushOutput();
  }

 private:
  const std::string folder_;
  std::map<std::string, LogFile> files_;  // by path
};

// The service that is meant, whether it runs or has left its logs.
Result<ServiceState> ServiceHere(const ServiceChoice& choice) {
  const Result<ServiceChoice> named = NamedService(choice);
  if (!named.ok()) return named.status();
  std::string endpoint = named->endpoint;
  if (!named->file.empty()) {
    const Result<ServiceAddress> address = ResolveService(*named);
    if (!address.ok()) return address.status();
    endpoint = address->endpoint;
  }
  std::optional<ServiceState> state = FindState(endpoint);
  if (!state) state = FindRemains(endpoint);
  if (state) return *std::move(state);
  return Status::Unavailable(
      fmt::format("`slabstream up` of this user started no service{} on this host; logs are on the host where a service was started",
                  endpoint.empty() ? "" : " at " + endpoint));
}

}  // namespace

Status RunLogs(const LogsOptions& options) {
  const Result<ServiceState> service = ServiceHere(options.service);
  if (!service.ok()) return service.status();
  std::error_code error;
  if (!std::filesystem::is_directory(service->log_directory, error)) {
    return Status::Unavailable(
        fmt::format("the service at {} has no logs: there is no folder '{}'", service->endpoint, service->log_directory));
  }
  Logs logs(service->log_directory);
  std::string since = options.since > Duration::zero() ? LogTime(std::chrono::duration<double>(options.since).count()) : "";
  Wakeup wakeup;
  const InterruptGuard guard(wakeup);
  bool runs = true;
  do {
    runs = options.follow && IsRunning(service->coordinator, kCoordinatorProgram) && !guard.interrupted();
    if (Status printed = logs.Print(since); !printed.ok()) return printed;
    since.clear();  // all later lines are new
    if (runs) Wait({}, &wakeup, kLogPollInterval);
  } while (runs);  // what was written before the end is printed
  return Status::Ok();
}

}  // namespace slabstream
