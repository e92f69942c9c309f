#include "client/cli/interrupt.h"

#include <atomic>
#include <cerrno>

#include "common/base/check.h"
#include "common/transport/socket.h"

namespace slabstream {
namespace {

// All that a signal handler may touch: lock-free atomics and the write to an event descriptor inside Notify.
std::atomic<Wakeup*> g_wakeup{nullptr};
std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<Wakeup*>::is_always_lock_free);

void OnSignal(int) {
  const int saved_errno = errno;
  g_interrupted = true;
  if (Wakeup* wakeup = g_wakeup) wakeup->Notify();
  errno = saved_errno;
}

}  // namespace

InterruptGuard::InterruptGuard(Wakeup& wakeup) {
  CHECK(g_wakeup == nullptr) << "two interrupt guards at a time";
  g_interrupted = false;
  g_wakeup = &wakeup;
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESETHAND;  // the second signal meets the default action: the process ends
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

InterruptGuard::~InterruptGuard() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
  g_wakeup = nullptr;
}

bool InterruptGuard::interrupted() const { return g_interrupted; }

}  // namespace slabstream
