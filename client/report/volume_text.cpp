#include "client/report/volume_text.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "common/base/printable.h"
#include "common/view/picture_geometry.h"
#include "common/volume/exact_value.h"

namespace slabstream {
namespace {

Json Vector(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }
Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

// A data value that is a whole number of at most 64 bits.
std::optional<Int128> WholeValue(const std::optional<double>& value, std::int64_t rest) {
  constexpr double kEnd = 0x1p64;
  if (!value || std::abs(*value) > kEnd || std::trunc(*value) != *value) return std::nullopt;
  return Int128(*value) + rest;
}

// A whole number is one in JSON, too.
Json ValueJson(const std::optional<double>& value, std::int64_t rest) {
  const std::optional<Int128> whole = WholeValue(value, rest);
  if (whole && *whole >= 0 && *whole <= std::numeric_limits<std::uint64_t>::max()) return std::uint64_t(*whole);
  if (whole && *whole < 0 && *whole >= std::numeric_limits<std::int64_t>::min()) return std::int64_t(*whole);
  return OrNull(value);
}

std::string TextOfValue(const VolumeSample& sample) {
  if (!sample.value) return "value not finite";
  if (const std::optional<Int128> whole = WholeValue(sample.value, sample.rest)) return fmt::format("value {}", *whole);
  return "value " + ValueText(*sample.value);
}

std::uint64_t AllVoxels(const BoxStatistics& box) { return box.voxels + box.non_finite; }

std::string Quoted(const std::string& field) {
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  std::string quoted = "\"";
  for (const char c : field) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace

std::string ValueText(double value) {
  constexpr double kEnd = 0x1p64;
  if (std::abs(value) <= kEnd && std::trunc(value) == value) return fmt::format("{}", Int128(value));
  const auto single = float(value);
  return double(single) == value ? fmt::format("{}", single) : fmt::format("{}", value);
}

Json HistogramJson(const std::string& dataset, const SummaryReply& summary) {
  Json percentiles = Json::object();
  for (const Percentile& each : summary.percentiles) percentiles[fmt::format("{:g}", each.percent)] = each.value;
  return {{"dataset", dataset},
          {"range", {summary.range.min, summary.range.max}},
          {"counts", summary.histogram},
          {"non_finite", summary.non_finite},
          {"percentiles", std::move(percentiles)}};
}

Json JointHistogramJson(const std::string& dataset, const JointHistogramReply& reply) {
  return {{"dataset", dataset},
          {"range", {reply.range.min, reply.range.max}},
          {"steepest", reply.histogram.steepest},
          {"values", kJointValues},
          {"slopes", kJointSlopes},
          {"counts", reply.histogram.counts}};
}

std::string ColorText(const std::array<float, 3>& color) {
  const auto byte = [](float channel) { return int(std::lround(255 * channel)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color[0]), byte(color[1]), byte(color[2]));
}

Json LabelJson(const Label& label) { return {{"value", label.value}, {"name", label.name}, {"color", ColorText(label.color)}}; }

Json LabelsJson(const std::string& dataset, const SummaryReply& summary) {
  Json labels = Json::array();
  for (const Label& label : summary.labels) labels.push_back(LabelJson(label));
  return {{"dataset", dataset}, {"labels", std::move(labels)}, {"complete", summary.all_labels}};
}

Json SampleJson(const VolumeSample& sample) {
  Json json = {{"at", Vector(sample.at)}, {"inside", sample.inside}, {"voxel", nullptr}, {"value", nullptr}};
  if (!sample.inside) return json;
  json["voxel"] = {sample.voxel.x, sample.voxel.y, sample.voxel.z};
  json["value"] = ValueJson(sample.value, sample.rest);
  if (sample.label) json["label"] = {{"value", sample.label->value}, {"name", sample.label->name}};
  json["fields"] = Json::array();
  for (const FieldSample& field : sample.fields) json["fields"].push_back({{"name", field.name}, {"value", ValueJson(field.value, 0)}});
  json["interpolated"] = OrNull(sample.interpolated);
  return json;
}

Json ProfileJson(const std::vector<VolumeSample>& samples) {
  Json values = Json::array();
  for (const VolumeSample& sample : samples) values.push_back(OrNull(sample.interpolated));
  const Vec3 from = samples.front().at, to = samples.back().at;
  return {{"from", Vector(from)}, {"to", Vector(to)}, {"length", Length(to - from)}, {"values", std::move(values)}};
}

Json BoxStatisticsJson(const BoxStatistics& box) {
  const auto known = [&](double value) { return box.voxels > 0 ? Json(value) : Json(nullptr); };
  return {{"voxels", box.voxels},      {"non_finite", box.non_finite}, {"mean", known(box.mean)}, {"deviation", known(box.deviation)},
          {"least", known(box.least)}, {"largest", known(box.largest)}};
}

VoxelMeasure MeasureOf(const VolumeGeometry& geometry) {
  const Vec3& spacing = geometry.spacing;
  const double cubed = spacing.x * spacing.y * spacing.z;
  const LengthUnit unit = UnitOf(geometry);
  switch (unit) {
    case LengthUnit::kMillimetre: return {"ml", cubed / 1000};
    case LengthUnit::kCentimetre: return {"ml", cubed};
    case LengthUnit::kMetre: return {"ml", cubed * 1e6};
    default: return {fmt::format("{}^3", PluralOf(unit)), cubed};
  }
}

Json LabelStatisticsJson(const StatisticsReply& reply) {
  const VoxelMeasure measure = MeasureOf(reply.description.geometry);
  Json labels = Json::array();
  for (const auto& [label, box] : reply.labels) {
    Json of_label = LabelJson(label);
    of_label["volume"] = double(AllVoxels(box)) * measure.volume;
    of_label.update(BoxStatisticsJson(box));
    labels.push_back(std::move(of_label));
  }
  return {{"unit", measure.unit}, {"labels", std::move(labels)}};
}

std::string LabelStatisticsCsv(const StatisticsReply& reply) {
  const VoxelMeasure measure = MeasureOf(reply.description.geometry);
  std::string text = fmt::format("value,name,volume ({}),voxels,non_finite,mean,deviation,least,largest\r\n", measure.unit);
  for (const auto& [label, box] : reply.labels) {
    text +=
        fmt::format("{},{},{},{},{}", label.value, Quoted(label.name), double(AllVoxels(box)) * measure.volume, box.voxels, box.non_finite);
    text += box.voxels == 0 ? ",,,," : fmt::format(",{},{},{},{}", box.mean, box.deviation, ValueText(box.least), ValueText(box.largest));
    text += "\r\n";
  }
  return text;
}

std::string LabelStatisticsText(const StatisticsReply& reply) {
  const VoxelMeasure measure = MeasureOf(reply.description.geometry);
  constexpr const char* kRow = "{:>8}  {:>12}  {:>10}  {:>12}  {:>12}  {:>12}  {:>12}  {}\n";
  std::string text = fmt::format(fmt::runtime(kRow), "label", measure.unit, "voxels", "mean", "deviation", "least", "largest", "name");
  for (const auto& [label, box] : reply.labels) {
    const auto known = [&](std::string number) { return box.voxels > 0 ? std::move(number) : std::string("none"); };
    text += fmt::format(fmt::runtime(kRow), label.value, fmt::format("{:.6g}", double(AllVoxels(box)) * measure.volume), AllVoxels(box),
                        known(fmt::format("{:.6g}", box.mean)), known(fmt::format("{:.6g}", box.deviation)), known(ValueText(box.least)),
                        known(ValueText(box.largest)), Printable(label.name));
  }
  return text;
}

Json PickJson(const PickReply& picked, const FrameRequest& frame) {
  Json json = {{"hit", picked.sample.has_value()}};
  if (!picked.sample) return json;
  json["depth"] = picked.depth;
  json.update(SampleJson(*picked.sample));
  if (!picked.shape) return json;
  json["shape"] = *picked.shape < frame.shapes.size() ? frame.shapes[*picked.shape].shape : "plane";
  json["shape_number"] = *picked.shape;
  json["shape_value"] = OrNull(picked.value);
  return json;
}

std::string SampleText(const VolumeSample& sample) {
  std::string text = fmt::format("{} {} {}", ValueText(sample.at.x), ValueText(sample.at.y), ValueText(sample.at.z));
  if (!sample.inside) return text + "  outside the volume";
  text += fmt::format("  voxel {} {} {}", sample.voxel.x, sample.voxel.y, sample.voxel.z);
  text += "  " + TextOfValue(sample);
  if (sample.label)
    text += fmt::format("  label {}{}{}", sample.label->value, sample.label->name.empty() ? "" : " ", Printable(sample.label->name));
  for (std::size_t i = 1; i < sample.fields.size(); ++i) {
    const FieldSample& field = sample.fields[i];
    text += fmt::format("  {} {}", Printable(field.name), field.value ? ValueText(*field.value) : "none");
  }
  return text;
}

}  // namespace slabstream
