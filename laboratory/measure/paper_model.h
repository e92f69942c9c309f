// PaperModel: the machine of Yagel and Machiraju as two printed times a renderer, in seconds on it, for N = 200.
//
//   T(p) = T(1) / p + u * rounds(p),   rounds(p) = ceil(log2 p) (hierarchical) or p - 1 (centralised)
//
// A round writes, reads and combines one image; rounds of different processors do not wait for each other. T(1) is printed in tables 5 and
// 6. One u a renderer gives back the times of frames in tables 2, 5 and 6; it cannot give back the shares of combining in tables 5 and 6,
// which grow and shrink with p. `experiment paper` prints its errors, and tests/laboratory/experiments/paper_model_test.cpp holds them.
#pragma once

#include <string_view>

#include "simulator/model/machine_model.h"

namespace slabstream {

struct PaperModel {
  double one_worker_seconds = 0;  // T(1)
  double round_seconds = 0;       // u

  // `combine`: "fan-in" or "centralized". workers >= 1.
  double CombineSeconds(std::string_view combine, int workers) const;
  double FrameSeconds(std::string_view combine, int workers) const;
};
inline constexpr PaperModel kPaperSplatting = {72.89, 0.20}, kPaperZBuffer = {8.46, 0.13};

int CombiningRounds(std::string_view combine, int workers);

// The paper's machine with today's processors: a round takes the same share of `frame_seconds`, the time of a frame on one processor, as it
// did on theirs, for a whole image of `pixels` pixels. An image with fewer pixels takes less. The machine has none of a service's costs
// around a frame (planning, messages to a coordinator, the picture's way to a client), which the authors did not have or did not count. A
// worker is one processor.
MachineModel PaperMachine(const PaperModel& model, double frame_seconds, double pixels);

}  // namespace slabstream
