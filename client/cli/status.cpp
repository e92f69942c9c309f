#include "client/report/status_text.h"
#include "common/json/json.h"

#include <iostream>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/service/service_state.h"

namespace slabstream {

Status RunStatus(const StatusOptions& options) {
  const Result<ServiceAddress> address = ResolveService(options.service);
  if (!address.ok()) return address.status();
  Result<ServiceConnection> connection = ServiceConnection::OpenRunning(*address);
  if (!connection.ok()) return connection.status();
  const Result<StatusReply> reply = connection->client().QueryStatus();
  if (!reply.ok()) return reply.status();
  std::vector<AdmittedKey> keys;  // those who are no admins are not told whose they are
  if (address->keys) {
    if (Result<std::vector<AdmittedKey>> told = connection->client().OrderKeys({}); told.ok()) keys = *std::move(told);
  }
  if (options.json) {
    Json json = StatusJson(*reply);
    if (!keys.empty()) json["keys"] = KeysJson(keys);
    std::cout << json.dump(2) << "\n";
  } else {
    std::cout << StatusText(*reply) << (keys.empty() ? "" : KeysText(keys));
  }
  return Status::Ok();
}

}  // namespace slabstream
