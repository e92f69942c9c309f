#include "client/lab/frame_costs.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <memory>
#include <thread>
#include <utility>

#include "client/lab/thread_time.h"
#include "common/base/check.h"
#include "common/image/run_image.h"
#include "common/wire/payload.h"
#include "coordinator/clients.h"
#include "worker/render/finish_picture.h"
#include "worker/render/pipeline.h"

namespace slabstream {

// Each step on a thread of its own, as in the service: what the last one wrote lies in another core's caches. And with as many answers kept
// as the coordinator keeps of a client: the memory that an answer is written to is one that nobody has touched for long.
PictureCost MeasurePictureCost(const Volume& volume, const FrameSetup& setup, int repeats) {
  CHECK_GE(repeats, 1);
  const std::unique_ptr<Renderer> renderer = MakeRenderer(setup.renderer);
  SlabData slab(BrickedVoxels(CutBlock(volume.block, volume.block.box)));
  const std::atomic<bool> cancelled = false;
  tbb::task_arena one_thread(1);
  const auto on_another_thread = [&](auto&& work) {
    double seconds = 0;
    std::thread([&] { one_thread.execute([&] { seconds = SecondsOf(work); }); }).join();
    return seconds;
  };
  const auto render = [&] {
    LocalImage frame;
    one_thread.execute([&] {
      RankReport report;
      frame = renderer->Render(slab, volume.block.box, setup, {}, cancelled, report).value();
    });
    return frame;
  };
  struct MadeAnswer {
    EncodedRuns header;
    Bytes payload;
  };
  // As the display worker does (worker/executor.cpp).
  const auto finish = [&](LocalImage& frame) {
    RunImage runs;
    if (FrameIsPicture(setup)) {
      runs = EncodePicture(frame);
    } else {
      FillRows(frame);
      runs = EncodePicture(FinishPicture(frame, setup));
    }
    MadeAnswer answer;
    answer.header.image = runs.header;
    answer.payload = PackRuns(Bytes(std::move(runs.payload)), Codec::kRaw, answer.header);
    return answer;
  };
  // As the client does (client/client.cpp).
  const auto receive = [](const MadeAnswer& answer) {
    const Bytes runs = UnpackRuns(answer.header, answer.payload).value();
    const PixelBounds& bounds = answer.header.image.bounds;
    CHECK(ReadRuns(answer.header.image, runs.span(), {0, 0, std::max(bounds.x_end, 1), std::max(bounds.y_end, 1)}).ok());
  };

  std::deque<MadeAnswer> kept;
  LocalImage frame = render();
  std::size_t kept_bytes = 0;
  do {
    kept.push_back(finish(frame));
    kept_bytes += kept.back().payload.size();
  } while (kept_bytes + kept.front().payload.size() <= kMaxKeptAnswerBytes && kept.size() < kMaxKeptAnswers);

  std::vector<double> finish_seconds, receive_seconds;
  for (int i = 0; i < repeats; ++i) {
    frame = render();
    kept.pop_front();
    finish_seconds.push_back(on_another_thread([&] { kept.push_back(finish(frame)); }));
    receive_seconds.push_back(on_another_thread([&] { receive(kept.back()); }));
  }
  return {UpperMedian(std::move(finish_seconds)), UpperMedian(std::move(receive_seconds))};
}

FrameCosts MeasureFrameCosts(const Volume& volume, const FramePlan& plan, int repeats) {
  FrameCosts costs;
  costs.boxes.resize(plan.layout.partition.boxes().size());
  const std::vector<Placement> placements = PlacementsOf(plan);
  std::vector<BoxCost> measured = MeasureBoxCosts(volume, plan, repeats);
  for (std::size_t i = 0; i < placements.size(); ++i) costs.boxes[placements[i].id] = std::move(measured[i]);
  costs.picture = MeasurePictureCost(volume, plan.setup, repeats);
  return costs;
}

CostSample SampleOf(const BoxCost& box, const Camera& camera) {
  CostSample sample;
  sample.work = CountWork(box.box, camera, double(box.occupied_voxels), double(box.drawn_voxels), box.bounds, double(box.covered_pixels));
  // Stages are timed by the clock on the wall, which goes on while others have the processor.
  const double elapsed = double(box.stage_ns[std::size_t(Stage::kRender)]) * 1e-9;
  const double share = elapsed > 0 ? std::min(box.seconds / elapsed, 1.0) : 1;
  for (std::size_t stage = 0; stage < sample.stage_ns.size(); ++stage) {
    sample.stage_ns[stage] = std::int64_t(double(box.stage_ns[stage]) * share);
  }
  return sample;
}

FrameInput FrameCosts::Input(const FramePlan& plan) const {
  FrameInput input{.plan = &plan, .boxes = {}, .finish_seconds = picture.finish_seconds, .receive_seconds = picture.receive_seconds};
  for (const BoxCost& box : boxes) input.boxes.push_back({box.seconds, box.coverage.share.empty() ? nullptr : &box.coverage, 0});
  return input;
}

}  // namespace slabstream
