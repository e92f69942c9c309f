#include "client/cli/session.h"

#include <fmt/format.h>

#include <utility>

#include "client/cli/cores.h"
#include "client/cli/input_volume.h"
#include "client/embedded/embedded_service.h"
#include "client/service/service_state.h"

namespace slabstream {
namespace {

constexpr const char* kLocalDataset = "volume";

Result<LayeredVolume> LoadInput(const std::string& path, const LayerFiles& files) {
  Result<LoadedVolume> loaded = ReadInputVolume(path);
  if (!loaded.ok()) return loaded.status();
  Result<Layers> layers = ReadLayers(files, loaded->volume->description.geometry);
  if (!layers.ok()) return AsInput(layers.status());
  layers->cells = std::move(loaded->cells);
  return LayeredVolume{.volume = std::move(loaded->volume), .layers = *std::move(layers)};
}

}  // namespace

Session::Session() = default;
Session::Session(Session&&) noexcept = default;
Session::~Session() = default;

Result<Session> Session::Open(const ConnectionOptions& connection, std::span<const std::string> sources, const LayerFiles& layers) {
  if (connection.local_workers == 0) {
    if (layers.any()) {
      return Status::InvalidArgument(
          fmt::format("--{} needs --local: at a service layers belong to the dataset, as --data "
                      "NAME=FILE,labels=FILE,overlay=FILE says, and --label-mode or --overlay-transfer shows them",
                      layers.labels.empty() ? "overlay" : "labels"));
    }
    for (const std::string& source : sources) {
      if (source.size() <= kMaxNameBytes) continue;
      return Status::InvalidArgument(fmt::format("SOURCE has {} bytes, a dataset's name has at most {}", source.size(), kMaxNameBytes));
    }
    Result<Session> session = OpenService(connection.service);
    if (session.ok()) session->datasets_.assign(sources.begin(), sources.end());
    return session;
  }
  std::vector<DataSource> files;
  for (const std::string& source : sources) {
    if (Status status = CheckInputVolume(source); !status.ok()) return status;
    files.emplace_back([source, layers] { return LoadInput(source, layers); });
  }
  if (layers.any()) {
    if (const auto headers = CheckLayerHeaders(layers); !headers.ok()) return AsInput(headers.status());
  }
  return OpenLocal(connection, std::move(files));
}

Result<Session> Session::OpenLocal(const ConnectionOptions& connection, std::vector<DataSource> sources) {
  Session session;
  session.context_ = std::make_unique<Context>();
  EmbeddedOptions options;
  options.workers = connection.local_workers;
  for (DataSource& source : sources) {
    const std::size_t number = session.datasets_.size();
    session.datasets_.push_back(number == 0 ? kLocalDataset : fmt::format("{}-{}", kLocalDataset, number));
    options.coordinator.catalogue[session.datasets_.back()] = std::move(source);
  }
  options.worker.threads = std::uint32_t(LocalThreads(connection));
  Result<std::unique_ptr<EmbeddedService>> service = EmbeddedService::Start(*session.context_, std::move(options));
  if (!service.ok()) return service.status();
  session.service_ = *std::move(service);
  Result<Client> client = Client::Connect(*session.context_, session.service_->endpoint());
  if (!client.ok()) return client.status();
  session.client_ = std::make_unique<Client>(*std::move(client));
  return session;
}

Result<Session> Session::OpenService(const ServiceChoice& choice) {
  const Result<ServiceAddress> service = ResolveService(choice);
  if (!service.ok()) return service.status();
  return OpenService(*service);
}

Result<Session> Session::OpenService(const ServiceAddress& service) {
  Session session;
  session.context_ = std::make_unique<Context>();
  Result<Client> client = Client::Connect(*session.context_, service);
  if (!client.ok()) {
    const std::string hint =
        client.status().code() == StatusCode::kUnavailable ? " (`slabstream up` starts a service, --local needs none)" : "";
    return Status(client.status().code(), client.status().message() + hint);
  }
  session.client_ = std::make_unique<Client>(*std::move(client));
  return session;
}

}  // namespace slabstream
