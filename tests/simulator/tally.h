#pragma once

#include <cstdint>

namespace slabstream {

// Counts over all worlds, so that a test can see that it tested something.
struct Tally {
  std::uint64_t worlds = 0, requests = 0, pictures = 0, previews = 0, errors = 0, cancelled = 0, retried = 0, cached_frames = 0,
                workers_killed = 0, coordinator_restarts = 0, masks = 0, masks_of_retries = 0, hidden_pixels = 0, hidden_boxes = 0,
                counts = 0, moved_boxes = 0, workers_left = 0, handed_over = 0;
};

}  // namespace slabstream
