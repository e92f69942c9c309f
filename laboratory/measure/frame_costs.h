// Frame costs: what a frame costs beside the rendering of its boxes (box_costs.h), measured in this process: the time to make the picture,
// and to decode it. Pictures are made as for a PNG of 8 bits (FrameRequest::straight8), which experiments ask services for, too.
#pragma once

#include <deque>

#include "common/planning/frame_plan.h"
#include "common/wire/payload.h"
#include "laboratory/measure/box_costs.h"
#include "laboratory/measure/cost_fit.h"
#include "laboratory/measure/lab_worker.h"

namespace slabstream {

struct PictureCost {
  double finish_seconds = 0;   // resampling or resolving, encoding, digest: the display worker's part
  double receive_seconds = 0;  // digest, check, decoding: the client's part
  double finish_elapsed = 0;   // elapsed time of the same, by all threads of the meter
  double bytes = 0;            // encoded
};

// Makes and decodes pictures of one volume under the conditions of the service. Each step runs on a thread of its own, so its input lies in
// another core's caches. As many answers are kept as the coordinator keeps of a client, so an answer is written to memory that has not been
// touched for long.
class PictureMeter {
 public:
  // `volume` outlives the meter. `threads` >= 1 make a picture, if oneTBB has that many.
  explicit PictureMeter(const Volume& volume, int threads = 1) : volume_(volume), threads_(threads), worker_(volume) {}

  // For the frame of the whole volume: processor time of the thread that makes the picture, and of the one that decodes it.
  PictureCost Measure(const FrameSetup& setup);
  void KeepAnswers(const FrameSetup& setup);  // until as many are kept as there will be

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

// A sample for the fit of the cost model: processor time of each stage.
CostSample SampleOf(const BoxCost& box, const Camera& camera);

// Medians of `repeats` >= 1 pictures of the frame of the whole volume.
PictureCost MeasurePictureCost(const Volume& volume, const FrameSetup& setup, int repeats);

}  // namespace slabstream
