// `keys`: orders to a service about the keys that it admits, and what it admits then.
#include <fmt/format.h>

#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"

namespace slabstream {

Status RunKeys(const KeysOptions& options) {
  Result<ServiceConnection> connection = ServiceConnection::OpenService(options.service);
  if (!connection.ok()) return connection.status();
  const Result<std::vector<AdmittedKey>> keys = connection->client().OrderKeys(options.order);
  if (!keys.ok()) return keys.status();
  for (const AdmittedKey& key : *keys)
    std::cout << fmt::format("{}  {:<6}  made {}  {}\n", IdOfKey(key.public_key), NameOf(key.role), key.made, key.public_key);
  return Status::Ok();
}

}  // namespace slabstream
