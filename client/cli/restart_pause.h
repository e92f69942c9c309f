// RestartPause: how long `up` waits before it starts a worker again that ended unexpectedly. A worker that ends again and again is started
// more and more seldom, so that a machine without memory, say, is not kept busy with starts. Pure: time is an argument.
#pragma once

#include <algorithm>

#include "common/base/time.h"

namespace slabstream {

class RestartPause {
 public:
  static constexpr Duration kFirst = std::chrono::seconds(1), kLongest = std::chrono::seconds(30);
  static constexpr Duration kSettled = std::chrono::minutes(1);  // alive for so long, it begins with kFirst again

  // It ended at `now` and had been started at `started`: the pause, twice the last one.
  Duration AfterEnd(Time started, Time now) {
    if (now - started >= kSettled) next_ = kFirst;
    const Duration pause = next_;
    next_ = std::min(2 * next_, kLongest);
    return pause;
  }

 private:
  Duration next_ = kFirst;
};

}  // namespace slabstream
