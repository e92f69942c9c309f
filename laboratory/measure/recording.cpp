#include "laboratory/measure/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/combining/schemes.h"
#include "common/renderers/registry.h"
#include "common/view/range_status.h"
#include "common/view/sheet_grid.h"

namespace slabstream {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr double kMaxMicroseconds = 1e15, kMaxBytes = 1e18;
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

// Reads values of one object; the first thing that is wrong is kept.
class Reader {
 public:
  Reader(const Json& json, std::string place, Status& failure) : json_(json), place_(std::move(place)), failure_(failure) {
    if (!json.is_object()) Fail(fmt::format("{} is no object", place_));
  }

  double Number(const char* key, double min, double max) {
    const Json* value = Find(key);
    if (value == nullptr || !value->is_number()) {
      Fail(fmt::format("{}.{} is no number", place_, key));
      return min;
    }
    return InRangeOr(key, value->get<double>(), min, max);
  }

  std::string Text(const char* key) {
    const Json* value = Find(key);
    if (value != nullptr && value->is_string()) return value->get<std::string>();
    Fail(fmt::format("{}.{} is no text", place_, key));
    return {};
  }

  // `count` integers, or any number of elements if `count` is 0.
  const Json& List(const char* key, std::size_t count) {
    static const Json kEmpty = Json::array();
    const Json* value = Find(key);
    if (value == nullptr || !value->is_array() || (count > 0 && value->size() != count)) {
      Fail(count > 0 ? fmt::format("{}.{} is no list of {} numbers", place_, key, count) : fmt::format("{}.{} is no list", place_, key));
      return kEmpty;
    }
    return *value;
  }

  std::int32_t Pixel(const char* key, const Json& value) {
    if (value.is_number_integer()) return std::int32_t(InRangeOr(key, value.get<double>(), 0, kMaxGridSide));
    Fail(fmt::format("{}.{} holds what is no whole number", place_, key));
    return 0;
  }

  void Fail(std::string why) {
    if (failure_.ok()) failure_ = Status::InvalidArgument("the trace: " + std::move(why));
  }
  bool ok() const { return failure_.ok(); }

 private:
  const Json* Find(const char* key) const {
    const auto found = json_.is_object() ? json_.find(key) : json_.end();
    return found == json_.end() ? nullptr : &*found;
  }
  double InRangeOr(const char* key, double value, double min, double max) {
    if (const Status status = InRange(fmt::format("{}.{}", place_, key), value, min, max); !status.ok()) {
      Fail(status.message());
      return min;
    }
    return value;
  }

  const Json& json_;
  const std::string place_;
  Status& failure_;
};

RecordedRank ReadRank(const Json& json, const std::string& place, const PixelBounds& grid, Status& failure) {
  constexpr double kMaxId = 4294967295.0;
  Reader reader(json, place, failure);
  RecordedRank rank;
  rank.box = BoxId(reader.Number("box", 0, kMaxRecordedRanks * kMaxGroups));
  rank.worker = WorkerId(reader.Number("worker", 0, kMaxId));
  rank.render_seconds = reader.Number("render_us", 0, kMaxMicroseconds) * 1e-6;
  if (const Json& bounds = reader.List("bounds", 4); !bounds.empty()) {
    rank.bounds = {reader.Pixel("bounds", bounds[0]), reader.Pixel("bounds", bounds[1]), reader.Pixel("bounds", bounds[2]),
                   reader.Pixel("bounds", bounds[3])};
  }
  if (!grid.Contains(rank.bounds)) reader.Fail(place + ".bounds lie outside the grid");
  rank.pixels = reader.Number("pixels", 0, double(std::max<std::int64_t>(rank.bounds.pixel_count(), 0)));
  return rank;
}

RecordedFrame ReadFrame(const Json& json, const std::string& place, Status& failure) {
  Reader reader(json, place, failure);
  RecordedFrame frame;
  const std::string renderer = reader.Text("renderer");
  if (const Result<const RendererKind*> kind = RequireRenderer(renderer); kind.ok()) {
    frame.renderer = *kind;
  } else {
    reader.Fail(fmt::format("{}.{}", place, kind.status().message()));
  }
  if (const Json& grid = reader.List("grid", 2); !grid.empty()) {
    frame.grid = {0, 0, reader.Pixel("grid", grid[0]), reader.Pixel("grid", grid[1])};
  }
  if (frame.grid.empty()) reader.Fail(place + ".grid has no pixels");
  frame.workers = std::uint32_t(reader.Number("workers", 1, kMaxRecordedRanks));
  frame.display = WorkerId(reader.Number("display", 1, 4294967295.0));
  frame.combine = reader.Text("combine");
  if (const auto scheme = ParseCombining(frame.combine); reader.ok() && !scheme.ok()) {
    reader.Fail(fmt::format("{}.combine: {}", place, scheme.status().message()));
  }
  frame.arrived = reader.Number("arrived_us", -kMaxMicroseconds, kMaxMicroseconds) * 1e-6;
  frame.begin = reader.Number("begin_us", -kMaxMicroseconds, kMaxMicroseconds) * 1e-6;
  frame.end = reader.Number("end_us", -kMaxMicroseconds, kMaxMicroseconds) * 1e-6;
  frame.latency = reader.Number("latency_us", 0, kMaxMicroseconds) * 1e-6;
  frame.picture_seconds = reader.Number("picture_us", 0, kMaxMicroseconds) * 1e-6;
  frame.image_bytes = reader.Number("image_bytes", 0, kMaxBytes);
  frame.voxel_bytes = reader.Number("voxel_bytes", 0, kMaxBytes);

  std::size_t ranks = 0;
  for (const Json& group : reader.List("groups", 0)) {
    const std::string group_place = fmt::format("{}.groups[{}]", place, frame.groups.size());
    std::vector<RecordedRank>& recorded = frame.groups.emplace_back();
    if (!group.is_array()) reader.Fail(group_place + " is no list");
    for (const Json& rank : group) {
      if (++ranks > kMaxRecordedRanks) reader.Fail(fmt::format("{} has more than {} boxes", place, kMaxRecordedRanks));
      if (!reader.ok()) return frame;
      recorded.push_back(ReadRank(rank, fmt::format("{}[{}]", group_place, recorded.size()), frame.grid, failure));
    }
  }
  if (ranks == 0) reader.Fail(place + ".groups has no boxes");
  return frame;
}

}  // namespace

RecordedFrame Record(const FrameStatistics& statistics, const RendererKind& renderer, Duration latency) {
  RecordedFrame frame;
  frame.renderer = &renderer;
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
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return Status::InvalidArgument("the trace is no JSON");
  const auto recording = json.is_object() ? json.find(kRecordingKey) : json.end();
  if (recording == json.end()) {
    return Status::InvalidArgument("the trace holds no \"slabstream\": record it with --trace of render or turntable");
  }
  Status failure;
  Reader reader(*recording, kRecordingKey, failure);
  const double version = reader.Number("version", 0, 1e9);
  if (reader.ok() && version != kVersion) {
    reader.Fail(fmt::format("{}.version is {}, but only {} is known", kRecordingKey, version, kVersion));
  }
  std::vector<RecordedFrame> frames;
  for (const Json& frame : reader.List("frames", 0)) {
    if (!failure.ok()) break;
    frames.push_back(ReadFrame(frame, fmt::format("{}.frames[{}]", kRecordingKey, frames.size()), failure));
  }
  if (failure.ok() && frames.empty()) reader.Fail("it holds no frames");
  if (!failure.ok()) return failure;
  return frames;
}

}  // namespace slabstream
