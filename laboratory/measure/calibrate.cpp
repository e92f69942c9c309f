#include "laboratory/measure/calibrate.h"

#include <algorithm>
#include <thread>
#include <vector>

#include "common/base/check.h"
#include "common/image/coverage_map.h"
#include "common/image/occlusion_mask.h"
#include "common/kernels/combine.h"
#include "laboratory/measure/statistics.h"
#include "laboratory/measure/thread_time.h"
#include "laboratory/measure/wake_up_probe.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 512;  // of the frame
constexpr PixelBounds kFrame = {0, 0, kSide, kSide};
constexpr PixelBounds kBounds = {kSide / 8, kSide / 8, kSide - kSide / 8, kSide - kSide / 8};  // of the combined pictures
constexpr double kPixels = double(kSide) * kSide;
constexpr int kRepeats = 15;
constexpr std::size_t kCacheBytes = std::size_t{64} << 20;  // more than any cache

// Fills `bounds`; every row holds `filled` of its pixels, in runs of 32.
LocalImage MakePicture(PixelFormat format, const PixelBounds& bounds, double filled) {
  constexpr std::int32_t kRun = 32;
  LocalImage image = MakeLocalImage(format, bounds);
  const auto period = std::int32_t(kRun / filled);
  for (std::int32_t y = 0; y < bounds.height(); ++y) {
    for (std::int32_t x = 0; x < bounds.width(); ++x) {
      if ((x + y) % period >= kRun) continue;
      const auto pixel = std::size_t(y * bounds.width() + x);
      std::fill_n(&image.rgba[4 * pixel], 4, 0.4F);
      if (HasDepth(format)) image.depth[pixel] = float(x);
    }
  }
  return image;
}

void EmptyCaches() {
  static std::vector<std::uint64_t> other(kCacheBytes / sizeof(std::uint64_t), 1);
  for (std::uint64_t& word : other) ++word;
}

// `prepare` makes the input of the work, on another thread.
template <class Prepare, class Work>
double MedianSeconds(Prepare&& prepare, Work&& work) {
  std::vector<double> seconds;
  for (int i = 0; i < kRepeats; ++i) {
    std::thread(prepare).join();
    EmptyCaches();
    seconds.push_back(SecondsOf(work));
  }
  return MedianOf(std::move(seconds)).median;
}

}  // namespace

CombiningCosts MeasureCombining(ImageTransfer transfer, PixelFormat format) {
  constexpr double kFilled = double(kBounds.width()) * kBounds.height();
  const PixelRange all = {0, std::uint64_t(kSide) * kSide};
  LocalImage full, half, target, other;
  const auto make_pictures = [&] {
    full = MakePicture(format, kFrame, 1);
    half = MakePicture(format, kFrame, 0.5);
  };
  const auto make_images = [&] { target = other = MakePicture(format, kBounds, 1); };
  CombiningCosts costs;
  costs.local_pixel = MedianSeconds(make_images, [&] { Combine(target, ViewOf(other), Side::kBack, kFrame); }) / kFilled;
  costs.hidden_pixel = 0;
  if (format == PixelFormat::kRgba) {
    costs.hidden_pixel = MedianSeconds(make_pictures, [&] { CHECK(FindHiddenTiles(full, kSide, kSide, 1e-3).empty()); }) / kPixels;
  }
  if (transfer == ImageTransfer::kLent) {
    // The sender only finds and describes where rows begin and end.
    costs.lent = true;
    costs.scan_pixel = MedianSeconds(make_pictures, [&] { CHECK(!ViewOf(half, all, kSide).rows.empty()); }) / kPixels;
    costs.encode_pixel = 0;
    costs.combine_pixel =
        MedianSeconds(make_images, [&] { CHECK(CombineUnchecked(target, ViewOf(other), Side::kBack, kFrame)); }) / kFilled;
    costs.rgba_bytes = costs.depth_bytes = 0;
    costs.run_bytes = sizeof(ColumnSpan);
    return costs;
  }
  const double encode_full = MedianSeconds(make_pictures, [&] { CHECK_GT(EncodeRuns(full, all, kSide).payload.size(), 0U); });
  const double encode_half = MedianSeconds(make_pictures, [&] { CHECK_GT(EncodeRuns(half, all, kSide).payload.size(), 0U); });
  // full = (scan + encode) pixels, half = (scan + encode / 2) pixels. Most of it is copying.
  costs.encode_pixel = std::clamp(2 * (encode_full - encode_half), 0.0, encode_full) / kPixels;
  costs.scan_pixel = encode_full / kPixels - costs.encode_pixel;
  RunImage runs;
  const auto make_runs = [&] {
    make_images();
    runs = EncodeRuns(other, all, kSide);
  };
  costs.combine_pixel =
      MedianSeconds(make_runs, [&] { CHECK(CombineRuns(target, runs.header, runs.payload, kFrame, Side::kBack, kFrame).ok()); }) / kFilled;
  return costs;
}

MachineModel ThisHost(int workers) {
  MachineModel machine;
  machine.combining = MeasureCombining(ImageTransfer::kLent);
  machine.link = {Contention::kNone, 0, 1e12};  // pixels stay where they are
  // The wake-ups to and from the coordinator include its work.
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
  machine.workers_a_host = workers;
  machine.cores_a_host = int(std::max(std::thread::hardware_concurrency(), 1U));
  return machine;
}

Result<MachineModel> CalibrateThisHost(int workers) {
  WakeUpProbe probe;
  if (Status status = probe.Sample(kCalibrationSamples); !status.ok()) return status;
  MachineModel machine = ThisHost(workers);
  machine.wake_ups = probe.Estimates().Costs();
  return machine;
}

}  // namespace slabstream
