// Recorded frames made by hand.
#pragma once

#include <vector>

#include "client/cli/recording.h"
#include "tests/support/random.h"
#include "tests/support/renderers.h"

namespace slabstream {

// Back to back, all warm; times are whole microseconds.
inline std::vector<RecordedFrame> RandomRecording(Random& random, int frames, std::uint32_t workers) {
  std::vector<RecordedFrame> recording;
  double now = 0;
  for (int i = 0; i < frames; ++i) {
    RecordedFrame& frame = recording.emplace_back();
    frame.renderer = random.Chance(0.5) ? Splatting() : ZBuffer();
    frame.grid = {0, 0, random.Integer(1, 100), random.Integer(1, 100)};
    frame.workers = workers;
    frame.display = random.Integer<WorkerId>(1, workers);
    frame.combine = "fan-in";
    frame.groups.resize(random.Integer<std::size_t>(1, 3));
    BoxId box = 0;
    for (std::size_t g = 0; g < frame.groups.size(); ++g) {
      for (std::uint32_t rank = 0; rank < workers; ++rank) {
        const std::int32_t x = random.Integer(0, frame.grid.x_end - 1), y = random.Integer(0, frame.grid.y_end - 1);
        const PixelBounds bounds = {x, y, random.Integer(x + 1, frame.grid.x_end), random.Integer(y + 1, frame.grid.y_end)};
        frame.groups[g].push_back(
            {box++, rank + 1, random.Integer(1, 10000) * 1e-6, bounds, double(random.Integer<std::int64_t>(0, bounds.pixel_count()))});
      }
    }
    frame.arrived = now;
    frame.begin = now + 100e-6;
    frame.latency = random.Integer(10000, 90000) * 1e-6;
    now += frame.latency;
    frame.end = now - 50e-6;
    frame.picture_seconds = random.Integer(0, 3000) * 1e-6;
    frame.image_bytes = random.Integer(0, 1 << 20);
  }
  return recording;
}

}  // namespace slabstream
