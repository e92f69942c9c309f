#include "laboratory/measure/wake_up_probe.h"

#include <memory>
#include <string>

#include "common/base/check.h"
#include "common/volume/sphere.h"
#include "laboratory/measure/lab_service.h"

namespace slabstream {
namespace {

constexpr int kQuickVolume = 16, kSlowVolume = 160;
constexpr int kQuickPicture = 32, kSlowPicture = 512;
constexpr int kQuickFrames = 4;  // a sample; the first one wakes all threads

FrameRequest Request(const std::string& dataset, int side) {
  FrameRequest request;
  request.dataset = dataset;
  request.size = {side, side};
  request.policy.groups = 1;
  return request;
}

double Seconds(std::int64_t ns) { return double(ns) * 1e-9; }

FrameInstants InstantsOf(const TimedPicture& timed) {
  FrameInstants instants{.submitted = Seconds(timed.submitted.time_since_epoch().count()),
                         .received = Seconds(timed.received.time_since_epoch().count())};
  for (const RankReport& report : timed.picture.statistics.reports) {
    for (const Span& span : report.spans) {
      if (span.stage == Stage::kRender) {
        instants.render_begin = Seconds(span.begin_ns);
        instants.render_end = Seconds(span.end_ns);
      } else if (span.stage == Stage::kResolve) {
        instants.finish_begin = Seconds(span.begin_ns);
      } else if (span.stage == Stage::kEncode) {  // of the picture: one worker sends no image to others
        instants.finish_end = Seconds(span.end_ns);
      }
    }
  }
  return instants;
}

std::shared_ptr<const Volume> Sphere(int size) {
  return std::make_shared<const Volume>(MakeSphere({SphereClass::kFilled, size, 0.4}).value());
}

}  // namespace

WakeUpEstimates FitWakeUps(std::span<const FrameInstants> quick, std::span<const FrameInstants> slow) {
  CHECK(!quick.empty() && !slow.empty()) << quick.size() << " quick frames and " << slow.size() << " slow ones";
  const auto awake = [](const FrameInstants& f) {
    return (f.render_begin - f.submitted + f.finish_begin - f.render_end + f.received - f.finish_end) / 10;
  };
  const auto asleep = [](const FrameInstants& f) { return (f.finish_begin - f.render_end) / 2; };
  return {MedianOf(EachOf(quick, awake)), MedianOf(EachOf(slow, asleep))};
}

Status WakeUpProbe::Sample(int count) {
  static const std::vector<std::shared_ptr<const Volume>> volumes = {Sphere(kQuickVolume), Sphere(kSlowVolume)};
  Result<ServiceConnection> service = OpenLabService(1, volumes);
  if (!service.ok()) return service.status();
  const FrameRequest quick = Request(service->dataset(0), kQuickPicture), slow = Request(service->dataset(1), kSlowPicture);
  for (int sample = -1; sample < count; ++sample) {  // the first one fetches voxels and makes the data that workers keep
    for (int i = 0; i < kQuickFrames; ++i) {
      const Result<TimedPicture> timed = RenderTimed(service->client(), quick);
      if (!timed.ok()) return timed.status();
      if (sample >= 0 && i > 0) quick_.push_back(InstantsOf(*timed));
    }
    const Result<TimedPicture> timed = RenderTimed(service->client(), slow);
    if (!timed.ok()) return timed.status();
    if (sample >= 0) slow_.push_back(InstantsOf(*timed));
  }
  return Status::Ok();
}

}  // namespace slabstream
