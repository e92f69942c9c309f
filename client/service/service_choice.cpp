#include "client/service/service_choice.h"

#include <fmt/format.h>

#include "common/transport/endpoint.h"

namespace slabstream {

ParseText EndpointText(bool allow_wildcard) {
  return [allow_wildcard](const std::string& option, const std::string& text) -> Result<std::string> {
    const Result<Endpoint> endpoint = ParseEndpoint(text, allow_wildcard);
    if (!endpoint.ok()) return Status::InvalidArgument(fmt::format("{} {}", option, endpoint.status().message()));
    return text;
  };
}

Option AddService(const Command& app, ServiceChoice& service) {
  Option endpoint = AddParsed(app, "--endpoint", service.endpoint, EndpointText(false),
                              "Endpoint of the service; with --service, another way to it, such as a tunnel")
                        .TypeName("ENDPOINT")
                        .Default("$SLABSTREAM_ENDPOINT, or the service that `up` started last");
  app.AddText("--service", service.file, "Service file of a service with keys: its endpoint and a key")
      .TypeName("FILE")
      .Default("$SLABSTREAM_SERVICE, if there is no --endpoint");
  return endpoint;
}

}  // namespace slabstream
