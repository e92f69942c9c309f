#include "laboratory/results/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/files/files.h"
#include "laboratory/results/columns.h"

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
