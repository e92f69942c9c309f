#include "client/lab/calibrate.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <latch>
#include <limits>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/embedded/embedded_service.h"
#include "client/lab/thread_time.h"
#include "common/base/check.h"
#include "common/kernels/combine.h"
#include "common/planning/frame_plan.h"
#include "common/volume/sphere.h"
#include "worker/render/pipeline.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 512;  // of the pictures that are combined
constexpr int kRepeats = 9;
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kSmallVolume = 96, kSmallPicture = 32;
constexpr int kWarmUpFrames = 10, kSmallFrames = 60;
constexpr int kSlowdownVolume = 128, kSlowdownTurns = 7;

template <class Work>
double FastestOf(Work&& work) {
  double fastest = kNever;
  for (int i = 0; i < kRepeats; ++i) fastest = std::min(fastest, SecondsOf(work));
  return fastest;
}

// Every row holds `filled` of its pixels, in runs of 32.
LocalImage MakePicture(double filled) {
  constexpr std::int32_t kRun = 32;
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, kSide, kSide});
  const auto period = std::int32_t(kRun / filled);
  for (std::int32_t y = 0; y < kSide; ++y) {
    for (std::int32_t x = 0; x < kSide; ++x) {
      if ((x + y) % period < kRun) std::fill_n(&image.rgba[4 * std::size_t(y * kSide + x)], 4, 0.4F);
    }
  }
  return image;
}

// What frames take beside rendering and the making of the picture, median. They render for a few milliseconds, so that the threads that
// wait meanwhile have to be woken as they are in earnest, and their pictures are so small that bringing them takes no time.
Result<double> SmallFrameSeconds(int workers) {
  const auto volume = std::make_shared<const Volume>(MakeSphere({SphereClass::kFilled, kSmallVolume, 0.4}).value());
  Context context;
  EmbeddedOptions options;
  options.workers = workers;
  options.coordinator.catalogue["small"] = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  Result<std::unique_ptr<EmbeddedService>> service = EmbeddedService::Start(context, std::move(options));
  if (!service.ok()) return service.status();
  Result<Client> client = Client::Connect(context, (*service)->endpoint());
  if (!client.ok()) return client.status();
  FrameRequest request;
  request.dataset = "small";
  request.size = {kSmallPicture, kSmallPicture};
  request.policy.groups = 1;
  std::vector<double> seconds;
  for (int i = 0; i < kWarmUpFrames + kSmallFrames; ++i) {
    const Result<Picture> picture = client->Render(request);
    if (!picture.ok()) return picture.status();
    if (i < kWarmUpFrames) continue;
    std::int64_t render_ns = 0, picture_ns = 0;  // of the worker that took longest: the others work beside it
    for (const RankReport& report : picture->statistics.reports) {
      render_ns = std::max(render_ns, report.stage_ns[std::size_t(Stage::kRender)]);
      picture_ns += report.stage_ns[std::size_t(Stage::kResolve)];
    }
    seconds.push_back(double(picture->latency.count() - render_ns - picture_ns) * 1e-9);
  }
  return UpperMedian(std::move(seconds));
}

}  // namespace

CombiningCosts MeasureCombining(Transfer transfer) {
  constexpr double kPixels = double(kSide) * kSide;
  const PixelRange all = {0, std::uint64_t(kSide) * kSide};
  const LocalImage full = MakePicture(1), half = MakePicture(0.5);
  LocalImage target = full;
  CombiningCosts costs;
  costs.local_pixel = FastestOf([&] { Combine(target, ViewOf(full), Side::kBack, full.bounds); }) / kPixels;
  costs.hidden_pixel = FastestOf([&] { CHECK(FindHiddenTiles(full, kSide, kSide, 1e-3).empty()); }) / kPixels;
  if (transfer == Transfer::kLent) {
    // Only where rows begin and end is looked for, and told.
    costs.scan_pixel = FastestOf([&] { CHECK(!ViewOf(half, all, kSide).rows.empty()); }) / kPixels;
    costs.encode_pixel = 0;
    costs.combine_pixel = costs.local_pixel;
    costs.rgba_bytes = costs.depth_bytes = 0;
    costs.run_bytes = sizeof(ColumnSpan);
    return costs;
  }
  const RunImage full_runs = EncodeRuns(full, all, kSide);
  const double encode_full = FastestOf([&] { CHECK_GT(EncodeRuns(full, all, kSide).payload.size(), 0U); });
  const double encode_half = FastestOf([&] { CHECK_GT(EncodeRuns(half, all, kSide).payload.size(), 0U); });
  // full = (scan + encode) pixels, half = (scan + encode / 2) pixels
  costs.encode_pixel = std::max(2 * (encode_full - encode_half) / kPixels, 0.0);
  costs.scan_pixel = std::max(encode_full / kPixels - costs.encode_pixel, 0.0);
  const double combine =
      FastestOf([&] { CHECK(CombineRuns(target, full_runs.header, full_runs.payload, full.bounds, Side::kBack, full.bounds).ok()); });
  costs.combine_pixel = combine / kPixels;
  return costs;
}

double MeasureMemorySlowdown(const Volume& volume, const FrameSetup& setup) {
  if (std::thread::hardware_concurrency() < 2) return 0;
  const Box whole = volume.block.box;
  Box halves[2] = {whole, whole};
  halves[0].end.z = halves[1].begin.z = whole.begin.z + whole.size().z / 2;
  const std::atomic<bool> cancelled = false;
  std::vector<std::unique_ptr<SlabData>> slabs;
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (const Box& half : halves) {
    slabs.push_back(std::make_unique<SlabData>(BrickedVoxels(CutBlock(volume.block, SlabBox(half, setup)))));
    renderers.push_back(MakeRenderer(setup.renderer));
  }
  const auto render = [&](std::size_t i) {
    tbb::task_arena one_thread(1);
    double seconds = 0;
    one_thread.execute([&] {
      RankReport report;
      seconds = SecondsOf([&] { CHECK(renderers[i]->Render(*slabs[i], halves[i], setup, {}, cancelled, report).ok()); });
    });
    return seconds;
  };
  for (std::size_t i = 0; i < 2; ++i) render(i);  // normals and classification
  // The fastest of several turns each: whatever else the machine does can only add. Processor time counts what each of them took.
  double alone[2] = {kNever, kNever}, beside[2] = {kNever, kNever};
  for (int turn = 0; turn < kSlowdownTurns; ++turn) {
    for (std::size_t i = 0; i < 2; ++i) alone[i] = std::min(alone[i], render(i));
    std::latch both(2);
    std::thread other([&] {
      both.arrive_and_wait();
      beside[1] = std::min(beside[1], render(1));
    });
    both.arrive_and_wait();
    beside[0] = std::min(beside[0], render(0));
    other.join();
  }
  // Only the shorter one had a neighbour all the time.
  const std::size_t shorter = alone[0] < alone[1] ? 0 : 1;
  return alone[shorter] > 0 ? std::clamp(beside[shorter] / alone[shorter] - 1, 0.0, 0.99) : 0;
}

Result<MachineModel> CalibrateThisHost(int workers) {
  const Result<double> one = SmallFrameSeconds(1), two = SmallFrameSeconds(2);
  if (!one.ok()) return one.status();
  if (!two.ok()) return two.status();

  MachineModel machine;
  machine.combining = MeasureCombining(Transfer::kLent);
  // Pixels stay where they are: only the hand-over takes time.
  machine.link = {Contention::kNone, 0, 1e12};
  // One worker: request, assignment, picture and reply, four messages alike. Two: also the partial image, which is encoded, sent and
  // combined.
  machine.link.latency_seconds = machine.client_seconds = *one / 4;
  machine.combining.task = std::max((*two - *one - machine.link.latency_seconds) / 2, 0.0);
  machine.plan_seconds = machine.message_seconds = 0;  // in these
  machine.workers_a_host = workers;
  machine.cores_a_host = int(std::max(std::thread::hardware_concurrency(), 1U));
  machine.picture_threads = std::min(workers, machine.cores_a_host);  // as worker/thread_share.h has it

  const Volume sphere = MakeSphere({SphereClass::kFilled, kSlowdownVolume, 0.4}).value();
  FrameRequest request;
  request.dataset = "sphere";
  const Result<FramePlan> plan = PlanFrame(request, 1, Summarize(sphere), Roster{{1}}, CostModel{});
  if (!plan.ok()) return plan.status();
  machine.memory_slowdown = MeasureMemorySlowdown(sphere, plan->setup);
  return machine;
}

}  // namespace slabstream
