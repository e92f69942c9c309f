#include "client/cli/service_connection.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "client/cli/cores.h"
#include "client/cli/input_volume.h"
#include "client/embedded/embedded_service.h"
#include "client/request/volume_argument.h"
#include "client/service/service_state.h"
#include "common/base/printable.h"
#include "common/cli/program.h"
#include "common/memory/large_buffers.h"
#include "common/transport/this_machine.h"
#include "common/volume/memory_budget.h"
#include "data/catalogue/shape_data.h"
#include "data/open/open_source.h"
#include "data/shapes/shape_file.h"
#include "data/stores/object_cache.h"

namespace slabstream {
namespace {

constexpr const char* kLocalDataset = "volume";

// Of a process that does everything. What it takes before it does anything counts once.
Result<MemoryShares> SharesOf(const ConnectionOptions& connection) {
  const auto workers = std::uint64_t(connection.local_workers);
  Result<MemoryShares> shares = ShareMemory(connection.local_memory, connection.local_workers);
  if (!shares.ok()) return Status(shares.status().code(), "--" + shares.status().message());
  const std::uint64_t idle = IdleMemoryBytes(shares->worker);
  shares->worker = idle + (shares->worker * workers - idle) / workers;
  return shares;
}

// Before anything is read.
Status LimitLocal(const ConnectionOptions& connection) {
  if (Status kept = KeepObjects(connection.local_cache); !kept.ok()) return kept;
  if (connection.local_memory == 0) return Status::Ok();
  const Result<MemoryShares> shares = SharesOf(connection);
  if (!shares.ok()) return shares.status();
  LimitMemory(connection.local_memory);
  SetReadMemory(connection.local_memory - shares->coordinator);
  return Status::Ok();
}

Status CheckShapeFile(const std::string& path) {
  const Result<ShapeFile> file = FindShapeFile(path);
  if (!file.ok()) return Status(file.status().code(), "--shape " + file.status().message());
  std::error_code error;
  if (!std::filesystem::exists(file->path, error)) return Status::NotFound(fmt::format("--shape {}: no such file", Printable(path)));
  if (HoldsShape(file->path)) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("--shape {} is not a mesh, lines or points: such files end in {}", Printable(path), ShapeEndings()));
}

constexpr char kHowToStart[] = "`slabstream up` starts a service, --local needs none";

}  // namespace

Status CheckDataset(const ServiceChoice& choice, const std::string& source) {
  const bool is_path = source.find('/') != std::string::npos, is_file = NamesVolumeFile(source);
  if (is_path && is_file) {
    return Status::InvalidArgument(
        fmt::format("SOURCE '{}' is a file, but a service shows datasets by their names (`slabstream data list`); --local works on files",
                    Printable(source)));
  }
  if (is_path) return Status::NotFound(fmt::format("SOURCE {}: no such file", Printable(source)));
  if (source.size() > kMaxNameBytes) {
    return Status::InvalidArgument(fmt::format("SOURCE has {} bytes, a dataset's name has at most {}", source.size(), kMaxNameBytes));
  }
  if (ResolveService(choice).status().code() != StatusCode::kUnavailable) return Status::Ok();
  const bool has_ending = source.rfind('.') != std::string::npos;
  return Status(has_ending ? StatusCode::kNotFound : StatusCode::kUnavailable,
                fmt::format("SOURCE {}: no such file, and no service runs here that could have a dataset of this name ({})",
                            Printable(source), kHowToStart));
}

ServiceConnection::ServiceConnection() = default;
ServiceConnection::ServiceConnection(ServiceConnection&&) noexcept = default;
ServiceConnection::~ServiceConnection() = default;

Result<ServiceConnection> ServiceConnection::Open(const ConnectionOptions& connection, std::span<const std::string> sources,
                                                  const LayerFiles& layers, std::span<const ShapeChoice> shapes) {
  if (connection.local_workers == 0) {
    if (connection.local_threads > 0 || connection.local_memory > 0 || connection.local_cache > 0) {
      const std::string_view option = connection.local_threads > 0 ? "threads" : connection.local_memory > 0 ? "memory" : "cache";
      return Status::InvalidArgument(fmt::format("--{} needs --local: the processes of a service have limits of their own", option));
    }
    if (layers.any()) {
      return Status::InvalidArgument(
          fmt::format("--{} needs --local: at a service layers belong to the dataset, as --data "
                      "NAME=FILE,labels=FILE,overlay=FILE says, and --label-mode or --overlay-transfer shows them",
                      layers.labels.empty() ? "overlay" : "labels"));
    }
    for (const std::string& source : sources) {
      if (Status status = CheckDataset(connection.service, source); !status.ok()) return status;
    }
    Result<ServiceConnection> opened = OpenService(connection.service);
    if (opened.ok()) opened->datasets_.assign(sources.begin(), sources.end());
    return opened;
  }
  if (Status limited = LimitLocal(connection); !limited.ok()) return limited;
  std::vector<DataSource> files;
  for (const std::string& source : sources) {
    if (Status status = CheckInputHeaders(source); !status.ok()) return status;
    files.emplace_back(source, "", layers);
  }
  if (!files.empty()) {
    if (Status status = CheckFields(files.front()); !status.ok()) return status;
  }
  for (const ShapeChoice& shape : shapes) {
    if (Status status = CheckShapeFile(shape.shape); !status.ok()) return status;
  }
  if (connection.unasked) {
    PrintNote(fmt::format("{}, so this process works on {} itself, as with --local",
                          FindState("") ? "a path is no dataset of a service" : "no service is named and none runs here",
                          Printable(sources.front())));
  }
  return OpenLocal(connection, std::move(files), shapes);
}

Result<ServiceConnection> ServiceConnection::OpenLocal(const ConnectionOptions& connection, std::vector<DataSource> sources,
                                                       std::span<const ShapeChoice> shapes) {
  ServiceConnection opened;
  opened.context_ = std::make_unique<Context>();
  EmbeddedOptions options;
  options.workers = connection.local_workers;
  for (DataSource& source : sources) {
    const std::size_t number = opened.datasets_.size();
    opened.datasets_.push_back(number == 0 ? kLocalDataset : fmt::format("{}-{}", kLocalDataset, number));
    options.coordinator.catalogue[opened.datasets_.back()] = std::move(source);
  }
  for (const ShapeChoice& shape : shapes) options.coordinator.catalogue.emplace(shape.shape, DataSource(shape.shape, ""));
  options.worker.threads = std::uint32_t(LocalThreads(connection));
  if (connection.local_memory > 0) {
    const Result<MemoryShares> shares = SharesOf(connection);
    if (!shares.ok()) return shares.status();
    options.coordinator.machine.memory_bytes = shares->coordinator;
    options.worker.memory_bytes = shares->worker;
    options.worker.spare_for_images = [limit = connection.local_memory] { return SpareForImages(limit - KeptBytes(limit) / 2); };
  }
  Result<std::unique_ptr<EmbeddedService>> service = EmbeddedService::Start(*opened.context_, std::move(options));
  if (!service.ok()) return service.status();
  opened.service_ = *std::move(service);
  Result<Client> client = opened.service_->Connect();
  if (!client.ok()) return client.status();
  opened.client_ = std::make_unique<Client>(*std::move(client));
  return opened;
}

Result<ServiceConnection> ServiceConnection::OpenService(const ServiceChoice& choice) {
  const Result<ServiceAddress> service = ResolveService(choice);
  if (!service.ok()) return service.status();
  return OpenService(*service);
}

Result<ServiceConnection> ServiceConnection::OpenRunning(const ServiceAddress& service) {
  if (NobodyListens(service.endpoint)) return Status::Unavailable(fmt::format("no service runs at {}", service.endpoint));
  return OpenService(service);
}

Result<ServiceConnection> ServiceConnection::OpenService(const ServiceAddress& service) {
  ServiceConnection connection;
  connection.context_ = std::make_unique<Context>();
  Result<Client> client = Client::Connect(*connection.context_, service);
  if (!client.ok()) {
    const std::string hint = client.status().code() == StatusCode::kUnavailable ? fmt::format(" ({})", kHowToStart) : "";
    return Status(client.status().code(), client.status().message() + hint);
  }
  connection.client_ = std::make_unique<Client>(*std::move(client));
  return connection;
}

}  // namespace slabstream
