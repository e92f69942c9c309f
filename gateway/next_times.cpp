#include "gateway/next_times.h"

#include <algorithm>

#include "common/text/parse_number.h"

namespace slabstream {

std::vector<FrameRequest> NextTimes(const FrameRequest& shown, const std::string& before, int times) {
  constexpr int kPixelsToOne = 16;
  const auto first = ParseNumber<int>(before), last = ParseNumber<int>(shown.time);
  if (!first || !last || times < 2 || std::min(*first, *last) < 0 || std::max(*first, *last) >= times || *first == *last) return {};
  const int step = (*last - *first + times) % times;
  std::vector<FrameRequest> next;
  for (int ahead = 1; ahead <= kTimesAhead; ++ahead) {
    const int time = (*last + ahead * step) % times;
    if (time == *last) break;
    FrameRequest& frame = next.emplace_back(shown);
    frame.time = std::to_string(time);
    frame.previews = frame.key = false;
    frame.size = {std::max(1, shown.size.width / kPixelsToOne), std::max(1, shown.size.height / kPixelsToOne)};
    // A voxel is as many pixels of the whole picture wide as before.
    const double share = double(std::min(frame.size.width, frame.size.height)) / double(std::min(shown.size.width, shown.size.height));
    frame.detail = (shown.detail == 0 ? 1 : shown.detail) * share;
  }
  return next;
}

}  // namespace slabstream
