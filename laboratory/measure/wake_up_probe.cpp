#include "laboratory/measure/wake_up_probe.h"

#include <map>
#include <memory>
#include <string>

#include "common/volume/sphere.h"
#include "laboratory/measure/lab_service.h"

namespace slabstream {
namespace {

constexpr char kQuick[] = "quick", kSlow[] = "slow";
constexpr int kQuickVolume = 16, kSlowVolume = 160;
constexpr int kQuickPicture = 32, kSlowPicture = 512;
constexpr int kQuickFrames = 4;  // a sample; the first one wakes all threads

FrameRequest Request(const std::string& dataset) {
  FrameRequest request;
  request.dataset = dataset;
  const int side = dataset == kQuick ? kQuickPicture : kSlowPicture;
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

Status WakeUpProbe::Sample(int count) {
  static const std::map<std::string, std::shared_ptr<const Volume>> volumes = {{kQuick, Sphere(kQuickVolume)},
                                                                               {kSlow, Sphere(kSlowVolume)}};
  const Result<std::unique_ptr<LabService>> service = LabService::Start(1, volumes);
  if (!service.ok()) return service.status();
  for (int sample = -1; sample < count; ++sample) {  // the first one fetches voxels and makes the data that workers keep
    for (int i = 0; i < kQuickFrames; ++i) {
      const Result<TimedPicture> timed = (*service)->Render(Request(kQuick));
      if (!timed.ok()) return timed.status();
      if (sample >= 0 && i > 0) quick_.push_back(InstantsOf(*timed));
    }
    const Result<TimedPicture> timed = (*service)->Render(Request(kSlow));
    if (!timed.ok()) return timed.status();
    if (sample >= 0) slow_.push_back(InstantsOf(*timed));
  }
  return Status::Ok();
}

}  // namespace slabstream
