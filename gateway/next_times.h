// What to fetch ahead while somebody plays through the times of a dataset.
//
// Pure.
#pragma once

#include <string>
#include <vector>

#include "common/frame/frame_request.h"

namespace slabstream {

inline constexpr int kTimesAhead = 2;

// Small pictures of the times that follow: as far apart as `shown` is from the one before it, and from the last one to the first. They are
// drawn from the same levels as `shown`, so workers then have what pictures of that size need. None: `before` or the time of `shown` is
// no number, both are the same, or the dataset has less than two times.
std::vector<FrameRequest> NextTimes(const FrameRequest& shown, const std::string& before, int times);

}  // namespace slabstream
