// Alarm: wakes a machine when it wants to be woken. At most one event is planned that is not too late.
#pragma once

#include <functional>

#include "simulator/event_queue.h"

namespace slabstream {

class Alarm {
 public:
  // `wake` is called at `when` or later; it looks at the machine's NextWake and sets the alarm again.
  void Set(EventQueue<Time>& queue, Time when, const std::function<void()>& wake) {
    if (when >= planned_) return;
    planned_ = when;
    queue.At(when, [this, when, wake] {
      if (planned_ != when) return;
      planned_ = Time::max();
      wake();
    });
  }

 private:
  Time planned_ = Time::max();
};

}  // namespace slabstream
