// `keys`: orders to a service about the keys that it admits, and what it admits then.
#include <fmt/format.h>

#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/session.h"

namespace slabstream {

Status RunKeys(const KeysOptions& options) {
  Result<Session> session = Session::OpenService(options.service);
  if (!session.ok()) return session.status();
  const Result<std::vector<AdmittedKey>> keys = session->client().OrderKeys(options.order);
  if (!keys.ok()) return keys.status();
  for (const AdmittedKey& key : *keys)
    std::cout << fmt::format("{}  {:<6}  made {}  {}\n", IdOfKey(key.public_key), NameOf(key.role), key.made, key.public_key);
  return Status::Ok();
}

}  // namespace slabstream
