#include "laboratory/measure/wake_up_fit.h"

#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {

WakeUpEstimates FitWakeUps(std::span<const FrameInstants> quick, std::span<const FrameInstants> slow) {
  CHECK(!quick.empty() && !slow.empty()) << quick.size() << " quick frames and " << slow.size() << " slow ones";
  std::vector<double> awake, asleep;
  for (const FrameInstants& f : quick) {
    awake.push_back((f.render_begin - f.submitted + f.finish_begin - f.render_end + f.received - f.finish_end) / 10);
  }
  for (const FrameInstants& f : slow) asleep.push_back((f.finish_begin - f.render_end) / 2);
  return {MedianOf(std::move(awake)), MedianOf(std::move(asleep))};
}

}  // namespace slabstream
