// Processor time of the calling thread: what a measurement counts, so that whatever else the machine does is not in it.
#pragma once

#include <time.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

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

// Of at least one value; the upper one of the two in the middle.
inline double UpperMedian(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace slabstream
