#include "laboratory/measure/other_load.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

double OwnSeconds() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    for (const timeval& time : {usage.ru_utime, usage.ru_stime}) seconds += double(time.tv_sec) + double(time.tv_usec) * 1e-6;
  }
  return seconds;
}

}  // namespace

OtherLoad::OtherLoad() : begin_(Now()) {}

// The first line of /proc/stat: cpu user nice system idle iowait irq softirq steal ..., see proc(5).
std::optional<OtherLoad::Times> OtherLoad::Now() {
  std::ifstream file("/proc/stat");
  std::string cpu;
  if (!(file >> cpu) || cpu != "cpu") return std::nullopt;
  constexpr int kNumbers = 8, kIdle = 3, kWaiting = 4;
  const double ticks = double(::sysconf(_SC_CLK_TCK));
  Times times{.own = OwnSeconds()};
  for (int i = 0; i < kNumbers; ++i) {
    double number = 0;
    if (!(file >> number)) return std::nullopt;
    times.total += number / ticks;
    if (i != kIdle && i != kWaiting) times.busy += number / ticks;
  }
  return times;
}

std::optional<double> OtherLoad::Share() const {
  const std::optional<Times> now = Now();
  if (!begin_ || !now) return std::nullopt;
  const double total = now->total - begin_->total, cores = std::max(1.0, double(::sysconf(_SC_NPROCESSORS_ONLN)));
  if (total < 0.2 * cores) return std::nullopt;
  return std::clamp((now->busy - begin_->busy - (now->own - begin_->own)) / total, 0.0, 1.0);
}

double ReferenceLoopSeconds() {
  constexpr int kRuns = 7, kRounds = 200;
  std::vector<float> numbers(std::size_t{1} << 14, 0.5F);
  return MedianSecondsOf(kRuns, [&] {
    for (int round = 0; round < kRounds; ++round) {
      for (float& number : numbers) number = number * 0.999F + 0.001F;
    }
  });
}

}  // namespace slabstream
