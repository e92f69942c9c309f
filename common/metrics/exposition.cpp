#include "common/metrics/exposition.h"

#include <fmt/format.h>

#include <chrono>

namespace slabstream {
namespace {

std::string_view NameOf(MetricType type) {
  switch (type) {
    case MetricType::kCounter: return "counter";
    case MetricType::kGauge: return "gauge";
    case MetricType::kHistogram: break;
  }
  return "histogram";
}

void AppendEscaped(std::string& text, std::string_view value) {
  for (const char c : value) {
    if (c == '\n') {
      text += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') text += '\\';
    text += c;
  }
}

}  // namespace

void TimeHistogram::Add(Duration time) {
  const double seconds = std::chrono::duration<double>(time).count();
  for (std::size_t i = 0; i < kBounds.size(); ++i) counts_[i] += seconds <= kBounds[i] ? 1 : 0;
  ++count_;
  seconds_ += seconds;
}

void Exposition::Family(std::string_view name, MetricType type, std::string_view help) {
  name_ = name;
  text_ += fmt::format("# HELP slabstream_{0} {1}\n# TYPE slabstream_{0} {2}\n", name, help, NameOf(type));
}

void Exposition::Value(double value, Labels labels) { Line({}, labels, {}, fmt::format("{}", value)); }
void Exposition::Value(std::uint64_t value, Labels labels) { Line({}, labels, {}, fmt::format("{}", value)); }

void Exposition::Histogram(const TimeHistogram& histogram, Labels labels) {
  for (std::size_t i = 0; i < TimeHistogram::kBounds.size(); ++i) {
    Line("_bucket", labels, fmt::format("{}", TimeHistogram::kBounds[i]), fmt::format("{}", histogram.counts_[i]));
  }
  Line("_bucket", labels, "+Inf", fmt::format("{}", histogram.count_));
  Line("_sum", labels, {}, fmt::format("{}", histogram.seconds_));
  Line("_count", labels, {}, fmt::format("{}", histogram.count_));
}

// `bound`: of a bucket; empty: it is none.
void Exposition::Line(std::string_view suffix, Labels labels, std::string_view bound, std::string_view value) {
  text_ += fmt::format("slabstream_{}{}", name_, suffix);
  char before = '{';
  const auto add = [&](std::string_view name, std::string_view label) {
    text_ += fmt::format("{}{}=\"", before, name);
    AppendEscaped(text_, label);
    text_ += '"';
    before = ',';
  };
  for (const auto& [name, label] : labels) add(name, label);
  if (!bound.empty()) add("le", bound);
  if (before == ',') text_ += '}';
  text_ += fmt::format(" {}\n", value);
}

}  // namespace slabstream
