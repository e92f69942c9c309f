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
#include <condition_variable>
#include <csignal>
#include <ctime>
#include <mutex>
#include <thread>

#include "common/memory/large_buffers.h"

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

// While it runs, an idle process gives memory back that it keeps for reuse: it looks every 10 s whether all threads together have used less
// than a fiftieth of one core. Call after BlockStopSignals.
inline std::jthread ReleaseWhileIdle() {
  return std::jthread([](const std::stop_token& stop) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any changed;
    for (std::clock_t used = std::clock(); !changed.wait_for(lock, stop, std::chrono::seconds(10), [] { return false; });) {
      if (stop.stop_requested()) return;
      if (std::clock() - used < CLOCKS_PER_SEC / 5) ReleaseFreeMemory();
      used = std::clock();
    }
  });
}

// `kRequest` is called by the signal handler, once for each signal. Service has WaitUntilStopped().
template <class Service, void (Service::*kRequest)() = &Service::RequestStop>
void WaitUntilStopped(Service& service) {
  static std::atomic<Service*> target;
  target = &service;
  const std::jthread idle = ReleaseWhileIdle();
  HandleStopSignals([](int) { (target.load()->*kRequest)(); });
  service.WaitUntilStopped();
  BlockStopSignals();  // the service may be destroyed now
}

}  // namespace slabstream
