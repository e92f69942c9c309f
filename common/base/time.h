// Time as the state machines see it: nanoseconds since an arbitrary start that all of one host's processes share (CLOCK_MONOTONIC).
// Machines never read a clock: `now` is an argument. Executors read MonotonicNow(), the simulator counts its own time.
#pragma once

#include <chrono>

namespace slabstream {

using Duration = std::chrono::nanoseconds;
using Time = std::chrono::time_point<std::chrono::steady_clock, Duration>;

inline Time MonotonicNow() { return std::chrono::time_point_cast<Duration>(std::chrono::steady_clock::now()); }

}  // namespace slabstream
