// FrameAccount: what the workers did for one simulated frame, added up as the service's statistics do.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "simulator/model/timeline.h"

namespace slabstream {

class FrameAccount {
 public:
  explicit FrameAccount(std::size_t workers) : render_seconds_(workers), busy_(workers) {}

  // Work of one lane, [begin, end]. `end` does not decrease from call to call.
  void Add(std::uint32_t worker, Lane lane, double begin, double end);

  // Writes imbalance and idle share; `result` says when the frame was planned and done, `slots` how many workers it was planned for.
  void Close(std::size_t slots, SimulatedFrame& result) const;

 private:
  std::vector<double> render_seconds_;                        // by worker
  std::vector<std::vector<std::pair<double, double>>> busy_;  // by worker: when any lane works; apart, in order of time
};

}  // namespace slabstream
