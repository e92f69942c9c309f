#include "worker/service/images_endpoint.h"

#include <utility>

#include "common/base/log.h"

namespace slabstream {

Result<ImagesEndpoint> ImagesEndpoint::Bind(Socket& images, const std::string& wanted, Endpoint coordinator, Incarnation incarnation) {
  ImagesEndpoint endpoint;
  if (wanted.empty() && coordinator.remote()) {
    Result<std::string> host = LocalHostTowards(coordinator);
    if (!host.ok()) return host.status();
    endpoint.host_ = coordinator.host = *std::move(host);
  }
  coordinator.port = 0;
  coordinator.path += kImagesSuffix + std::to_string(incarnation);
  Result<std::string> bound = images.Bind(wanted.empty() ? coordinator.ToString() : wanted);
  if (!bound.ok()) return bound.status();
  endpoint.text_ = *std::move(bound);
  return endpoint;
}

std::optional<std::string> ImagesEndpoint::Follow(Socket& images, const std::string& local_host) {
  if (host_.empty() || local_host.empty() || local_host == host_) return std::nullopt;
  host_ = local_host;
  Result<std::string> bound = images.Bind("tcp://" + host_ + ":*");
  if (!bound.ok()) {  // the address has changed once more
    LogWarning("images cannot come to this host's new address: " + bound.status().message());
    return std::nullopt;
  }
  LogInfo("this host has another address: images come to " + *bound);
  text_ = *std::move(bound);
  return text_;
}

}  // namespace slabstream
