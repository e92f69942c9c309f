#include "laboratory/measure/frame_costs.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "common/base/check.h"
#include "common/base/time.h"
#include "common/image/run_image.h"
#include "common/parallel/task_arena.h"
#include "common/renderers/renderer_kind.h"
#include "coordinator/frames/clients.h"
#include "laboratory/measure/statistics.h"
#include "laboratory/measure/thread_time.h"
#include "worker/renderers/renderer.h"

namespace slabstream {

namespace {

template <class Work>
double SecondsOnAnotherThread(int threads, Work&& work) {
  double seconds = 0;
  std::thread([&] {
    TaskArena arena(threads);
    arena.Run([&] { seconds = SecondsOf(work); });
  }).join();
  return seconds;
}

}  // namespace

// Does the work of the display worker (worker/service/executor.cpp).
PictureMeter::Answer PictureMeter::Finish(LocalImage& frame, const FrameSetup& setup) {
  RunImage runs;
  if (setup.renderer->FrameIsPicture(setup)) {
    runs = EncodePicture(frame, ColorCoding::kStraight8);
  } else {
    FillRows(frame);
    runs = EncodePicture(setup.renderer->Finish(frame, setup), ColorCoding::kStraight8);
  }
  Answer answer;
  answer.header.image = runs.header;
  answer.payload = PackRuns(Bytes(std::move(runs.payload)), Codec::kRaw, answer.header);
  return answer;
}

// Does the work of the client (client/client.cpp).
void PictureMeter::Receive(const Answer& answer) {
  const Bytes runs = UnpackRuns(answer.header, answer.payload).value();
  const PixelBounds& bounds = answer.header.image.bounds;
  CHECK(ReadRuns(answer.header.image, runs.span(), {0, 0, std::max(bounds.x_end, 1), std::max(bounds.y_end, 1)}).ok());
}

bool PictureMeter::Full() const {
  return !kept_.empty() && (kept_.size() >= kMaxKeptAnswers || kept_bytes_ + kept_.front().payload.size() > kMaxKeptAnswerBytes);
}

void PictureMeter::Keep(Answer answer) {
  kept_bytes_ += answer.payload.size();
  kept_.push_back(std::move(answer));
}

void PictureMeter::KeepAnswers(const FrameSetup& setup) {
  LocalImage frame = worker_.Render(volume_.block.box, setup).image;
  while (!Full()) Keep(Finish(frame, setup));
}

PictureCost PictureMeter::Measure(const FrameSetup& setup) {
  LocalImage frame = worker_.Render(volume_.block.box, setup).image;
  while (Full()) {
    kept_bytes_ -= kept_.front().payload.size();
    kept_.pop_front();
  }
  PictureCost cost;
  cost.finish_seconds = SecondsOnAnotherThread(threads_, [&] {
    const Time begin = MonotonicNow();
    Keep(Finish(frame, setup));
    cost.finish_elapsed = double((MonotonicNow() - begin).count()) * 1e-9;
  });
  cost.bytes = double(kept_.back().payload.size());
  cost.receive_seconds = SecondsOnAnotherThread(1, [&] { Receive(kept_.back()); });
  return cost;
}

PictureCost MeasurePictureCost(const Volume& volume, const FrameSetup& setup, int repeats) {
  CHECK_GE(repeats, 1);
  PictureMeter meter(volume);
  meter.KeepAnswers(setup);
  std::vector<PictureCost> costs;
  for (int i = 0; i < repeats; ++i) costs.push_back(meter.Measure(setup));
  return {.finish_seconds = MedianOf(EachOf(costs, &PictureCost::finish_seconds)).median,
          .receive_seconds = MedianOf(EachOf(costs, &PictureCost::receive_seconds)).median,
          .bytes = costs.back().bytes};
}

CostSample SampleOf(const BoxCost& box, const Camera& camera) {
  CostSample sample;
  sample.work = CountWork(box.box, camera, double(box.occupied_voxels), double(box.drawn_voxels), box.bounds, double(box.covered_pixels));
  // Stages are timed in elapsed time, which continues while others have the processor.
  const double elapsed = double(box.stage_ns[std::size_t(Stage::kRender)]) * 1e-9;
  const double share = elapsed > 0 ? std::min(box.seconds / elapsed, 1.0) : 1;
  for (std::size_t stage = 0; stage < sample.stage_ns.size(); ++stage) {
    sample.stage_ns[stage] = std::int64_t(double(box.stage_ns[stage]) * share);
  }
  return sample;
}

}  // namespace slabstream
