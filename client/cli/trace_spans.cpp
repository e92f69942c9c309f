#include "client/cli/trace_spans.h"

#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "client/telemetry/frame_trace.h"

namespace slabstream {

std::vector<TraceSpan> CommandSpans(const TracedCommand& command, const std::vector<FrameRecord>& frames,
                                    const std::vector<Status>& failures) {
  if (command.parent && !command.parent->sampled) return {};
  const WallClock clock;
  TraceSpan root;
  root.trace = command.parent ? command.parent->trace : NewTraceId();
  if (command.parent) root.parent = command.parent->span;
  root.name = "slabstream " + command.command;
  root.begin_ns = clock.At(command.begin);
  root.end_ns = clock.At(command.end);
  root.attributes = {{"slabstream.source", command.source}, {"slabstream.frames", std::int64_t(frames.size())}};
  if (!failures.empty()) root.error = fmt::format("{} frames failed; the last one: {}", failures.size(), failures.back().message());
  std::vector<TraceSpan> spans;
  for (const FrameRecord& frame : frames) {
    AddFrame(spans, root, clock, frame.received - frame.latency, frame.received, command.source, frame.statistics);
    spans.back().attributes.emplace_back("slabstream.output", frame.output);
  }
  spans.push_back(std::move(root));
  return spans;
}

std::optional<TraceParent> ParentOfProcess() {
  const char* const text = std::getenv("TRACEPARENT");
  return text != nullptr ? ParseTraceParent(text) : std::nullopt;
}

}  // namespace slabstream
