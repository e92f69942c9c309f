#include "simulator/model/processors.h"

#include <algorithm>
#include <limits>

#include "common/base/check.h"

namespace slabstream {

void Processors::AdvanceTo(Host& host, double now) const {
  for (Task& task : host.tasks) task.left -= (now - host.since) * host.speed;
  host.since = now;
}

void Processors::Predict(std::uint32_t number) {
  Host& host = hosts_[number];
  ++host.generation;
  if (host.tasks.empty()) return;
  const double threads = double(host.tasks.size()), least = std::ranges::min(host.tasks, {}, &Task::left).left;
  const double busy = std::min(threads, cores_);
  host.speed = busy / threads / (1 + memory_slowdown_ * std::max(busy - 1, 0.0));
  forecasts_.push({host.since + std::max(least, 0.0) / host.speed, number, host.generation});
}

void Processors::Start(std::uint32_t host, std::uint64_t task, double seconds, double now) {
  if (hosts_.size() <= host) hosts_.resize(host + 1);
  AdvanceTo(hosts_[host], now);
  hosts_[host].tasks.push_back({task, seconds});
  Predict(host);
}

void Processors::EndNow(std::uint32_t host, std::uint64_t task, double now) {
  AdvanceTo(hosts_[host], now);
  std::ranges::find(hosts_[host].tasks, task, &Task::name)->left = 0;
  Predict(host);
}

double Processors::Stop(std::uint32_t host, std::uint64_t task, double now) {
  AdvanceTo(hosts_[host], now);
  const auto stopped = std::ranges::find(hosts_[host].tasks, task, &Task::name);
  const double left = std::max(stopped->left, 0.0);
  hosts_[host].tasks.erase(stopped);
  Predict(host);
  return left;
}

double Processors::NextTime() {
  while (!forecasts_.empty() && forecasts_.top().generation != hosts_[forecasts_.top().host].generation) forecasts_.pop();
  return forecasts_.empty() ? std::numeric_limits<double>::infinity() : forecasts_.top().time;
}

Processors::Completion Processors::Finish() {
  CHECK_LT(NextTime(), std::numeric_limits<double>::infinity());
  const Forecast next = forecasts_.top();
  forecasts_.pop();
  Host& host = hosts_[next.host];
  AdvanceTo(host, next.time);
  const auto first = std::min_element(host.tasks.begin(), host.tasks.end(), [](const Task& a, const Task& b) { return a.left < b.left; });
  const Completion done{next.time, first->name};
  host.tasks.erase(first);
  Predict(next.host);
  return done;
}

}  // namespace slabstream
