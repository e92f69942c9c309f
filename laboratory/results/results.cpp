#include "laboratory/results/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/files/files.h"

namespace slabstream {
namespace {

constexpr double kWide = 1.25;  // high over low

// RFC 4180. A list becomes a text with spaces.
std::string Field(const Json& value) {
  if (value.is_null()) return "";
  if (value.is_array()) {
    std::string text;
    for (const Json& entry : value) text += (text.empty() ? "" : " ") + entry.dump();
    return text;
  }
  if (!value.is_string()) return value.dump();
  const auto& text = value.text();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

template <class Names>
std::string Csv(const Names& names, const std::vector<Json>& rows) {
  std::string csv;
  for (const auto& name : names) csv += fmt::format("{}{}", csv.empty() ? "" : ",", name);
  csv += '\n';
  for (const Json& row : rows) {
    std::string line;
    for (const auto& name : names) line += Field(row.value(std::string(name), Json())) + ',';
    line.back() = '\n';
    csv += line;
  }
  return csv;
}

std::string NoiseOf(const Estimate& value) {
  if (value.two_modes) return "two modes";
  return value.low > 0 && value.high > kWide * value.low ? "wide" : "";
}

}  // namespace

std::span<const Column> CaseColumns() {
  static constexpr Column kColumns[] = {
      {"part", "part of the experiment that asked for the value"},
      {"volume", "dataset: class1-200, brain"},
      {"n", "voxels along the longest side"},
      {"occupancy", "share of voxels that are occupied in a volume that is made for experiments, in [0, 1]"},
      {"workers", "p, the number of workers"},
      {"view", "name or angles of the view; the name of a path"},
      {"pixels", "pixels along the shorter side of the picture"},
      {"renderer", "as for --renderer"},
      {"decomposition", "as for --decomposition"},
      {"axis", "as for --axis"},
      {"balance_by", "what boxes are made equal by, as for --balance-by"},
      {"assignment", "as for --assignment"},
      {"balance", "as for --balance"},
      {"combine", "combining scheme, as for --combine"},
      {"groups", "groups of a frame"},
      {"teams", "teams of workers that take frames in turn, as for --teams"},
      {"link", "what joins the workers: a name of docs/simulation.md, NAME:MICROSECONDS,GBIT, or paper: the machine of the paper"},
      {"share", "of a core and of the link that a host of a time-dilated cluster has, in (0, 1]; times are multiplied by it"},
      {"variant", "what else distinguishes the case, in words"},
      {"stage", "stage of a frame: transform, splat, combine; or a phase of what `variant` names"},
      {"active", "share of an image's pixels that are not empty, in [0, 1]"},
      {"k", "diameter of a splat's footprint in pixels"},
  };
  return kColumns;
}

std::span<const Column> RunColumns() {
  static constexpr Column kColumns[] = {
      {"version", "of this format: 1"},
      {"experiment", "name of the experiment"},
  };
  return kColumns;
}

std::span<const Column> ValueColumns() {
  static constexpr Column kColumns[] = {
      {"metric", "what the value is, from the list of metrics"},
      {"unit", "of value, low and high"},
      {"value", "median of the repeats"},
      {"low", "lower end of the interval of the median: 95 % confidence from six repeats on, else the smallest value"},
      {"high", "upper end"},
      {"repeats", "how often it was found; 0: printed in the paper or counted"},
      {"noise", "empty, 'wide' (high above 1.25 low) or 'two modes' (the repeats fall into two heaps)"},
      {"origin", "measured, simulated or paper"},
      {"commit", "of the program; '-dirty' if its sources were changed"},
      {"machine", "processor, cores, instruction set"},
      {"each", "the repeats in their order: repeat i of one case is compared with repeat i of another"},
  };
  return kColumns;
}

std::span<const Metric> Metrics() {
  static constexpr Metric kMetrics[] = {
      {"latency", "s", "from the request of a frame to its picture, one frame in flight"},
      {"preview", "s", "from the request of a frame until its nearest group can be shown"},
      {"period", "s", "from picture to picture, with as many frames requested ahead as keep all workers busy"},
      {"imbalance", "1", "longest over mean render time of the workers"},
      {"idle_share", "1", "share of the workers' time in a frame in which they do nothing"},
      {"image_bytes", "B", "pixels that workers send to each other for a frame"},
      {"plan_time", "s", "to plan a frame whose boxes stand"},
      {"assignment_time", "s", "to encode the message that tells the workers of a group their parts"},
      {"hearing_time", "s", "to decode it, at each worker"},
      {"assignment_bytes", "B", "that message, to one worker"},
      {"hand_out_time", "s", "the coordinator's time for a frame: it plans, encodes, and sends to one worker after the other"},
      {"voxel_bytes", "B", "voxels that workers receive for a frame beyond those that they hold"},
      {"move_share", "1",
       "share of a path's time in which workers fetch voxels: of the one that receives most, over that and its rendering"},
      {"settling_frames", "1",
       "frames from the change in the middle of a path until the longest render time is within a tenth of its last"},
      {"memory", "B", "voxels that the fullest worker must hold"},
      {"render_time", "s", "render time of a frame, summed over its boxes"},
      {"longest_render_time", "s", "render time of the worker that has most to render"},
      {"stage_time", "s", "time of a stage, of the worker that renders longest"},
      {"picture_time", "s", "to make and encode the picture of a frame"},
      {"combine_time", "s", "from the end of the longest rendering until one worker holds the combined image"},
      {"frame_time", "s", "until one worker holds the combined image: what the paper calls the time of a frame"},
      {"run_time", "s", "processor time of one thread for what `variant` names"},
      {"error", "1", "relative error against what `variant` names"},
      {"offset", "1", "largest distance of a computed coordinate from the exact one, in pixels"},
      {"additions", "1", "floating-point additions, counted"},
      {"products", "1", "floating-point multiplications, counted"},
      {"constant", "s", "time a unit of work, as the paper's tables 3 and 4 name it"},
      {"grain", "1", "(N^3/p)/I^2: voxels of a worker over pixels of an image that it sends"},
      {"count", "1", "how many of what `variant` names"},
      {"other_load", "1", "share of the machine's processor time that other programs took during a trial"},
      {"drift", "1", "time of a fixed loop at a round of repeats, over its time before the first"},
  };
  return kMetrics;
}

std::string_view ToString(Origin origin) {
  constexpr std::array<std::string_view, 3> kNames = {"measured", "simulated", "paper"};
  return kNames.at(std::size_t(origin));
}

void Results::Add(const Json& of, std::string_view metric, const Estimate& value, Origin origin, const std::vector<double>& each) {
  if (!std::isfinite(value.median)) return;
  const auto found = std::ranges::find(Metrics(), metric, &Metric::name);
  CHECK(found != Metrics().end()) << metric;
  for (const auto& [name, held] : of.items()) {
    CHECK(std::ranges::find(CaseColumns(), name, &Column::name) != CaseColumns().end()) << name;
  }
  CHECK(known_.insert(fmt::format("{} {} {}", of.dump(), metric, ToString(origin))).second) << metric << " of " << of.dump();

  Json& row = rows_.emplace_back(Json{{"version", kResultsVersion}, {"experiment", by_.experiment}});
  row.update(of);
  row.update(Json{{"metric", metric},
                  {"unit", found->unit},
                  {"value", value.median},
                  {"low", value.low},
                  {"high", value.high},
                  {"repeats", value.count},
                  {"noise", NoiseOf(value)},
                  {"origin", ToString(origin)},
                  {"commit", by_.commit},
                  {"machine", by_.machine}});
  if (!each.empty()) row["each"] = each;
}

Status Results::Write(const std::string& folder) const {
  std::string lines;
  for (const Json& row : rows_) lines += row.dump() + '\n';
  if (Status status = WriteTextFile(folder + "/results.jsonl", lines); !status.ok()) return status;
  std::vector<std::string_view> names;
  for (const auto& columns : {RunColumns(), CaseColumns(), ValueColumns()}) {
    for (const Column& column : columns) names.push_back(column.name);
  }
  for (const auto& [name, rows] : attached_) {
    std::vector<std::string> attached_names;
    if (!rows.empty()) {
      for (const auto& [column, value] : rows.front().items()) attached_names.push_back(column);
    }
    if (Status status = WriteTextFile(fmt::format("{}/{}.csv", folder, name), Csv(attached_names, rows)); !status.ok()) return status;
  }
  return WriteTextFile(folder + "/results.csv", Csv(names, rows_));
}

}  // namespace slabstream
