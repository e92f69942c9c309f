#include "client/cli/session.h"

#include <fmt/format.h>

#include <utility>

#include "client/cli/cores.h"
#include "client/cli/input_volume.h"
#include "client/cli/service_state.h"
#include "client/embedded/embedded_service.h"

namespace slabstream {
namespace {

constexpr const char* kLocalDataset = "volume";

Result<std::shared_ptr<const Volume>> LoadInput(const std::string& path) {
  Result<LoadedVolume> loaded = ReadInputVolume(path);
  if (!loaded.ok()) return loaded.status();
  return std::move(loaded->volume);
}

}  // namespace

Session::Session() = default;
Session::Session(Session&&) noexcept = default;
Session::~Session() = default;

Result<Session> Session::Open(const ConnectionOptions& connection, std::span<const std::string> sources) {
  if (connection.local_workers == 0) {
    for (const std::string& source : sources) {
      if (source.size() <= kMaxNameBytes) continue;
      return Status::InvalidArgument(fmt::format("SOURCE has {} bytes, a dataset's name has at most {}", source.size(), kMaxNameBytes));
    }
    Result<Session> session = OpenService(connection.service);
    if (session.ok()) session->datasets_.assign(sources.begin(), sources.end());
    return session;
  }
  std::vector<LoadVolume> loads;
  for (const std::string& source : sources) {
    if (Status status = CheckInputVolume(source); !status.ok()) return status;
    loads.emplace_back([source] { return LoadInput(source); });
  }
  return OpenLocal(connection, std::move(loads));
}

Result<Session> Session::OpenLocal(const ConnectionOptions& connection, std::vector<LoadVolume> loads) {
  Session session;
  session.context_ = std::make_unique<Context>();
  EmbeddedOptions options;
  options.workers = connection.local_workers;
  for (LoadVolume& load : loads) {
    const std::size_t number = session.datasets_.size();
    session.datasets_.push_back(number == 0 ? kLocalDataset : fmt::format("{}-{}", kLocalDataset, number));
    options.coordinator.catalogue[session.datasets_.back()] = std::move(load);
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
