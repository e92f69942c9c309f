// `measure`: lengths and angles in a dataset's world, values along a line, and of the voxels in a box or of each label.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/report/volume_text.h"
#include "client/request/json_value.h"
#include "client/request/values.h"
#include "common/json/json.h"
#include "common/math/points_along.h"
#include "common/view/picture_geometry.h"
#include "common/wire/client_messages.h"

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

std::string LeastOrLargest(const Json& value) { return value.is_null() ? "none" : ValueText(value.get<double>()); }
std::string NumberText(const Json& value) { return value.is_null() ? "none" : fmt::format("{:.6g}", value.get<double>()); }

void Print(const Json& measures) {
  for (const Json& m : measures) {
    const std::string measure = m["measure"].text(), unit = m.value("unit", "");
    if (measure == "distance") {
      std::cout << fmt::format("distance {:.6g} {}\n", m["length"].get<double>(), unit);
    } else if (measure == "angle") {
      std::cout << fmt::format("angle {:.6g} degrees\n", m["degrees"].get<double>());
    } else if (measure == "profile") {
      std::cout << fmt::format("profile: distance in {}, value\n", unit);
      const double step = m["length"].get<double>() / double(m["values"].size() - 1);
      for (std::size_t i = 0; i < m["values"].size(); ++i) {
        std::cout << fmt::format("{:>12.6g} {:>12}\n", step * double(i), NumberText(m["values"][i]));
      }
    } else {
      std::cout << fmt::format("box {}: mean {}, deviation {}, least {}, largest {}, {} voxels, {:.6g} {}\n", m["box"].get<std::string>(),
                               NumberText(m["mean"]), NumberText(m["deviation"]), LeastOrLargest(m["least"]), LeastOrLargest(m["largest"]),
                               m["voxels"].get<std::uint64_t>(), m["volume"].get<double>(), unit);
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
  const bool labels_alone = measures.distances.empty() && measures.angles.empty() && measures.profiles.empty() && measures.boxes.empty();
  if (labels_alone && !options.labels) {
    return Status::InvalidArgument("--distance, --angle, --profile, --box or --labels must say what to measure");
  }
  if (options.csv && !(labels_alone && options.labels)) {
    return Status::InvalidArgument("--csv is the table of --labels, without any other measure; --json writes all of them");
  }
  return measures;
}

// What is measured in one dataset, as a list in JSON; not its labels.
Result<Json> Measure(Client& client, const std::string& dataset, const VolumeGeometry& geometry, const MeasureOptions& options,
                     const Measures& measures) {
  const std::string &field = options.volume.field, &time = options.volume.time;
  const auto channels = field.empty() ? std::vector<std::string>() : std::vector{field};
  const Vec3 spacing = geometry.spacing;
  const std::string_view unit = PluralOf(UnitOf(geometry));
  Json found = Json::array();
  for (const Points& p : measures.distances) {
    found.push_back(
        {{"measure", "distance"}, {"from", VectorJson(p[0])}, {"to", VectorJson(p[1])}, {"length", Length(p[1] - p[0])}, {"unit", unit}});
  }
  for (const Points& p : measures.angles) {
    found.push_back({{"measure", "angle"},
                     {"points", {VectorJson(p[0]), VectorJson(p[1]), VectorJson(p[2])}},
                     {"degrees", *AngleDegrees(p[0], p[1], p[2])}});
  }
  for (const Points& p : measures.profiles) {
    const double voxels = Length(p[1] - p[0]) / std::min({spacing.x, spacing.y, spacing.z});
    const int samples = options.samples > 0 ? options.samples : int(std::clamp(std::ceil(voxels) + 1, 2.0, double(kMaxSamplePoints)));
    const Result<std::vector<VolumeSample>> along =
        client.SampleAt({.dataset = dataset, .points = PointsAlong(p[0], p[1], samples), .channels = channels, .time = time});
    if (!along.ok()) return along.status();
    Json profile = {{"measure", "profile"}, {"unit", unit}};
    profile.update(ProfileJson(*along));
    found.push_back(std::move(profile));
  }
  for (std::size_t i = 0; i < measures.boxes.size(); ++i) {
    const Result<StatisticsReply> inside =
        client.StatisticsIn({.dataset = dataset, .box = measures.boxes[i], .field = field, .time = time});
    if (!inside.ok()) return inside.status();
    const BoxStatistics& all = inside->statistics;
    Json statistics = {{"measure", "box"}, {"box", options.boxes[i]}};
    statistics.update(BoxStatisticsJson(all));
    statistics["volume"] = double(all.voxels + all.non_finite) * spacing.x * spacing.y * spacing.z;
    statistics["unit"] = fmt::format("{}^3", unit);
    found.push_back(std::move(statistics));
  }
  return found;
}

}  // namespace

Status RunMeasure(const MeasureOptions& options) {
  const Result<Measures> measures = Parse(options);
  if (!measures.ok()) return measures.status();
  Result<ServiceConnection> connection = ServiceConnection::Open(options.volume.connection, options.volume.source, options.layers);
  if (!connection.ok()) return connection.status();
  const Result<SummaryReply> summary =
      connection->client().Summarize({.dataset = connection->dataset(), .field = options.volume.field, .time = options.volume.time});
  if (!summary.ok()) return summary.status();
  Result<Json> found = Measure(connection->client(), connection->dataset(), summary->description.geometry, options, *measures);
  if (!found.ok()) return found.status();
  StatisticsReply labels;
  if (options.labels) {
    Result<StatisticsReply> reply = connection->client().StatisticsIn({.dataset = connection->dataset(),
                                                                       .box = *ParseClipBox("--box", ":,:,:"),
                                                                       .labels = true,
                                                                       .field = options.volume.field,
                                                                       .time = options.volume.time});
    if (!reply.ok()) return reply.status();
    labels = *std::move(reply);
    Json json = {{"measure", "labels"}};
    json.update(LabelStatisticsJson(labels));
    if (options.json) found->push_back(std::move(json));
  }
  if (options.json) {
    std::cout << found->dump(2) << "\n";
  } else {
    Print(*found);
    if (options.labels) std::cout << (options.csv ? LabelStatisticsCsv(labels) : LabelStatisticsText(labels));
  }
  return Status::Ok();
}

}  // namespace slabstream
