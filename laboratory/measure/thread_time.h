// Processor time of the calling thread. Measurements use it because it excludes all other work of the machine.
#pragma once

#include <time.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

inline double ThreadSeconds() {
  timespec now{};
  CHECK_EQ(clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now), 0);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

template <class Work>
double SecondsOf(Work&& work) {
  const double begin = ThreadSeconds();
  std::forward<Work>(work)();
  return ThreadSeconds() - begin;
}

// The median of `runs` runs.
template <class Work>
double MedianSecondsOf(int runs, Work&& work) {
  std::vector<double> seconds(static_cast<std::size_t>(runs));
  for (double& each : seconds) each = SecondsOf(work);
  return MedianOf(std::move(seconds)).median;
}

}  // namespace slabstream
