#include "laboratory/experiments/client_frames.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>

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

double Milliseconds(std::int64_t ns) { return double(ns) * 1e-6; }

// Milliseconds a frame of each stage.
using StageSeries = std::array<std::vector<double>, kStageCount>;
void Append(StageSeries& series, const StageTimes& times) {
  for (std::size_t stage = 0; stage < series.size(); ++stage) series[stage].push_back(Milliseconds(times[stage]));
}
Json MediansOf(StageSeries series) {
  Json medians = Json::object();
  for (std::size_t stage = 0; stage < series.size(); ++stage) {
    medians[std::string(ToString(Stage(stage)))] = MedianOf(std::move(series[stage])).median;
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
  std::vector<double> latencies, renders, longest, pictures, imbalances, idle_shares, image_bytes;
  StageSeries stages, longest_stages;
  for (int i = 0; i < warm_up + frames; ++i) {
    const Picture picture = OrThrow(client.Render(request));
    if (i < warm_up) continue;
    const FrameSummary summary = Summarize(picture.statistics);
    latencies.push_back(Milliseconds(picture.latency.count()));
    renders.push_back(Milliseconds(summary.stage_ns[std::size_t(Stage::kRender)]));
    longest.push_back(Milliseconds(summary.render_ns));
    imbalances.push_back(summary.imbalance);
    idle_shares.push_back(summary.idle_share);
    image_bytes.push_back(double(summary.image_bytes));
    pictures.push_back(Milliseconds(summary.finish_ns));
    Append(stages, summary.stage_ns);
    Append(longest_stages, LongestStages(picture.statistics));
  }
  return Json{{"latency_ms", MedianOf(latencies).median},
              {"all_latency_ms", latencies},
              {"stages_ms", MediansOf(std::move(stages))},
              {"render_ms", MedianOf(std::move(renders)).median},
              {"longest_render_ms", MedianOf(std::move(longest)).median},
              {"longest_stages_ms", MediansOf(std::move(longest_stages))},
              {"picture_ms", MedianOf(std::move(pictures)).median},
              {"imbalance", MedianOf(std::move(imbalances)).median},
              {"idle_share", MedianOf(std::move(idle_shares)).median},
              {"image_bytes", MedianOf(std::move(image_bytes)).median}};
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
