// --otlp: the spans of a command, for an OpenTelemetry collector. The command is the root; its frames are the children (AddFrame).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/frame_loop.h"
#include "common/otlp/otlp_json.h"
#include "common/otlp/trace_context.h"

namespace slabstream {

struct TracedCommand {
  std::string command;  // "render"
  std::string source;
  Time begin, end;
  std::optional<TraceParent> parent;  // the span that the command belongs to; none: it has a trace of its own
};

// Nothing if the parent is not sampled. `failures`: of frames that have no record.
std::vector<TraceSpan> CommandSpans(const TracedCommand& command, const std::vector<FrameRecord>& frames,
                                    const std::vector<Status>& failures);

// What $TRACEPARENT names: whoever starts this process may put its span there.
std::optional<TraceParent> ParentOfProcess();

}  // namespace slabstream
