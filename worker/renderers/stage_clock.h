// StageClock: charges the time since its last call to a stage. One thread.
#pragma once

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/image/local_image.h"
#include "common/stats/report.h"
#include "worker/renderers/render_control.h"

namespace slabstream {

class StageClock {
 public:
  explicit StageClock(RankReport& report) : report_(report), begin_(MonotonicNow()), last_(begin_) {}

  void Charge(Stage stage) {
    const Time now = MonotonicNow();
    report_.stage_ns[std::size_t(stage)] += (now - last_).count();
    last_ = now;
  }

  // Ends a render that made `image`, unless it was cancelled. Records everything since construction as Stage::kRender too: time, without
  // the pauses of `control`, and span.
  Result<LocalImage> Finish(LocalImage image, const RenderControl& control) {
    last_ = MonotonicNow();
    AddStage(report_, Stage::kRender, begin_.time_since_epoch().count(), last_.time_since_epoch().count());
    report_.stage_ns[std::size_t(Stage::kRender)] -= control.paused().count();
    if (control.cancelled()) return Status::Cancelled("rendering was cancelled");
    return image;
  }

 private:
  RankReport& report_;
  Time begin_, last_;
};

}  // namespace slabstream
