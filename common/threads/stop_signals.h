// SIGINT and SIGTERM as an orderly stop of a service.
//
//   1. HandleStopSignals([](int) { std::_Exit(0); }) first of all: nothing has begun, so a signal may end the process at any time.
//   2. BlockStopSignals() before anything begins that must be ended in order: threads that are started later inherit the blocked mask.
//   3. Start the service.
//   4. WaitUntilStopped(service): returns when the service has ended, by itself or because a signal made it; a signal that came before
//   counts.
// For main functions: handlers belong to the process.
#pragma once

#include <atomic>
#include <chrono>
#include <csignal>

namespace slabstream {

inline sigset_t StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

// Also one that came while they were blocked.
inline void HandleStopSignals(void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  const sigset_t signals = StopSignals();
  for (const int number : {SIGINT, SIGTERM}) sigaction(number, &action, nullptr);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

inline void BlockStopSignals() {
  const sigset_t signals = StopSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

// Whether one of the blocked signals has come, or comes within this time.
inline bool StopComesWithin(std::chrono::milliseconds time) {
  const sigset_t signals = StopSignals();
  const timespec limit{time.count() / 1000, time.count() % 1000 * 1'000'000};
  return ::sigtimedwait(&signals, nullptr, &limit) > 0;
}

// `kRequest` is called by the signal handler, once for each signal. Service has WaitUntilStopped().
template <class Service, void (Service::*kRequest)() = &Service::RequestStop>
void WaitUntilStopped(Service& service) {
  static std::atomic<Service*> target;
  target = &service;
  HandleStopSignals([](int) { (target.load()->*kRequest)(); });
  service.WaitUntilStopped();
  BlockStopSignals();  // the service may be destroyed now
}

}  // namespace slabstream
