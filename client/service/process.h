// Child processes, for `up` and for movies: start one, and find out whether it has ended.
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <csignal>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"

namespace slabstream {

// How a process is made to end: signals in turn, and how long to wait after each. The second SIGTERM is for a worker that would rather
// finish its work first.
struct EndStep {
  int signal = SIGTERM;
  Duration wait{};
};
constexpr std::array<EndStep, 3> EndSteps(Duration patience) {
  return {{{SIGTERM, std::chrono::milliseconds(200)}, {SIGTERM, patience}, {SIGKILL, patience}}};
}

// Path of a program in one of the folders of $PATH; empty: there is none.
std::string ProgramInPath(const std::string& name);

struct ChildOptions {
  std::vector<std::string> command;  // program path and arguments
  std::string log_path;              // stderr is appended to it
  int input = -1;                    // a descriptor that becomes its stdin; -1: /dev/null
  bool outlives_us = false;          // else the kernel sends it SIGTERM when this process ends for any reason
};

struct ChildEnd {
  int exit_status = -1;     // -1: a signal ended it
  std::string description;  // "exited with status 1", "was killed by signal 9"
};

// A child process in a session of its own, so that Ctrl-C at the terminal reaches only the parent, with no signal blocked. Unless it
// outlives us, the thread that starts it must be there as long as this process: its end is what the kernel takes for our end. Move-only;
// the destructor leaves the child running.
class Child {
 public:
  static Result<Child> Start(const ChildOptions& options);
  Child(Child&& other) noexcept;
  Child& operator=(Child&&) = delete;
  ~Child();

  pid_t pid() const { return pid_; }
  int output() const { return output_; }  // the reading end of its stdout, which stays this object's

  // The first line of its stdout. Unavailable if it ends before that; DeadlineExceeded; Cancelled: one of the blocked StopSignals came.
  Result<std::string> ReadLine(Duration timeout);

  // How it ended, if it has; reaps it. Later calls return the same.
  std::optional<ChildEnd> Ended();

  // Takes the EndSteps, and reaps it.
  void Terminate(Duration patience);

 private:
  Child(pid_t pid, int output) : pid_(pid), output_(output) {}
  pid_t pid_;
  int output_;  // reading end of its stdout
  std::optional<ChildEnd> ended_;
};

// The value of `key` in a line of the coordinator such as "ready client=tcp://127.0.0.1:7420 workers=..."; empty: the
// line has no such key.
std::string ValueIn(const std::string& line, const std::string& key);

// The last line of a log; empty if there is none.
std::string LastLogLine(const std::string& log_path);

}  // namespace slabstream
