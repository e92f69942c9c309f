// Processors: tasks that run on the cores of hosts, in virtual time. If a host has more tasks than cores, they share
// the cores equally; each busy thread besides the first slows the others down a little, since they share caches and memory.
#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

namespace slabstream {

class Processors {
 public:
  // `cores` of each host, > 0; `memory_slowdown` in [0, 1).
  Processors(double cores, double memory_slowdown) : cores_(cores), memory_slowdown_(memory_slowdown) {}

  // Starts a task of one thread that takes `seconds` if nothing slows it down. `task` is any name for it. `now` must not decrease from call
  // to call.
  void Start(std::uint32_t host, std::uint64_t task, double seconds, double now);
  // A task that runs there is done now: Finish comes next to it, but for others that end now.
  void EndNow(std::uint32_t host, std::uint64_t task, double now);

  // A task that runs there stops. Returns what it would have taken, if nothing slowed it down.
  double Stop(std::uint32_t host, std::uint64_t task, double now);

  struct Completion {
    double time = 0;
    std::uint64_t task = 0;
  };
  // When the next task ends if nothing else is started before; infinity if none runs.
  double NextTime();
  // Ends it. NextTime() must be finite.
  Completion Finish();

 private:
  struct Task {
    std::uint64_t name = 0;
    double left = 0;  // seconds, if nothing slows it down
  };
  struct Host {
    std::vector<Task> tasks;
    double since = 0;              // `left` is as of then
    double speed = 1;              // the speed of every task
    std::uint64_t generation = 0;  // the number of its latest forecast
  };
  struct Forecast {
    double time = 0;
    std::uint32_t host = 0;
    std::uint64_t generation = 0;
    friend bool operator>(const Forecast& a, const Forecast& b) { return a.time != b.time ? a.time > b.time : a.host > b.host; }
  };

  void AdvanceTo(Host& host, double now) const;
  void Predict(std::uint32_t number);

  const double cores_, memory_slowdown_;
  std::vector<Host> hosts_;
  std::priority_queue<Forecast, std::vector<Forecast>, std::greater<>> forecasts_;  // those of older generations are void
};

}  // namespace slabstream
