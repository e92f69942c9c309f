// The text format of Prometheus (https://prometheus.io/docs/instrumenting/exposition_formats/), the only place that writes it.
//
//   Exposition out;
//   out.Single("frames_total", MetricType::kCounter, "Frames that were made.", frames);
//   out.Family("bytes_total", MetricType::kCounter, "Bytes by plane.");
//   out.Value(voxel_bytes, {{"plane", "voxels"}});
//
// Every name begins with "slabstream_", which Exposition adds. Units are seconds and bytes; counters end in "_total". Labels take few,
// fixed values: no name of a client, dataset or file is one.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/time.h"

namespace slabstream {

enum class MetricType : std::uint8_t { kCounter, kGauge, kHistogram };

// How often a time was how long.
class TimeHistogram {
 public:
  static constexpr std::array<double, 13> kBounds = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10};  // seconds

  void Add(Duration time);

 private:
  friend class Exposition;
  std::array<std::uint64_t, kBounds.size()> counts_{};  // how many times are at most each bound
  std::uint64_t count_ = 0;
  double seconds_ = 0;
};

class Exposition {
 public:
  using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

  // The values that follow are this family's. `name` without "slabstream_".
  void Family(std::string_view name, MetricType type, std::string_view help);
  void Value(double value, Labels labels = {});
  void Value(std::uint64_t value, Labels labels = {});
  void Histogram(const TimeHistogram& histogram, Labels labels = {});
  // A family of one value.
  template <class T>
  void Single(std::string_view name, MetricType type, std::string_view help, T value) {
    Family(name, type, help);
    Value(value);
  }
  std::string Take() { return std::move(text_); }

 private:
  void Line(std::string_view suffix, Labels labels, std::string_view bound, std::string_view value);

  std::string name_, text_;
};

}  // namespace slabstream
