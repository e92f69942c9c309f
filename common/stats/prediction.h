// FramePrediction: what a frame should take, said before it is rendered. The same figures can be had of what happened (FrameSummary).
#pragma once

namespace slabstream {

struct FramePrediction {
  double render_seconds = 0;   // rendering of the worker that has most to do
  double combine_seconds = 0;  // encoding and combining of partial images, worker time, summed over workers
  double finish_seconds = 0;   // making the picture of the accumulated frame, and encoding it
  double latency_seconds = 0;  // from the request to the decoded picture, where nothing else is asked for
  double imbalance = 1;        // most / mean render time of a worker, over all workers of the plan
  friend bool operator==(const FramePrediction&, const FramePrediction&) = default;
};

}  // namespace slabstream
