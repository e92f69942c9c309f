#include "client/cli/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "client/request/json_value.h"
#include "common/combining/schemes.h"
#include "common/view/sheet_grid.h"

namespace slabstream {
namespace {

constexpr int kVersion = 1;
constexpr double kMaxMicroseconds = 1e15, kMaxBytes = 1e18, kMaxId = 4294967295.0;
constexpr std::size_t kMaxRecordedRanks = 65536;  // of a frame

double Seconds(std::int64_t ns) { return double(ns) * 1e-9; }
double Microseconds(double seconds) { return std::round(seconds * 1e9) / 1e3; }

Json RankJson(const RecordedRank& rank) {
  const PixelBounds& b = rank.bounds;
  return {{"box", rank.box},
          {"worker", rank.worker},
          {"render_us", Microseconds(rank.render_seconds)},
          {"bounds", {b.x_begin, b.y_begin, b.x_end, b.y_end}},
          {"pixels", rank.pixels}};
}

// A list of pixel columns or rows.
std::vector<std::int32_t> ReadPixels(const JsonValue& value, std::size_t count) {
  std::vector<std::int32_t> pixels;
  value.Each([&](const JsonValue& v) { pixels.push_back(v.Integer(0, kMaxGridSide)); }, count);
  if (pixels.size() != count) value.Complain(fmt::format("{} must be a list of {} numbers", value.Shown(), count));
  pixels.resize(count);
  return pixels;
}

RecordedRank ReadRank(const JsonValue& value, const PixelBounds& grid) {
  RecordedRank rank;
  rank.box = BoxId(value.At("box").Number({0, double(kMaxRecordedRanks) * kMaxGroups}));
  rank.worker = WorkerId(value.At("worker").Number({0, kMaxId}));
  rank.render_seconds = value.At("render_us").Number({0, kMaxMicroseconds}) * 1e-6;
  const std::vector<std::int32_t> bounds = ReadPixels(value.At("bounds"), 4);
  rank.bounds = {bounds[0], bounds[1], bounds[2], bounds[3]};
  if (!grid.Contains(rank.bounds)) value.At("bounds").Complain("lies outside the grid");
  rank.pixels = value.At("pixels").Number({0, double(std::max<std::int64_t>(rank.bounds.pixel_count(), 0))});
  return rank;
}

RecordedFrame ReadFrame(const JsonValue& value) {
  const auto seconds = [&](const char* field, double min) { return value.At(field).Number({min, kMaxMicroseconds}) * 1e-6; };
  RecordedFrame frame;
  frame.renderer = Renderers()[value.At("renderer").OneOf(RendererNames())];
  const std::vector<std::int32_t> grid = ReadPixels(value.At("grid"), 2);
  frame.grid = {0, 0, grid[0], grid[1]};
  if (frame.grid.empty()) value.At("grid").Complain("has no pixels");
  frame.workers = std::uint32_t(value.At("workers").Number({1, double(kMaxRecordedRanks)}));
  frame.display = WorkerId(value.At("display").Number({1, kMaxId}));
  frame.combine = value.At("combine").Text();
  if (const auto scheme = ParseCombining(frame.combine); !scheme.ok()) value.At("combine").Complain(scheme.status().message());
  frame.arrived = seconds("arrived_us", -kMaxMicroseconds);
  frame.begin = seconds("begin_us", -kMaxMicroseconds);
  frame.end = seconds("end_us", -kMaxMicroseconds);
  frame.latency = seconds("latency_us", 0);
  frame.picture_seconds = seconds("picture_us", 0);
  frame.image_bytes = value.At("image_bytes").Number({0, kMaxBytes});
  frame.voxel_bytes = value.At("voxel_bytes").Number({0, kMaxBytes});

  std::size_t ranks = 0;
  value.At("groups").Each([&](const JsonValue& group) {
    std::vector<RecordedRank>& recorded = frame.groups.emplace_back();
    const auto read = [&](const JsonValue& rank) {
      if (++ranks <= kMaxRecordedRanks) recorded.push_back(ReadRank(rank, frame.grid));
    };
    group.Each(read, 0);
  });
  if (ranks == 0) value.At("groups").Complain("has no boxes");
  if (ranks > kMaxRecordedRanks) value.At("groups").Complain(fmt::format("has more than {} boxes", kMaxRecordedRanks));
  return frame;
}

}  // namespace

RecordedFrame Record(const FrameStatistics& statistics, Duration latency) {
  RecordedFrame frame;
  frame.renderer = RequireRenderer(statistics.renderer).value();
  frame.grid = statistics.grid;
  frame.workers = statistics.workers;
  frame.display = statistics.display;
  frame.combine = statistics.combine;
  frame.arrived = Seconds(statistics.begin_ns - statistics.queued_ns);
  frame.begin = Seconds(statistics.begin_ns);
  frame.end = Seconds(statistics.end_ns);
  frame.latency = Seconds(latency.count());
  frame.groups.resize(statistics.groups);
  for (const RankReport& report : statistics.reports) {
    frame.picture_seconds += Seconds(PictureNs(report));
    frame.image_bytes += double(report.image_bytes);
    frame.voxel_bytes += double(report.voxel_bytes);
    if (report.group >= frame.groups.size() || report.rank >= kMaxRecordedRanks) continue;
    std::vector<RecordedRank>& group = frame.groups[report.group];
    if (report.rank >= group.size()) group.resize(report.rank + 1);
    RecordedRank& rank = group[report.rank];
    // The display worker's report of the picture names a rank, too.
    rank.render_seconds += Seconds(report.stage_ns[std::size_t(Stage::kRender)]);
    if (rank.worker != 0 && report.image_bounds.empty()) continue;
    rank.box = report.box;
    rank.worker = report.worker;
    rank.bounds = report.image_bounds;
    rank.pixels = std::min(double(report.image_pixels), double(report.image_bounds.pixel_count()));
  }
  return frame;
}

Json RecordingJson(std::span<const RecordedFrame> frames) {
  Json list = Json::array();
  const double origin = frames.empty() ? 0 : frames.front().arrived;
  for (const RecordedFrame& frame : frames) {
    Json groups = Json::array();
    for (const std::vector<RecordedRank>& group : frame.groups) {
      Json ranks = Json::array();
      for (const RecordedRank& rank : group) ranks.push_back(RankJson(rank));
      groups.push_back(std::move(ranks));
    }
    list.push_back({{"renderer", frame.renderer->name()},
                    {"grid", {frame.grid.width(), frame.grid.height()}},
                    {"workers", frame.workers},
                    {"display", frame.display},
                    {"combine", frame.combine},
                    {"arrived_us", Microseconds(frame.arrived - origin)},
                    {"begin_us", Microseconds(frame.begin - origin)},
                    {"end_us", Microseconds(frame.end - origin)},
                    {"latency_us", Microseconds(frame.latency)},
                    {"picture_us", Microseconds(frame.picture_seconds)},
                    {"image_bytes", frame.image_bytes},
                    {"voxel_bytes", frame.voxel_bytes},
                    {"groups", std::move(groups)}});
  }
  return {{"version", kVersion}, {"frames", std::move(list)}};
}

Result<std::vector<RecordedFrame>> ParseRecording(std::string_view text) {
  const Result<Json> json = ParseJson(text);
  if (!json.ok()) return Status::InvalidArgument("the trace: " + json.status().message());
  const Json* const recording = json->find(kRecordingKey);
  if (recording == nullptr) {
    return Status::InvalidArgument("the trace holds no \"slabstream\": record it with --trace of render or turntable");
  }
  std::optional<std::string> mistake;
  const JsonValue value(*recording, kRecordingKey, mistake);
  (void)value.At("version").Integer(kVersion, kVersion);
  std::vector<RecordedFrame> frames;
  if (!mistake) value.At("frames").Each([&](const JsonValue& frame) { frames.push_back(ReadFrame(frame)); });
  if (mistake) return Status::InvalidArgument("the trace: " + *mistake);
  return frames;
}

}  // namespace slabstream
