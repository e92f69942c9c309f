// A program that a test starts. It is reaped by its pid when the object goes, also when the test fails.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/time.h"

extern char** environ;

namespace slabstream {

class ChildProcess {
 public:
  explicit ChildProcess(const std::vector<std::string>& command) {
    std::array<int, 2> ends{};
    CHECK_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
    output_ = ends[0];
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    CHECK_EQ(::posix_spawn(&pid_, arguments[0], &actions, nullptr, arguments.data(), environ), 0) << command[0];
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
  }
  ChildProcess(ChildProcess&& other) noexcept : pid_(std::exchange(other.pid_, -1)), output_(std::exchange(other.output_, -1)) {}
  ChildProcess& operator=(ChildProcess&& other) noexcept {
    std::swap(pid_, other.pid_);
    std::swap(output_, other.output_);
    return *this;
  }
  ~ChildProcess() {
    Kill(SIGKILL);
    Wait();
    if (output_ >= 0) ::close(output_);
  }

  pid_t pid() const { return pid_; }

  void Kill(int signal_number) {
    if (pid_ > 0) ::kill(pid_, signal_number);
  }

  // Stops it. Returns when all its threads have stopped.
  void Stop() {
    Kill(SIGSTOP);
    int status = 0;
    while (::waitpid(pid_, &status, WUNTRACED) < 0 && errno == EINTR) {
    }
    CHECK(WIFSTOPPED(status));
  }

  // Blocks until the process has ended. Its exit status, or minus the signal that ended it.
  int Wait() {
    if (pid_ <= 0) return 0;
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  // The next line that it writes to stdout; empty when it has ended (or says nothing for a minute).
  std::string ReadLine() {
    std::string line;
    char c = 0;
    pollfd ready = {output_, POLLIN, 0};
    while (::poll(&ready, 1, 60'000) == 1 && ::read(output_, &c, 1) == 1 && c != '\n') line += c;
    return line;
  }

 private:
  pid_t pid_ = -1;
  int output_ = -1;
};

}  // namespace slabstream
