// `value`: what a dataset or a file holds at points of its world.
#include <fmt/format.h>

#include <iostream>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/report/volume_text.h"
#include "client/request/values.h"
#include "common/json/json.h"

namespace slabstream {

Status RunValue(const ValueOptions& options) {
  if (options.points.size() > kMaxSamplePoints) {
    return Status::InvalidArgument(fmt::format("--at is given {} times, at most {} are taken", options.points.size(), kMaxSamplePoints));
  }
  std::vector<Vec3> points;
  for (const std::string& text : options.points) {
    const Result<Vec3> point = ParsePoint("--at", text);
    if (!point.ok()) return point.status();
    points.push_back(*point);
  }
  const std::string& names = options.volume.field;
  Result<std::vector<std::string>> channels = names.empty() ? std::vector<std::string>() : ParseNames("--channel", names);
  if (!channels.ok()) return channels.status();
  Result<ServiceConnection> connection = ServiceConnection::Open(options.volume.connection, options.volume.source, options.layers);
  if (!connection.ok()) return connection.status();
  const Result<std::vector<VolumeSample>> samples = connection->client().SampleAt(
      {.dataset = connection->dataset(), .points = std::move(points), .channels = *std::move(channels), .time = options.volume.time});
  if (!samples.ok()) return samples.status();
  Json json = Json::array();
  for (const VolumeSample& sample : *samples) {
    if (options.json) {
      json.push_back(SampleJson(sample));
    } else {
      std::cout << SampleText(sample) << "\n";
    }
  }
  if (options.json) std::cout << json.dump(2) << "\n";
  return Status::Ok();
}

}  // namespace slabstream
