// The spans of frames, as parts of a trace:
//
//   frame             from the request to the picture, as the client saw it
//     queued          what the frame waited at the service
//     worker          one for each worker, from its first stage to its last one
//       render, ...   the stages of StageSpans
#pragma once

#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/otlp/otlp_json.h"
#include "common/wire/client_messages.h"

namespace slabstream {

// Instants of MonotonicNow() as nanoseconds since 1970, by the time of day when this was made.
class WallClock {
 public:
  WallClock();
  std::int64_t At(Time time) const { return time.time_since_epoch().count() + offset_ns_; }

 private:
  std::int64_t offset_ns_;
};

// A span that belongs to `parent`, with its trace.
TraceSpan ChildOf(const TraceSpan& parent, std::string name, std::int64_t begin_ns, std::int64_t end_ns);

inline constexpr std::size_t kMaxTracedStages = 1024;  // in the trace of a frame

// Adds a frame that lasted from `begin` to `end`, by this process's clock, as a child of `parent`. Times at the service that do not lie
// between the two are by the clock of another host: they are moved, so that the service ends with the frame. Stages beyond
// kMaxTracedStages are left out; slabstream.stages_left_out of the frame tells how many. The frame is the last span
// that is added. `parent` must not be in `trace`, which grows.
void AddFrame(std::vector<TraceSpan>& trace, const TraceSpan& parent, const WallClock& clock, Time begin, Time end,
              const std::string& dataset, const FrameStatistics& statistics);

}  // namespace slabstream
