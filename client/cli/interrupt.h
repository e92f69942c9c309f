// Ctrl-C while frames are rendered: sets a flag and ends the client's waiting. A second Ctrl-C ends the process at once.
#pragma once

#include <csignal>

namespace slabstream {

class Wakeup;

// Catches SIGINT and SIGTERM for as long as it lives. One at a time in a process.
class InterruptGuard {
 public:
  explicit InterruptGuard(Wakeup& wakeup);  // notified by each signal; must outlive the guard
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool interrupted() const;

 private:
  struct sigaction old_interrupt_ {
  }, old_terminate_{};
};

}  // namespace slabstream
