#include "client/cli/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "client/cli/service_connection.h"
#include "client/request/json_value.h"
#include "client/request/values.h"
#include "common/view/clip.h"

namespace slabstream {
namespace {

using Points = std::vector<Vec3>;

// So many points, separated by ':'.
Result<Points> ParsePoints(const std::string& option, const std::string& text, std::size_t count) {
  const std::vector<std::string_view> parts = Split(text, ':');
  if (parts.size() != count) {
    return Status::InvalidArgument(fmt::format("{} '{}' is not {}", option, text, count == 2 ? "X,Y,Z:X,Y,Z" : "X,Y,Z:X,Y,Z:X,Y,Z"));
  }
  Points points;
  for (const std::string_view part : parts) {
    const Result<Vec3> point = ParsePoint(option, part);
    if (!point.ok()) return point.status();
    points.push_back(*point);
  }
  return points;
}

// In [0, 180]; nothing if two points are the same.
std::optional<double> AngleDegrees(const Vec3& a, const Vec3& vertex, const Vec3& b) {
  const Vec3 u = a - vertex, v = b - vertex;
  if (Length(u) == 0 || Length(v) == 0) return std::nullopt;
  return std::atan2(Length(Cross(u, v)), Dot(u, v)) * 180 / std::numbers::pi;
}

// What is measured in one dataset.
class Measurer {
 public:
  Measurer(Client& client, std::string dataset, const VolumeGeometry& geometry)
      : client_(client),
        dataset_(std::move(dataset)),
        geometry_(geometry),
        unit_(geometry.orientation.world == World::kPatient ? "mm" : "units") {}

  std::string_view unit() const { return unit_; }

  // Of points from the first to the second, by linear interpolation between voxels; null outside of the volume.
  Result<Json> Profile(const Vec3& from, const Vec3& to, int samples) {
    const double length = Length(to - from), least = std::min({geometry_.spacing.x, geometry_.spacing.y, geometry_.spacing.z});
    if (samples == 0) samples = int(std::clamp(std::ceil(length / least) + 1, 2.0, double(kMaxProfileSamples)));
    std::vector<Vec3> corners;  // eight a sample, in data space
    const auto at = [&](int i) { return from + (double(i) / (samples - 1)) * (to - from); };
    for (int i = 0; i < samples; ++i) {
      const Vec3 p = DataSpace(at(i));
      for (int corner = 0; corner < 8; ++corner) {
        Vec3 voxel;
        for (const Axis axis : kAxes) {
          voxel[axis] = std::clamp(std::floor(p[axis]) + (corner >> Number(axis) & 1), 0.0, double(geometry_.size[axis] - 1));
        }
        corners.push_back(voxel);
      }
    }
    const Result<std::vector<double>> values = ValuesAt(corners);
    if (!values.ok()) return values.status();
    Json found = Json::array();
    for (int i = 0; i < samples; ++i) {
      const Vec3 p = DataSpace(at(i));
      double value = 0;
      for (int corner = 0; corner < 8; ++corner) {
        double share = 1;
        for (const Axis axis : kAxes) {
          const double fraction = p[axis] - std::floor(p[axis]);
          share *= (corner >> Number(axis) & 1) != 0 ? fraction : 1 - fraction;
        }
        if (share > 0) value += share * (*values)[std::size_t(8 * i + corner)];
      }
      const Json shown = Inside(p) && std::isfinite(value) ? Json(value) : Json(nullptr);
      found.push_back({{"distance", length * i / (samples - 1)}, {"at", VectorJson(at(i))}, {"value", shown}});
    }
    return Json({{"profile", {VectorJson(from), VectorJson(to)}}, {"unit", unit_}, {"samples", std::move(found)}});
  }

  // Of the voxels whose centres lie in the box.
  Result<Json> Statistics(const ClipBox& box, const std::string& text) {
    const Result<ClipRegion> region = MakeClipRegion({.box = box, .slab = {}, .planes = {}}, geometry_);
    if (!region.ok()) return region.status();
    std::int64_t count = 0, finite = 0;
    double sum = 0, squares = 0, shift = 0, least = std::numeric_limits<double>::infinity(), most = -least;
    std::vector<Vec3> voxels;
    const auto add = [&]() -> Status {
      const Result<std::vector<double>> values = ValuesAt(voxels);
      if (!values.ok()) return values.status();
      for (const double value : *values) {
        if (!std::isfinite(value)) continue;
        if (finite++ == 0) shift = value;  // keeps the sum of squares from cancelling
        sum += value - shift;
        squares += (value - shift) * (value - shift);
        least = std::min(least, value);
        most = std::max(most, value);
      }
      voxels.clear();
      return Status::Ok();
    };
    const auto [begin, end] = Around(box);
    if (const double most_voxels = double(end.x - begin.x) * double(end.y - begin.y) * double(end.z - begin.z);
        most_voxels > double(kMaxMeasuredVoxels)) {
      return Status::InvalidArgument(
          fmt::format("--box '{}' has up to {:.0f} voxels, at most {} are measured", text, most_voxels, kMaxMeasuredVoxels));
    }
    for (std::int32_t z = begin.z; z < end.z; ++z) {
      for (std::int32_t y = begin.y; y < end.y; ++y) {
        for (std::int32_t x = begin.x; x < end.x; ++x) {
          const Vec3 voxel = {double(x), double(y), double(z)};
          if (!region->Keeps(voxel)) continue;
          ++count;
          voxels.push_back(voxel);
          if (voxels.size() < kMaxSamplePoints) continue;
          if (Status status = add(); !status.ok()) return status;
        }
      }
    }
    if (Status status = add(); !status.ok()) return status;
    const auto or_null = [&](double value) { return finite > 0 ? Json(value) : Json(nullptr); };
    const double mean = sum / double(finite), variance = std::max(squares / double(finite) - mean * mean, 0.0);
    const double volume = double(count) * geometry_.spacing.x * geometry_.spacing.y * geometry_.spacing.z;
    return Json({{"box", text},
                 {"voxels", count},
                 {"volume", volume},
                 {"unit", fmt::format("{}^3", unit_)},
                 {"mean", or_null(shift + mean)},
                 {"deviation", or_null(std::sqrt(variance))},
                 {"min", or_null(least)},
                 {"max", or_null(most)}});
  }

 private:
  Vec3 DataSpace(const Vec3& world) const {
    return geometry_.orientation.FromWorld(world - geometry_.orientation.origin) / geometry_.spacing;
  }
  bool Inside(const Vec3& p) const {
    return std::ranges::all_of(kAxes, [&](Axis axis) { return p[axis] >= -0.5 && p[axis] <= double(geometry_.size[axis]) - 0.5; });
  }

  // Voxels outside of this are not in the box.
  Box Around(const ClipBox& box) const {
    Vec3 low = ToVec3(geometry_.size), high = {-1, -1, -1};
    for (int corner = 0; corner < 8; ++corner) {
      Vec3 p;
      for (const Axis axis : kAxes) {
        const double bound = (corner >> Number(axis) & 1) != 0 ? box.high[axis] : box.low[axis];
        p[axis] = box.unit == ClipUnit::kPercent && std::abs(bound) < kMaxWorldCoordinate ? bound / 100 * geometry_.size[axis] : bound;
      }
      if (box.unit == ClipUnit::kWorld) p = DataSpace(p);
      for (const Axis axis : kAxes) {
        low[axis] = std::min(low[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
      }
    }
    Box around;
    for (const Axis axis : kAxes) {
      around.begin[axis] = std::int32_t(std::clamp(std::floor(low[axis]) - 1, 0.0, double(geometry_.size[axis])));
      around.end[axis] = std::int32_t(std::clamp(std::ceil(high[axis]) + 2, double(around.begin[axis]), double(geometry_.size[axis])));
    }
    return around;
  }

  // Of voxels; NaN where there is no finite value.
  Result<std::vector<double>> ValuesAt(const std::vector<Vec3>& voxels) {
    std::vector<double> values;
    for (std::size_t begin = 0; begin < voxels.size(); begin += kMaxSamplePoints) {
      Points points;
      for (std::size_t i = begin; i < std::min(begin + kMaxSamplePoints, voxels.size()); ++i)
        points.push_back(geometry_.ToWorld(voxels[i]));
      const Result<std::vector<VolumeSample>> samples = client_.SampleAt(dataset_, std::move(points));
      if (!samples.ok()) return samples.status();
      for (const VolumeSample& sample : *samples) values.push_back(sample.value.value_or(std::numeric_limits<double>::quiet_NaN()));
    }
    return values;
  }

  Client& client_;
  const std::string dataset_;
  const VolumeGeometry geometry_;
  const std::string_view unit_;
};

std::string NumberText(const Json& value) { return value.is_null() ? "none" : fmt::format("{:.6g}", value.get<double>()); }

void Print(const Json& measures) {
  for (const Json& m : measures) {
    if (m.contains("distance")) {
      std::cout << fmt::format("distance {:.6g} {}\n", m["length"].get<double>(), m["unit"].get<std::string>());
    } else if (m.contains("angle")) {
      std::cout << fmt::format("angle {:.6g} degrees\n", m["degrees"].get<double>());
    } else if (m.contains("profile")) {
      std::cout << fmt::format("profile: distance in {}, value\n", m["unit"].get<std::string>());
      for (const Json& sample : m["samples"]) {
        std::cout << fmt::format("{:>12.6g} {:>12}\n", sample["distance"].get<double>(), NumberText(sample["value"]));
      }
    } else {
      std::cout << fmt::format("box {}: mean {}, deviation {}, min {}, max {}, {} voxels, {:.6g} {}\n", m["box"].get<std::string>(),
                               NumberText(m["mean"]), NumberText(m["deviation"]), NumberText(m["min"]), NumberText(m["max"]),
                               m["voxels"].get<std::int64_t>(), m["volume"].get<double>(), m["unit"].get<std::string>());
    }
  }
}

// What the texts say, before anything is connected.
struct Measures {
  std::vector<Points> distances, angles, profiles;
  std::vector<ClipBox> boxes;
};

Result<Measures> Parse(const MeasureOptions& options) {
  Measures measures;
  Status status;
  const auto take = [&](const char* option, const std::vector<std::string>& texts, std::size_t count, std::vector<Points>& into) {
    for (const std::string& text : texts) {
      Result<Points> points = ParsePoints(option, text, count);
      if (!points.ok()) return void(status = points.status());
      into.push_back(*std::move(points));
    }
  };
  take("--distance", options.distances, 2, measures.distances);
  if (status.ok()) take("--angle", options.angles, 3, measures.angles);
  if (status.ok()) take("--profile", options.profiles, 2, measures.profiles);
  if (!status.ok()) return status;
  for (const Points& p : measures.angles) {
    if (!AngleDegrees(p[0], p[1], p[2])) return Status::InvalidArgument("--angle: two of its points are the same, so there is no angle");
  }
  for (const std::string& text : options.boxes) {
    const Result<ClipBox> box = ParseClipBox("--box", text);
    if (!box.ok()) return box.status();
    measures.boxes.push_back(*box);
  }
  if (measures.distances.empty() && measures.angles.empty() && measures.profiles.empty() && measures.boxes.empty()) {
    return Status::InvalidArgument("--distance, --angle, --profile or --box must say what to measure");
  }
  return measures;
}

}  // namespace

Status RunMeasure(const MeasureOptions& options) {
  const Result<Measures> measures = Parse(options);
  if (!measures.ok()) return measures.status();
  Result<ServiceConnection> connection = ServiceConnection::Open(options.connection, options.source);
  if (!connection.ok()) return connection.status();
  const Result<SummaryReply> summary = connection->client().Summarize(connection->dataset());
  if (!summary.ok()) return summary.status();
  Measurer measurer(connection->client(), connection->dataset(), summary->description.geometry);
  Json found = Json::array();
  for (const Points& p : measures->distances) {
    found.push_back({{"distance", {VectorJson(p[0]), VectorJson(p[1])}}, {"length", Length(p[1] - p[0])}, {"unit", measurer.unit()}});
  }
  for (const Points& p : measures->angles) {
    found.push_back({{"angle", {VectorJson(p[0]), VectorJson(p[1]), VectorJson(p[2])}}, {"degrees", *AngleDegrees(p[0], p[1], p[2])}});
  }
  for (const Points& p : measures->profiles) {
    Result<Json> profile = measurer.Profile(p[0], p[1], options.samples);
    if (!profile.ok()) return profile.status();
    found.push_back(*std::move(profile));
  }
  for (std::size_t i = 0; i < measures->boxes.size(); ++i) {
    Result<Json> box = measurer.Statistics(measures->boxes[i], options.boxes[i]);
    if (!box.ok()) return box.status();
    found.push_back(*std::move(box));
  }
  if (options.json) {
    std::cout << found.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    Print(found);
  }
  return Status::Ok();
}

}  // namespace slabstream
