// `data` and `steer`: the datasets of a running service, and the simulations that hold them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/report/dataset_text.h"
#include "client/request/values.h"
#include "common/json/json.h"
#include "data/catalogue/catalogue.h"

namespace slabstream {
namespace {

Status CheckItem(DataAction action, const std::string& item) {
  if (action != DataAction::kAdd) {
    if (item.empty() || item.size() > kMaxDataItemBytes) {
      return Status::InvalidArgument(fmt::format("NAME has {} bytes, must have 1 to {}", item.size(), kMaxDataItemBytes));
    }
    return Status::Ok();
  }
  const Result<DataArgument> data = ParseDataArgument(item);
  if (!data.ok()) return data.status();
  if (const std::string* path = data->RelativePath(); path != nullptr) {
    std::error_code error;
    const std::string here = std::filesystem::absolute(*path, error).lexically_normal().string();
    return Status::InvalidArgument(fmt::format(
        "{}: the path must be absolute, since it is a path on the coordinator's host; on this host it would be {}", item, here));
  }
  return Status::Ok();
}

}  // namespace

Status RunData(const DataOptions& options) {
  const DataOrder& order = options.order;
  if (order.items.size() > kMaxDataItems) {
    return Status::InvalidArgument(fmt::format("{} datasets at a time, at most {} can be named", order.items.size(), kMaxDataItems));
  }
  for (const std::string& item : order.items) {
    if (Status status = CheckItem(order.action, item); !status.ok()) return status;
  }
  Result<ServiceConnection> connection = ServiceConnection::OpenService(options.service);
  if (!connection.ok()) return connection.status();
  const Result<std::vector<DatasetStatus>> datasets = connection->client().OrderData(order);
  if (!datasets.ok()) return datasets.status();
  std::cout << (options.json ? DatasetsJson(*datasets).dump(2) + "\n" : DatasetTableText(*datasets));
  return Status::Ok();
}

Status RunSteer(const SteerOptions& options) {
  SteerDataset order = options.order;
  if (!options.values.empty()) {
    Result<std::vector<SteeredValue>> values = ParseSteeredValues("steer", fmt::format("{}", fmt::join(options.values, ",")));
    if (!values.ok()) return values.status();
    order.values = *std::move(values);
  }
  Result<ServiceConnection> connection = ServiceConnection::OpenService(options.service);
  if (!connection.ok()) return connection.status();
  const Result<SimulationStatus> simulation = connection->client().Steer(std::move(order));
  if (!simulation.ok()) return simulation.status();
  std::cout << (options.json ? SimulationJson(*simulation).dump(2) + "\n" : SimulationText(*simulation));
  return Status::Ok();
}

}  // namespace slabstream
