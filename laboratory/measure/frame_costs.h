// Frame costs: everything that a simulation wants to know of one frame, measured in this process, on one thread: what each box of its plan
// takes and covers (box_costs.h), and what it takes to make the picture of them and to decode it.
#pragma once

#include <deque>
#include <vector>

#include "laboratory/measure/box_costs.h"
#include "laboratory/measure/lab_worker.h"
#include "common/planning/frame_plan.h"
#include "common/simulation/cost_fit.h"
#include "simulator/simulate_frames.h"
#include "common/wire/payload.h"

namespace slabstream {

struct PictureCost {
  double finish_seconds = 0;   // resampling or resolving, encoding, digest: what the display worker does
  double receive_seconds = 0;  // digest, check, decoding: what the client does
  double finish_elapsed = 0;   // as finish_seconds, but by the clock on the wall, by all threads of the meter
};

// Makes and decodes pictures of one volume. Each step on a thread of its own, as in the service: what the last one wrote lies in another
// core's caches. And with as many answers kept as the coordinator keeps of a client: the memory that an answer is written to is one that
// nobody has touched for long.
class PictureMeter {
 public:
  // `volume` outlives the meter. `threads` >= 1 make a picture, if oneTBB has so many.
  explicit PictureMeter(const Volume& volume, int threads = 1) : volume_(volume), threads_(threads), worker_(volume) {}

  // Of the frame that the whole volume gives. Processor time of the thread that makes it, and of the one that decodes it.
  PictureCost Measure(const FrameSetup& setup);
  void KeepAnswers(const FrameSetup& setup);  // as many as there will be

 private:
  struct Answer {
    EncodedRuns header;
    Bytes payload;
  };
  static Answer Finish(LocalImage& frame, const FrameSetup& setup);
  static void Receive(const Answer& answer);
  bool Full() const;
  void Keep(Answer answer);

  const Volume& volume_;
  const int threads_;
  LabWorker worker_;
  std::deque<Answer> kept_;
  std::size_t kept_bytes_ = 0;
};

struct FrameCosts {
  std::vector<BoxCost> boxes;  // by BoxId of the plan; boxes without a placement cost nothing
  PictureCost picture;

  // As long as this and `plan`, which it was measured for, live. Voxels are taken to be cached.
  FrameInput Input(const FramePlan& plan) const;
};

// `repeats` >= 1: medians. `plan` is of this volume.
FrameCosts MeasureFrameCosts(const Volume& volume, const FramePlan& plan, int repeats);

// What the cost model is fitted to: processor time of each stage.
CostSample SampleOf(const BoxCost& box, const Camera& camera);

// Medians of `repeats` >= 1 pictures of the frame that the whole volume gives.
PictureCost MeasurePictureCost(const Volume& volume, const FrameSetup& setup, int repeats);

}  // namespace slabstream
