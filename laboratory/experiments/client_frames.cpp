#include "laboratory/experiments/client_frames.h"

#include <algorithm>
#include <map>
#include <string>

#include "client/report/frame_summary.h"
#include "common/planning/resolved_policy.h"
#include "laboratory/experiments/failure.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {
namespace {

constexpr int kWarmUpFrames = 2;
constexpr int kLearningFrames = 12;  // with dynamic balance
constexpr int kLeastMeasured = 8;    // frames from picture to picture
constexpr Duration kPatience = std::chrono::seconds(1);

// Milliseconds of each stage, over frames.
Json MediansOf(const std::vector<StageTimes>& frames) {
  Json medians = Json::object();
  for (int stage = 0; stage < kStageCount; ++stage) {
    const auto of_stage = [stage](const StageTimes& times) { return Milliseconds(times[std::size_t(stage)]); };
    medians[std::string(ToString(Stage(stage)))] = MedianOf(EachOf(frames, of_stage)).median;
  }
  return medians;
}

// Of the worker that renders longest.
StageTimes LongestStages(const FrameStatistics& statistics) {
  std::map<std::uint32_t, StageTimes> by_worker;
  for (const RankReport& report : statistics.reports) AddTimes(by_worker[report.worker], report.stage_ns);
  StageTimes longest{};
  for (const auto& [worker, times] : by_worker) {
    if (times[std::size_t(Stage::kRender)] > longest[std::size_t(Stage::kRender)]) longest = times;
  }
  return longest;
}

}  // namespace

int WarmUpFrames(const Policy& policy) { return IsDynamic(policy) ? kLearningFrames : kWarmUpFrames; }

Json MeasureLatency(Client& client, const FrameRequest& request, int warm_up, int frames) {
  std::vector<double> latencies;
  std::vector<FrameSummary> summaries;
  std::vector<StageTimes> stages, longest_stages;
  for (int i = 0; i < warm_up + frames; ++i) {
    const Picture picture = OrThrow(client.Render(request));
    if (i < warm_up) continue;
    latencies.push_back(Milliseconds(picture.latency.count()));
    summaries.push_back(Summarize(picture.statistics));
    stages.push_back(summaries.back().stage_ns);
    longest_stages.push_back(LongestStages(picture.statistics));
  }
  const auto median = [&](auto&& of) { return MedianOf(EachOf(summaries, of)).median; };
  return Json{{"latency_ms", MedianOf(latencies).median},
              {"all_latency_ms", latencies},
              {"stages_ms", MediansOf(stages)},
              {"render_ms", median([](const FrameSummary& of) { return Milliseconds(of.stage_ns[std::size_t(Stage::kRender)]); })},
              {"longest_render_ms", median([](const FrameSummary& of) { return Milliseconds(of.render_ns); })},
              {"longest_stages_ms", MediansOf(longest_stages)},
              {"picture_ms", median([](const FrameSummary& of) { return Milliseconds(of.finish_ns); })},
              {"imbalance", median(&FrameSummary::imbalance)},
              {"idle_share", median(&FrameSummary::idle_share)},
              {"image_bytes", median(&FrameSummary::image_bytes)}};
}

double MeasurePeriod(Client& client, std::span<const FrameRequest> requests, int in_flight) {
  const int frames = std::max(int(requests.size()), std::max(in_flight, kLeastMeasured) + 2 * in_flight), measured = frames - 2 * in_flight;
  int submitted = 0;
  const auto submit = [&] { client.Submit(requests[std::size_t(submitted++) % requests.size()]); };
  while (submitted < in_flight) submit();
  std::vector<Time> received;
  while (int(received.size()) < frames) {
    const std::optional<ClientEvent> event = client.Next(kPatience);
    if (!event) continue;
    if (const auto* failed = std::get_if<Status>(&event->what)) throw Failure(*failed);
    const auto* picture = std::get_if<Picture>(&event->what);
    if (picture == nullptr || !picture->final) continue;
    received.push_back(MonotonicNow());
    if (submitted < frames) submit();
  }
  const Duration middle = received[std::size_t(in_flight + measured) - 1] - received[std::size_t(in_flight) - 1];
  return Milliseconds(middle.count()) / measured;
}

}  // namespace slabstream
