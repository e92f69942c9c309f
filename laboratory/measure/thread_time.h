// Processor time of the calling thread. Measurements use it because it excludes all other work of the machine.
#pragma once

#include <time.h>

#include <utility>

#include "common/base/check.h"

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

}  // namespace slabstream
