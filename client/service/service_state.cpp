#include "client/service/service_state.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "client/service/process.h"
#include "common/files/files.h"
#include "common/json/json.h"
#include "common/service/service_file.h"
#include "common/transport/endpoint.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxStateBytes = std::size_t{1} << 20;

std::string FileFor(const std::string& directory, const std::string& endpoint) {
  return fmt::format("{}/{}.json", directory, FileNameOf(endpoint));
}

// nullopt: damaged.
std::optional<ServiceState> Load(const std::string& path) {
  const Result<std::string> text = ReadTextFile(path, kMaxStateBytes);
  if (!text.ok()) return std::nullopt;
  const Result<Json> json = Json::Parse(*text);
  if (!json.ok()) return std::nullopt;
  try {
    return ServiceState{json->at("endpoint").text(),
                        json->at("started_unix").get<double>(),
                        json->at("coordinator").get<pid_t>(),
                        json->at("workers").get<std::vector<pid_t>>(),
                        json->at("log_directory").text(),
                        json->value("keys_folder", std::string()),
                        json->value("worker_endpoint", std::string()),
                        json->value("unlisted", false)};
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

// The folder named by XDG_RUNTIME_DIR may be missing (no login session) or belong to another user (sudo and su pass the variable on).
bool IsOwnDirectory(const char* path) {
  struct stat info {};
  return path != nullptr && path[0] == '/' && ::stat(path, &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == ::getuid();
}

}  // namespace

std::string FileNameOf(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '-'; }, '_');
  return text;
}

Result<std::string> StateDirectory() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::string path = IsOwnDirectory(runtime) ? fmt::format("{}/slabstream", runtime) : fmt::format("/tmp/slabstream-{}", ::getuid());
  if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) {
    return Status::Unavailable(
        fmt::format("cannot make the directory '{}': {}; $XDG_RUNTIME_DIR chooses another place", path, std::strerror(errno)));
  }
  struct stat info {};
  // lstat: a link that somebody else left in /tmp is not ours, wherever it points.
  if (::lstat(path.c_str(), &info) != 0 || !S_ISDIR(info.st_mode) || info.st_uid != ::getuid() || (info.st_mode & 077) != 0) {
    return Status::Unavailable(
        fmt::format("'{}' must be a directory of this user alone (mode 0700); $XDG_RUNTIME_DIR chooses another place", path));
  }
  return path;
}

std::vector<std::string> StateFiles(std::string_view ending) {
  std::vector<std::string> files;
  const Result<std::string> directory = StateDirectory();
  if (!directory.ok()) return files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(*directory, error)) {
    if (entry.path().extension() == ending) files.push_back(entry.path());
  }
  return files;
}

Status SaveState(const ServiceState& state) {
  const Result<std::string> directory = StateDirectory();
  if (!directory.ok()) return directory.status();
  const Json json = {{"coordinator", state.coordinator},         {"endpoint", state.endpoint},
                     {"keys_folder", state.keys_folder},         {"log_directory", state.log_directory},
                     {"started_unix", state.started_unix},       {"unlisted", state.unlisted},
                     {"worker_endpoint", state.worker_endpoint}, {"workers", state.workers}};
  return WriteTextFile(FileFor(*directory, state.endpoint), json.dump(2) + "\n");
}

void ForgetState(const ServiceState& state) {
  const Result<std::string> directory = StateDirectory();
  if (!directory.ok()) return;
  const std::string file = FileFor(*directory, state.endpoint);
  const std::optional<ServiceState> kept = Load(file);
  if (kept && kept->coordinator != state.coordinator) return;  // of another service, which has the endpoint now
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
}

void RemoveState(const ServiceState& state) {
  const Result<std::string> directory = StateDirectory();
  if (!directory.ok()) return;
  ForgetState(state);
  std::error_code ignored;
  if (std::filesystem::path(state.log_directory).parent_path() == *directory) std::filesystem::remove_all(state.log_directory, ignored);
}

std::vector<ServiceState> AllStates() {
  std::vector<ServiceState> states;
  for (const std::string& file : StateFiles(".json")) {
    if (std::optional<ServiceState> state = Load(file)) states.push_back(*std::move(state));
  }
  std::ranges::sort(states, {}, &ServiceState::started_unix);
  return states;
}

namespace {

// The newest one at `endpoint`, or the newest listed one anywhere if that is empty.
std::optional<ServiceState> Newest(const std::string& endpoint, bool runs) {
  std::optional<ServiceState> newest;
  for (ServiceState& state : AllStates()) {
    const bool meant = endpoint.empty() ? !state.unlisted : state.endpoint == endpoint;
    if (!meant || IsRunning(state.coordinator, kCoordinatorProgram) != runs) continue;
    if (!newest || state.started_unix > newest->started_unix) newest = std::move(state);
  }
  return newest;
}

using Process = std::pair<pid_t, std::string>;  // pid, program

// Whether all of them ended in time.
bool WaitForEnd(const std::vector<Process>& processes, Duration patience) {
  const auto runs = [](const Process& process) { return IsRunning(process.first, process.second); };
  for (const Time deadline = MonotonicNow() + patience; std::any_of(processes.begin(), processes.end(), runs);) {
    if (MonotonicNow() >= deadline) return false;
    ::usleep(20000);
  }
  return true;
}

}  // namespace

std::optional<ServiceState> FindState(const std::string& endpoint) { return Newest(endpoint, true); }
std::optional<ServiceState> FindRemains(const std::string& endpoint) { return Newest(endpoint, false); }

void EndProcesses(const ServiceState& state, Duration patience) {
  std::vector<Process> processes;
  for (const pid_t worker : state.workers) processes.emplace_back(worker, kWorkerProgram);
  processes.emplace_back(state.coordinator, kCoordinatorProgram);
  if (WaitForEnd(processes, patience)) return;
  for (const auto& [signal, wait] : EndSteps(kEndPatience)) {
    for (const auto& [pid, program] : processes) {
      if (IsRunning(pid, program)) ::kill(pid, signal);
    }
    if (WaitForEnd(processes, wait)) return;
  }
}

namespace {

const char* Variable(const char* name) {
  const char* text = std::getenv(name);
  return text != nullptr && text[0] != '\0' ? text : nullptr;
}

Result<ServiceAddress> AddressIn(const std::string& path) {
  const Result<ServiceFile> file = ReadServiceFile(path);
  if (!file.ok()) return file.status();
  if (!IsOfClients(file->role)) {
    return Status::InvalidArgument(
        fmt::format("service file '{}' is of role {}, but client or admin is needed here", path, NameOf(file->role)));
  }
  return ServiceAddress(file->endpoint, file->keys());
}

}  // namespace

Result<ServiceChoice> NamedService(const ServiceChoice& choice) {
  if (!choice.file.empty() || !choice.endpoint.empty()) return choice;
  if (const char* file = Variable("SLABSTREAM_SERVICE")) return ServiceChoice{.endpoint = {}, .file = file};
  const char* endpoint = Variable("SLABSTREAM_ENDPOINT");
  if (endpoint == nullptr) return ServiceChoice();
  const Result<Endpoint> parsed = ParseEndpoint(endpoint, false);
  if (!parsed.ok()) return Status::InvalidArgument("$SLABSTREAM_ENDPOINT " + parsed.status().message());
  return ServiceChoice{.endpoint = endpoint, .file = {}};
}

Result<ServiceAddress> ResolveService(const ServiceChoice& choice) {
  const Result<ServiceChoice> named = NamedService(choice);
  if (!named.ok()) return named.status();
  if (!named->file.empty()) {
    Result<ServiceAddress> address = AddressIn(named->file);
    if (address.ok() && !named->endpoint.empty()) address->endpoint = named->endpoint;
    return address;
  }
  const std::optional<ServiceState> state = FindState(named->endpoint);
  if (state && !state->keys_folder.empty()) return AddressIn(state->keys_folder + "/admin.json");
  if (!named->endpoint.empty()) return ServiceAddress(named->endpoint);
  if (state) return ServiceAddress(state->endpoint);
  return Status::Unavailable("no service is named, and `slabstream up` of this user has started none here that runs");
}

Result<ServiceChoice> ResolveOwnerService(std::string text) {
  if (const char* named = Variable("SLABSTREAM_OWNER_SERVICE"); text.empty() && named != nullptr) text = named;
  if (text.find("://") != std::string::npos) {
    const Result<Endpoint> endpoint = ParseEndpoint(text, false);
    if (!endpoint.ok()) return endpoint.status();
    return ServiceChoice{.endpoint = text};
  }
  if (!text.empty()) return ServiceChoice{.file = text};
  const std::optional<ServiceState> state = FindState("");
  if (!state) return ServiceChoice{.endpoint = WorkerEndpointFor(*ParseEndpoint(kDefaultEndpoint, false)).ToString()};
  if (state->keys_folder.empty()) return ServiceChoice{.endpoint = state->worker_endpoint};
  return ServiceChoice{.file = fmt::format("{}/{}.json", state->keys_folder, NameOf(Role::kOwner))};
}

bool IsRunning(pid_t pid, const std::string& program) {
  if (pid <= 0) return false;
  std::ifstream file(fmt::format("/proc/{}/stat", pid));  // "PID (NAME) STATE ...", and the name may hold anything
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::size_t open = text.find('('), close = text.rfind(')');
  if (open == std::string::npos || close == std::string::npos || close + 2 >= text.size()) return false;
  const char state = text[close + 2];
  return text.substr(open + 1, close - open - 1) == program.substr(0, 15) && state != 'Z' && state != 'X';
}

}  // namespace slabstream
