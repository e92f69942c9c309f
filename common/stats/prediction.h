// FramePrediction: how long a frame should take, predicted before it is rendered. FrameSummary has the same figures as measured.
#pragma once

namespace slabstream {

struct FramePrediction {
  double render_seconds = 0;   // rendering, of the worker with the most to do
  double combine_seconds = 0;  // encoding and combining of partial images, worker time, summed over workers
  double finish_seconds = 0;   // making the picture from the accumulated frame, and encoding it
  double latency_seconds = 0;  // from the request to the decoded picture, if there are no other requests
  double imbalance = 1;        // longest / mean render time of a worker, over all workers of the plan
  friend bool operator==(const FramePrediction&, const FramePrediction&) = default;
};

}  // namespace slabstream
