#include "client/service/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <utility>

#include "common/threads/stop_signals.h"

namespace slabstream {
namespace {

constexpr Duration kPollInterval = std::chrono::milliseconds(20);

// The child between fork and exec: system calls only. `stdin_fd`, `stdout_fd` and `stderr_fd` close themselves at exec.
[[noreturn]] void BecomeProgram(char* const* arguments, int stdin_fd, int stdout_fd, int stderr_fd, bool outlives_us, pid_t parent) {
  ::setsid();
  if (!outlives_us) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(0);  // the parent ended before the line above took effect
  }
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(stdin_fd, STDIN_FILENO);
  ::dup2(stdout_fd, STDOUT_FILENO);
  ::dup2(stderr_fd, STDERR_FILENO);
  ::execv(arguments[0], arguments);
  const char message[] = "cannot be executed\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, message, sizeof message - 1);
  ::_exit(127);
}

}  // namespace

std::string ProgramInPath(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path program = std::filesystem::path(folder) / name;
    std::error_code error;
    if (std::filesystem::is_regular_file(program, error) && ::access(program.c_str(), X_OK) == 0) return program.string();
  }
  return "";
}

Result<Child> Child::Start(const ChildOptions& options) {
  std::vector<char*> arguments;  // made before the fork: a child may not allocate
  for (const std::string& argument : options.command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);

  const int in =
      options.input >= 0 ? ::fcntl(options.input, F_DUPFD_CLOEXEC, STDERR_FILENO + 1) : ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int log = ::open(options.log_path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  int out[2] = {-1, -1};
  pid_t pid = -1;
  const pid_t parent = ::getpid();
  if (in >= 0 && log >= 0 && ::pipe2(out, O_CLOEXEC) == 0) pid = ::fork();
  if (pid == 0) BecomeProgram(arguments.data(), in, out[1], log, options.outlives_us, parent);
  const int error = errno;
  for (const int descriptor : {in, log, out[1]}) {
    if (descriptor >= 0) ::close(descriptor);
  }
  if (pid > 0) return Child(pid, out[0]);
  if (out[0] >= 0) ::close(out[0]);
  return Status::Unavailable(fmt::format("cannot start '{}': {}", options.command.front(), std::strerror(error)));
}

Child::Child(Child&& other) noexcept : pid_(other.pid_), output_(std::exchange(other.output_, -1)), ended_(std::move(other.ended_)) {}

Child::~Child() {
  if (output_ >= 0) ::close(output_);
}

Result<std::string> Child::ReadLine(Duration timeout) {
  const Time deadline = MonotonicNow() + timeout;
  std::string line;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - MonotonicNow()).count();
    if (left <= 0) return Status::DeadlineExceeded("no answer in time");
    if (StopComesWithin(std::chrono::milliseconds(0))) return Status::Cancelled("interrupted");
    pollfd descriptor{output_, POLLIN, 0};
    if (::poll(&descriptor, 1, int(std::min<long long>(left, 100))) <= 0) continue;
    char byte = 0;
    if (::read(output_, &byte, 1) != 1) return Status::Unavailable("it ended");
    if (byte == '\n') return line;
    line += byte;
  }
}

std::optional<ChildEnd> Child::Ended() {
  int how = 0;
  if (ended_ || ::waitpid(pid_, &how, WNOHANG) != pid_) return ended_;
  ended_ = WIFEXITED(how) ? ChildEnd{WEXITSTATUS(how), fmt::format("exited with status {}", WEXITSTATUS(how))}
                          : ChildEnd{-1, fmt::format("was killed by signal {}", WTERMSIG(how))};
  return ended_;
}

void Child::Terminate(Duration patience) {
  for (const auto& [signal, wait] : EndSteps(patience)) {
    if (Ended()) return;
    ::kill(pid_, signal);  // not reaped yet, so the pid is still its own
    for (const Time deadline = MonotonicNow() + wait; !Ended() && MonotonicNow() < deadline;) std::this_thread::sleep_for(kPollInterval);
  }
}

std::string ValueIn(const std::string& line, const std::string& key) {
  const std::size_t at = line.find(" " + key + "=");
  if (at == std::string::npos) return "";
  const std::size_t begin = at + key.size() + 2;
  return line.substr(begin, line.find(' ', begin) - begin);
}

std::string LastLogLine(const std::string& log_path) {
  std::ifstream log(log_path);
  std::string line, last;
  while (std::getline(log, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

}  // namespace slabstream
