#include "client/telemetry/frame_trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "client/cli/trace_spans.h"
#include "tests/client/report/frame_of_two.h"

namespace slabstream {
namespace {

Time At(std::int64_t ns) { return Time(Duration(ns)); }

// The spans by their ids. Each belongs to the trace, has an id of its own, and lies within its parent, which is there.
void ExpectATree(const std::vector<TraceSpan>& spans, const TraceSpan& root) {
  std::map<SpanId, const TraceSpan*> by_id = {{root.id, &root}};
  for (const TraceSpan& span : spans) {
    EXPECT_TRUE(span.id == root.id || by_id.emplace(span.id, &span).second);
  }
  for (const TraceSpan& span : spans) {
    EXPECT_EQ(span.trace, root.trace);
    EXPECT_LE(span.begin_ns, span.end_ns) << span.name;
    if (span.id == root.id) continue;
    ASSERT_TRUE(span.parent) << span.name;
    ASSERT_TRUE(by_id.contains(*span.parent)) << span.name;
    const TraceSpan& parent = *by_id[*span.parent];
    EXPECT_GE(span.begin_ns, parent.begin_ns) << span.name << " in " << parent.name;
    EXPECT_LE(span.end_ns, parent.end_ns) << span.name << " in " << parent.name;
  }
}

const TraceSpan& Find(const std::vector<TraceSpan>& spans, const std::string& name) {
  return *std::ranges::find(spans, name, &TraceSpan::name);
}

TraceSpan Root(const WallClock& clock) {
  TraceSpan root;
  root.trace = NewTraceId();
  root.begin_ns = clock.At(At(0));
  root.end_ns = clock.At(At(1000 * kMs));
  return root;
}

TEST(FrameTraceTest, HasAFrameItsWaitItsWorkersAndTheirStages) {
  const WallClock clock;
  const TraceSpan root = Root(clock);
  std::vector<TraceSpan> spans;
  AddFrame(spans, root, clock, At(97 * kMs), At(131 * kMs), "head", FrameAt(100 * kMs));
  ExpectATree(spans, root);
  std::multiset<std::string> names;
  for (const TraceSpan& span : spans) names.insert(span.name);
  EXPECT_EQ(names, (std::multiset<std::string>{"frame", "queued", "worker", "worker", "fetch", "fetch", "render", "render", "combine",
                                               "combine"}));
  const TraceSpan& frame = spans.back();
  EXPECT_EQ(frame.name, "frame");
  EXPECT_EQ(frame.kind, SpanKind::kClient);
  EXPECT_EQ(frame.parent, root.id);
  EXPECT_EQ(frame.begin_ns, clock.At(At(97 * kMs)));
  EXPECT_EQ(frame.end_ns, clock.At(At(131 * kMs)));
  EXPECT_EQ(frame.attributes.front(), TraceAttribute("slabstream.dataset", "head"));
  // The service's clock is this process's: nothing is moved.
  const TraceSpan& queued = Find(spans, "queued");
  EXPECT_EQ(queued.parent, frame.id);
  EXPECT_EQ(queued.begin_ns, clock.At(At(98 * kMs)));
  EXPECT_EQ(queued.end_ns, clock.At(At(100 * kMs)));
  const TraceSpan& render = Find(spans, "render");
  EXPECT_EQ(render.begin_ns, clock.At(At(101 * kMs)));
  EXPECT_EQ(render.attributes, (std::vector<TraceAttribute>{{"slabstream.worker", std::int64_t{4}},
                                                            {"slabstream.group", std::int64_t{0}},
                                                            {"slabstream.rank", std::int64_t{0}},
                                                            {"slabstream.box", std::int64_t{7}}}));
  const TraceSpan& worker = Find(spans, "worker");
  EXPECT_EQ(render.parent, worker.id);
  EXPECT_EQ(worker.parent, frame.id);
  EXPECT_EQ(worker.end_ns, clock.At(At(110 * kMs)));
}

TEST(FrameTraceTest, AServiceOnAnotherHostEndsWithTheFrame) {
  const WallClock clock;
  const TraceSpan root = Root(clock);
  for (const std::int64_t other : {-5000 * kMs, 96 * kMs, 102 * kMs, 90'000'000 * kMs}) {
    std::vector<TraceSpan> spans;
    AddFrame(spans, root, clock, At(97 * kMs), At(131 * kMs), "head", FrameAt(other, 0, 123'456 * kMs));
    ExpectATree(spans, root);
    EXPECT_EQ(Find(spans, "queued").end_ns, clock.At(At(101 * kMs))) << other;
    EXPECT_EQ(Find(spans, "render").end_ns, clock.At(At(110 * kMs))) << other;
  }
}

TEST(FrameTraceTest, TimesThatCannotBeTrueStayInTheFrame) {
  const WallClock clock;
  const TraceSpan root = Root(clock);
  FrameStatistics frame = FrameAt(100 * kMs);
  frame.queued_ns = 5000 * kMs;
  frame.reports[0].spans.push_back({Stage::kRender, 500 * kMs, 400 * kMs});
  std::vector<TraceSpan> spans;
  AddFrame(spans, root, clock, At(131 * kMs), At(97 * kMs), "head", frame);
  for (const TraceSpan& span : spans) {
    EXPECT_EQ(span.begin_ns, clock.At(At(131 * kMs))) << span.name;
    EXPECT_EQ(span.end_ns, clock.At(At(131 * kMs))) << span.name;
  }
}

TEST(FrameTraceTest, ManyStagesAreLeftOutAndCounted) {
  const WallClock clock;
  const TraceSpan root = Root(clock);
  FrameStatistics frame = FrameAt(100 * kMs);
  frame.reports.assign(1000, frame.reports[0]);
  std::vector<TraceSpan> spans;
  AddFrame(spans, root, clock, At(97 * kMs), At(131 * kMs), "head", frame);
  EXPECT_EQ(spans.size(), kMaxTracedStages + 3);  // the frame, its wait, a worker
  EXPECT_EQ(spans.back().attributes.back(), TraceAttribute("slabstream.stages_left_out", std::int64_t(3000 - kMaxTracedStages)));
}

TEST(CommandSpansTest, TheCommandIsTheRootOfItsFrames) {
  std::vector<FrameRecord> frames(2);
  for (std::size_t i = 0; i < 2; ++i) {
    frames[i].output = "f" + std::to_string(i) + ".png";
    frames[i].received = At((131 + 20 * std::int64_t(i)) * kMs);
    frames[i].latency = Duration(34 * kMs);
    frames[i].statistics = FrameAt((100 + 20 * std::int64_t(i)) * kMs);
  }
  TracedCommand command{.command = "turntable", .source = "head", .begin = At(50 * kMs), .end = At(200 * kMs), .parent = {}};
  const std::vector<TraceSpan> spans = CommandSpans(command, frames, {Status::Internal("frame 3 of 3 (f2.png): no")});
  const TraceSpan& root = spans.back();
  ExpectATree(spans, root);
  EXPECT_EQ(root.name, "slabstream turntable");
  EXPECT_FALSE(root.parent);
  EXPECT_EQ(root.error, "1 frames failed; the last one: frame 3 of 3 (f2.png): no");
  EXPECT_EQ(std::ranges::count(spans, "frame", &TraceSpan::name), 2);
  EXPECT_EQ(Find(spans, "frame").attributes.back(), TraceAttribute("slabstream.output", "f0.png"));

  command.parent = TraceParent{.trace = NewTraceId(), .span = NewSpanId(), .sampled = true};
  const TraceSpan child = CommandSpans(command, frames, {}).back();
  EXPECT_EQ(child.trace, command.parent->trace);
  EXPECT_EQ(child.parent, command.parent->span);
  EXPECT_FALSE(child.error);
  command.parent->sampled = false;
  EXPECT_TRUE(CommandSpans(command, frames, {}).empty());
}

}  // namespace
}  // namespace slabstream
