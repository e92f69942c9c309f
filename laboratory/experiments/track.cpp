#include "laboratory/experiments/track.h"

#include <algorithm>
#include <functional>
#include <numeric>

namespace slabstream {
namespace {

// A method has settled once its longest render time stays below this many times what it is in the end, for as many frames.
constexpr double kSettled = 1.1;
constexpr int kSettledFrames = 3;

double SumOf(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }
double MeanOf(const std::vector<double>& values) { return SumOf(values) / double(values.size()); }
std::vector<double> WithoutFirst(const std::vector<double>& values) { return {values.begin() + 1, values.end()}; }

// Frames from the middle on until the longest render time has settled.
double SettlingFrames(const std::vector<double>& longest) {
  const auto middle = longest.begin() + std::ptrdiff_t(longest.size() / 2);
  const std::vector<double> last_quarter(longest.end() - std::ptrdiff_t(longest.size() / 4), longest.end());
  const double settled = kSettled * Quantile(last_quarter, 0.5);
  int calm = 0;
  for (auto frame = middle; frame != longest.end(); ++frame) {
    calm = *frame <= settled ? calm + 1 : 0;
    if (calm == kSettledFrames) return double(frame - middle) - (kSettledFrames - 1);
  }
  return double(longest.end() - middle);
}

}  // namespace

Json ColumnsOf(const Walk& walk) {
  Json of = ColumnsOf(walk.frame, {{"part", "path"}});
  of["view"] = walk.path->name;
  return of;
}

void AddTracks(Results& results, const Walk& walk, const Json& of, const std::vector<Track>& repeats, bool simulated) {
  const auto add = [&](const char* metric, const std::function<double(const Track&)>& figure, bool is_simulated = false,
                       const char* variant = nullptr) {
    Json columns = of;
    if (variant != nullptr) columns["variant"] = variant;
    results.Add(columns, metric, EachOf(repeats, figure), is_simulated ? Origin::kSimulated : Origin::kMeasured);
  };
  const auto mean = [](std::vector<double> Track::*values) {
    return [values](const Track& track) { return MeanOf(WithoutFirst(track.*values)); };
  };
  const char* const longest = "longest_render_time";
  add(longest, mean(&Track::longest_seconds));
  add(
      longest, [](const Track& track) { return Quantile(WithoutFirst(track.longest_seconds), 0.95); }, false, "95 % of frames");
  add(
      longest, [](const Track& track) { return std::ranges::max(WithoutFirst(track.longest_seconds)); }, false, "worst frame");
  add("imbalance", mean(&Track::imbalance));
  add("render_time", mean(&Track::render_seconds));
  add("voxel_bytes", mean(&Track::moved_bytes));
  if (repeats.front().most_voxel_bytes > 0) {
    add("memory", [](const Track& track) { return track.most_voxel_bytes; });
    const auto share = [](const Track& track) {
      return track.moving_seconds / (track.moving_seconds + SumOf(WithoutFirst(track.longest_seconds)));
    };
    add("move_share", share, true);
  }
  if (walk.path->settles) add("settling_frames", [](const Track& track) { return SettlingFrames(track.longest_seconds); });
  add(
      "latency", [](const Track& track) { return MeanOf(track.latency_seconds); }, simulated);
  add(
      "period", [](const Track& track) { return MeanOf(track.period_seconds); }, simulated);
}

void AddSteps(std::vector<Json>& rows, const Walk& walk, const std::vector<Track>& repeats) {
  const Policy& policy = walk.frame.policy;
  const auto median = [&](std::vector<double> Track::*values, std::size_t step) {
    return MedianOf(EachOf(repeats, [&](const Track& track) { return (track.*values)[step]; })).median;
  };
  for (std::size_t step = 0; step < repeats.front().longest_seconds.size(); ++step) {
    rows.push_back({{"step", step},
                    {"decomposition", policy.decomposition},
                    {"balance_by", BalanceByOf(policy)},
                    {"balance", policy.balance},
                    {"assignment", policy.assignment},
                    {"groups", policy.groups},
                    {"longest_render_time", median(&Track::longest_seconds, step)},
                    {"imbalance", median(&Track::imbalance, step)},
                    {"voxel_bytes", median(&Track::moved_bytes, step)}});
  }
}

}  // namespace slabstream
