// StageClock: charges the time since its last call to a stage. One thread.
#pragma once

#include "common/base/time.h"
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

  // Records everything since construction as `stage` too: time, without the pauses of `control`, and span.
  void Finish(Stage stage, const RenderControl& control) {
    last_ = MonotonicNow();
    AddStage(report_, stage, begin_.time_since_epoch().count(), last_.time_since_epoch().count());
    report_.stage_ns[std::size_t(stage)] -= control.paused().count();
  }

 private:
  RankReport& report_;
  Time begin_, last_;
};

}  // namespace slabstream
