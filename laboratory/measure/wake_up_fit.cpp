#include "laboratory/measure/wake_up_fit.h"

#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {

WakeUpEstimates FitWakeUps(std::span<const FrameInstants> quick, std::span<const FrameInstants> slow) {
  CHECK(!quick.empty() && !slow.empty()) << quick.size() << " quick frames and " << slow.size() << " slow ones";
  const auto awake = [](const FrameInstants& f) {
    return (f.render_begin - f.submitted + f.finish_begin - f.render_end + f.received - f.finish_end) / 10;
  };
  const auto asleep = [](const FrameInstants& f) { return (f.finish_begin - f.render_end) / 2; };
  return {MedianOf(EachOf(quick, awake)), MedianOf(EachOf(slow, asleep))};
}

}  // namespace slabstream
