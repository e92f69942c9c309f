#include "client/report/status_text.h"

#include <iostream>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"

namespace slabstream {

Status RunStatus(const StatusOptions& options) {
  Result<ServiceConnection> connection = ServiceConnection::OpenService(options.service);
  if (!connection.ok()) return connection.status();
  const Result<StatusReply> reply = connection->client().QueryStatus();
  if (!reply.ok()) return reply.status();
  std::cout << (options.json ? StatusJson(*reply).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n"
                             : StatusText(*reply));
  return Status::Ok();
}

}  // namespace slabstream
