// `up`: one coordinator and N workers as processes of this machine. In the foreground they end with this process. With --detach a process
// stays that watches them. Workers that end unexpectedly are started again.
#include <fmt/format.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <optional>

#include "client/cli/commands.h"
#include "client/cli/cores.h"
#include "client/cli/restart_pause.h"
#include "client/cli/service_connection.h"
#include "client/service/process.h"
#include "client/service/service_state.h"
#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/cli/program.h"
#include "common/files/program_beside.h"
#include "common/keys/role.h"
#include "common/threads/stop_signals.h"
#include "common/transport/endpoint.h"
#include "common/volume/memory_budget.h"
#include "data/catalogue/catalogue.h"
#include "data/open/cache_option.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kStartTimeout = seconds(30);  // until the coordinator listens, and again until all workers are registered
constexpr Duration kPatience = seconds(5);       // for an orderly end, then again before SIGKILL

// As --memory takes it.
std::string MemoryArgument(std::uint64_t bytes) { return fmt::format("{}MiB", bytes >> 20); }

class LocalService {
 public:
  LocalService(const UpOptions& options, const MemoryShares& memory, std::string log_directory, std::string keys_folder)
      : options_(options), memory_(memory) {
    state_.log_directory = std::move(log_directory);
    state_.keys_folder = std::move(keys_folder);
    state_.started_unix = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    state_.unlisted = options.unlisted;
  }

  // Until every worker is registered. Cancelled: a signal came.
  Status Start() {
    if (Status status = StartCoordinator(); !status.ok()) return status;
    if (Status status = StartWorkers(); !status.ok()) return status;
    Result<ServiceConnection> connection = Connect();
    if (!connection.ok()) return connection.status();
    for (const Time deadline = MonotonicNow() + kStartTimeout;;) {
      const Result<StatusReply> reply = connection->client().QueryStatus();
      if (!reply.ok()) return reply.status();
      if (int(reply->workers.size()) >= options_.workers) return SaveState(state_);
      for (std::size_t i = 0; i < children_.size(); ++i) {
        if (const auto end = children_[i].process->Ended()) return StartFailure(i, *end);
      }
      if (StopComesWithin(milliseconds(50))) return Status::Cancelled("interrupted");
      if (MonotonicNow() > deadline) {
        return Status::DeadlineExceeded(fmt::format("{} of {} workers registered within {} s; logs are in {}", reply->workers.size(),
                                                    options_.workers, seconds(30).count(), state_.log_directory));
      }
    }
  }

  // Until a signal comes (Ok) or the coordinator ends. Starts workers again that end unexpectedly, and says so on stderr. One that exits
  // with status 0 was told to end. No worker is started once the coordinator has ended, so whoever ends the service waits for none.
  Status Watch() {
    while (!StopComesWithin(milliseconds(200))) {
      if (const auto end = children_.front().process->Ended()) {
        if (end->exit_status == 0) return Status::Ok();  // `slabstream down`, from another terminal
        return Status::Unavailable(fmt::format("the coordinator {}; its last log line: {}", end->description, LastLogLine(LogOf(0))));
      }
      for (std::size_t i = 1; i < children_.size(); ++i) KeepAlive(i);
    }
    return Status::Ok();
  }

  // Asks the coordinator to end all processes, ends those that remain, and forgets the service, except its logs if they are to be kept.
  void Stop(bool keep_logs) {
    if (!children_.empty() && !children_.front().process->Ended() && !state_.endpoint.empty()) {
      if (Result<ServiceConnection> connection = Connect(); connection.ok() && connection->client().ShutDownService().ok()) {
        for (const Time deadline = MonotonicNow() + kPatience; !AllEnded() && MonotonicNow() < deadline;) {
          ::usleep(20000);
        }
      }
    }
    for (std::size_t i = children_.size(); i-- > 0;) children_[i].process->Terminate(kPatience);  // workers first
    keep_logs ? ForgetState(state_) : RemoveState(state_);
  }

  const ServiceState& state() const { return state_; }

 private:
  struct Watched {
    std::optional<Child> process;  // never none
    Time started;
    RestartPause pause;
    std::optional<Time> restart;  // it has ended, and is started again then
  };

  std::string ServiceFileOf(Role role) const { return fmt::format("{}/{}.json", state_.keys_folder, NameOf(role)); }

  Result<ServiceConnection> Connect() const {
    return ServiceConnection::OpenService(state_.keys_folder.empty() ? ServiceChoice{.endpoint = state_.endpoint, .file = {}}
                                                                     : ServiceChoice{.endpoint = {}, .file = ServiceFileOf(Role::kAdmin)});
  }

  std::string LogOf(std::size_t child) const {
    return fmt::format("{}/{}.log", state_.log_directory, child == 0 ? std::string("coordinator") : fmt::format("worker-{}", child));
  }

  // The error of a child that ended too early, with its own message.
  Status StartFailure(std::size_t child, const ChildEnd& end) const {
    const std::string program = child == 0 ? kCoordinatorProgram : kWorkerProgram;
    std::string line = LastLogLine(LogOf(child));
    if (line.rfind(program + ": ", 0) == 0) line.erase(0, program.size() + 2);
    return Status(end.exit_status == 2 ? StatusCode::kInvalidArgument : StatusCode::kUnavailable,
                  fmt::format("{} {}: {}", program, end.description, line.empty() ? "it says nothing" : line));
  }

  // The coordinator if it is the first, else a worker; again if it was started before.
  Status StartChild(std::size_t number, const char* program, std::vector<std::string> arguments) {
    const Result<std::string> path = ProgramBeside(program);
    if (!path.ok()) return path.status();
    arguments.insert(arguments.begin(), *path);
    Result<Child> child = Child::Start({.command = std::move(arguments), .log_path = LogOf(number), .outlives_us = options_.detach});
    if (!child.ok()) return child.status();
    if (number == children_.size()) children_.emplace_back();
    children_[number].process.emplace(*std::move(child));
    children_[number].started = MonotonicNow();
    return Status::Ok();
  }

  void KeepAlive(std::size_t number) {
    Watched& worker = children_[number];
    const auto end = worker.process->Ended();
    if (!end || end->exit_status == 0) return;
    const Time now = MonotonicNow();
    if (!worker.restart) {
      const Duration pause = worker.pause.AfterEnd(worker.started, now);
      worker.restart = now + pause;
      LogWarning(fmt::format("worker {} (pid {}) {}; it is started again in {} s", number, worker.process->pid(), end->description,
                             std::chrono::duration_cast<seconds>(pause).count()));
    } else if (now >= *worker.restart) {
      worker.restart.reset();
      worker.started = now;  // also if it fails: then it is tried again after the next pause
      Status started = StartWorker(number);
      if (started.ok()) started = SaveState(state_);
      if (!started.ok()) LogError(fmt::format("worker {} cannot be started: {}", number, started.message()));
    }
  }

  Status StartCoordinator() {
    std::vector<std::string> arguments = {"--listen",    options_.listen,     "--memory", MemoryArgument(memory_.coordinator),
                                          "--log-level", LogLevelOfChildren()};
    for (const std::string& data : options_.data) arguments.insert(arguments.end(), {"--data", data});
    AddCacheArgument(arguments, options_.cache);
    if (!state_.keys_folder.empty()) arguments.insert(arguments.end(), {"--keys", state_.keys_folder});
    AddMetrics(arguments, 0);
    if (Status started = StartChild(0, kCoordinatorProgram, std::move(arguments)); !started.ok()) return started;
    Child& child = *children_.front().process;
    state_.coordinator = child.pid();
    const Result<std::string> line = child.ReadLine(kStartTimeout);
    if (line.status().code() == StatusCode::kCancelled) return line.status();
    if (!line.ok()) {
      child.Terminate(kPatience);  // it closed its output: ended, or about to
      return StartFailure(0, *child.Ended());
    }
    state_.endpoint = ValueIn(*line, "client");
    state_.worker_endpoint = ValueIn(*line, "workers");
    if (!state_.endpoint.empty() && !state_.worker_endpoint.empty()) return Status::Ok();
    return Status::Internal(fmt::format("{} said '{}' instead of its endpoints", kCoordinatorProgram, *line));
  }

  Status StartWorkers() {
    for (int i = 1; i <= options_.workers; ++i) {
      if (Status started = StartWorker(std::size_t(i)); !started.ok()) return started;
    }
    return Status::Ok();
  }

  Status StartWorker(std::size_t number) {
    const int threads = options_.threads > 0 ? options_.threads : CoreShare(options_.workers);
    std::vector<std::string> arguments = {"--threads",         std::to_string(threads),        "--compress=" + options_.compress,
                                          "--memory",          MemoryArgument(memory_.worker), "--log-level",
                                          LogLevelOfChildren()};
    if (state_.keys_folder.empty()) {
      arguments.insert(arguments.end(), {"--coordinator", state_.worker_endpoint});
    } else {
      arguments.insert(arguments.end(), {"--service", ServiceFileOf(Role::kWorker)});
    }
    AddCacheArgument(arguments, options_.cache);
    AddMetrics(arguments, number);
    if (Status started = StartChild(number, kWorkerProgram, std::move(arguments)); !started.ok()) return started;
    state_.workers.resize(std::max(state_.workers.size(), number));
    state_.workers[number - 1] = children_[number].process->pid();
    return Status::Ok();
  }

  void AddMetrics(std::vector<std::string>& arguments, std::size_t number) const {
    if (options_.metrics != 0) arguments.insert(arguments.end(), {"--metrics", std::to_string(std::size_t(options_.metrics) + number)});
  }

  std::string LogLevelOfChildren() const { return options_.log_level.empty() ? "info" : options_.log_level; }

  bool AllEnded() {
    bool all = true;
    for (Watched& child : children_) all = child.process->Ended().has_value() && all;
    return all;
  }

  const UpOptions& options_;
  const MemoryShares memory_;
  ServiceState state_;
  std::vector<Watched> children_;  // the coordinator, then the workers
};

// Ends what a coordinator that crashed there has left. Unavailable: a service runs there.
Status MakeRoomAt(const std::string& listen) {
  if (const auto remains = FindRemains(listen)) {
    EndProcesses(*remains, Duration::zero());
    ForgetState(*remains);
  }
  const std::optional<ServiceState> running = FindState(listen);
  if (!running || running->endpoint != listen) return Status::Ok();
  return Status::Unavailable(
      fmt::format("a service runs at {} already (pid {}); `slabstream down` ends it", running->endpoint, running->coordinator));
}

// The folder of keys of a service that leaves this machine: what the user named, else one for this address, so that its service files stay
// the same from start to start. Empty: it stays on this machine and has no keys.
Result<std::string> KeysFolder(const UpOptions& options, const std::string& state_directory) {
  if (!options.keys.empty()) return options.keys;
  const Result<Endpoint> listen = ParseEndpoint(options.listen, true);
  if (!listen.ok()) return listen.status();
  if (!listen->remote()) return std::string();
  return fmt::format("{}/keys-{}", state_directory, FileNameOf(fmt::format("{}-{}", listen->host, listen->port)));
}

Status PrintReady(const UpOptions& options, const ServiceState& state) {
  const bool default_endpoint = state.endpoint == kDefaultEndpoint || !state.keys_folder.empty();
  const std::string endpoint = default_endpoint ? "" : fmt::format(" --endpoint {}", state.endpoint);
  std::cout << fmt::format("slabstream is up at {} (coordinator pid {}, {} workers); logs are in {}\n", state.endpoint, state.coordinator,
                           state.workers.size(), state.log_directory);
  std::cout << fmt::format("  slabstream render NAME -o picture.png{0}\n  slabstream status{0}\n", endpoint);
  if (state.keys_folder.empty()) {
    std::cout << fmt::format("  slabstream-worker --coordinator {} adds a worker\n", state.worker_endpoint);
  } else {
    std::cout << fmt::format(
        "Service files for other hosts are in {}: client.json, worker.json, admin.json. Everybody who has one has its role.\n"
        "  slabstream render NAME -o picture.png --service client.json\n  slabstream-worker --service worker.json adds a worker\n",
        state.keys_folder);
  }
  if (options.detach) {
    std::cout << fmt::format("  slabstream down{}\n", endpoint);
  } else {
    std::cout << "Ctrl-C ends it.\n";
  }
  return FlushOutput();
}

// Goes on in a process of its own, in a session of its own: nothing that happens to the terminal ends it. This process waits until it is
// told that the service is ready, or that process ends; then it ends itself, with the same status. What is returned closes to tell it.
Result<int> Detach() {
  int ready[2] = {-1, -1};
  if (::pipe2(ready, O_CLOEXEC) != 0) return Status::Unavailable(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  const pid_t child = ::fork();
  if (child < 0) return Status::Unavailable(fmt::format("cannot start a process: {}", std::strerror(errno)));
  if (child == 0) {
    ::close(ready[0]);
    (void)::setsid();
    return ready[1];
  }
  ::close(ready[1]);
  char byte = 0;
  if (::read(ready[0], &byte, 1) == 1) ::_exit(0);
  int how = 0;
  while (::waitpid(child, &how, 0) < 0 && errno == EINTR) {
  }
  ::_exit(WIFEXITED(how) ? WEXITSTATUS(how) : 1);
}

// From now on this process writes to a log and nowhere else, and its parent ends.
Status LeaveTerminal(const std::string& log_path, int ready) {
  const int in = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int log = ::open(log_path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  const bool done = in >= 0 && log >= 0 && ::dup2(in, STDIN_FILENO) >= 0 && ::dup2(log, STDOUT_FILENO) >= 0 &&
                    ::dup2(log, STDERR_FILENO) >= 0 && ::write(ready, "", 1) == 1;
  const int error = errno;
  for (const int descriptor : {in, log, ready}) ::close(descriptor);
  return done ? Status::Ok() : Status::Unavailable(fmt::format("cannot write '{}': {}", log_path, std::strerror(error)));
}

// `ready`: of Detach, if it was called.
Status Serve(const UpOptions& options, const MemoryShares& memory, std::optional<int> ready) {
  BlockStopSignals();
  const Result<std::string> directory = StateDirectory();
  if (!directory.ok()) return directory.status();
  if (Status status = MakeRoomAt(options.listen); !status.ok()) return status;
  const std::string log_directory = fmt::format("{}/service-{}", *directory, ::getpid());
  std::error_code error;
  std::filesystem::create_directory(log_directory, error);
  if (error) return Status::Unavailable(fmt::format("cannot make the directory '{}': {}", log_directory, error.message()));

  const Result<std::string> keys_folder = KeysFolder(options, *directory);
  if (!keys_folder.ok()) return keys_folder.status();
  const bool new_keys = !keys_folder->empty() && !std::filesystem::exists(*keys_folder, error);

  LocalService service(options, memory, log_directory, *keys_folder);
  if (Status status = service.Start(); !status.ok()) {
    service.Stop(status.code() == StatusCode::kDeadlineExceeded);  // which names the logs
    if (new_keys) std::filesystem::remove_all(*keys_folder, error);
    return status;
  }
  Status told = PrintReady(options, service.state());
  if (told.ok() && ready) told = LeaveTerminal(log_directory + "/up.log", *ready);
  if (!told.ok()) {
    service.Stop(true);
    return told;
  }
  Status status = service.Watch();
  // The workers of a detached service outlive a coordinator that crashed, until `down` has told of it.
  if (status.ok() || !options.detach) service.Stop(!status.ok());
  return status;
}

// Finds out before anything is started which files cannot be read, and says so: a line each.
Status CheckData(const std::vector<std::string>& data) {
  FoundData found = FindData(data);
  CheckFiles(found);
  for (const std::string& line : found.complaints) std::cerr << "slabstream up: warning: " << Printable(line) << std::endl;
  return ReportAll("slabstream up", found.errors);
}

}  // namespace

Status RunUp(const UpOptions& options) {
  HandleStopSignals([](int) { std::_Exit(130); });  // nothing has begun
  if (options.metrics + options.workers > 65535) {
    return Status::InvalidArgument(fmt::format("--metrics {}: {} workers need the ports after it", options.metrics, options.workers));
  }
  const Result<MemoryShares> memory = ShareMemory(options.memory, options.workers);
  if (!memory.ok()) return memory.status();
  if (Status readable = CheckData(options.data); !readable.ok()) return readable;
  if (!options.detach) return Serve(options, *memory, std::nullopt);
  const Result<int> ready = Detach();
  if (!ready.ok()) return ready.status();
  // Threads that libraries began before did not come along, so the way out is not through destructors that would wait for them.
  std::_Exit(Finish("slabstream", Serve(options, *memory, *ready)));
}

}  // namespace slabstream
