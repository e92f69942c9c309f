// `keys`: orders to a service about the keys that it admits, and what it admits then.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/report/status_text.h"
#include "client/service/service_state.h"
#include "common/service/key_folder.h"
#include "common/service/service_file.h"
#include "common/wire/any_message.h"

namespace slabstream {
namespace {

// The pair is made here, so that its secret key leaves this process only into the service file.
Status IssueKey(const KeysOptions& options) {
  KeysOrder order = options.order;
  if (!IsHolderName(order.name)) {
    return Status::InvalidArgument(fmt::format(
        "--name must be 1 to {} bytes of printable text that can name a file: no '/', no '.' at the beginning", kMaxHolderNameBytes));
  }
  const std::string path = options.output.empty() ? order.name + ".json" : options.output;
  if (std::error_code error; std::filesystem::exists(path, error)) {
    return Status::InvalidArgument(fmt::format("'{}' exists already; --output names another file", path));
  }
  const Result<ServiceAddress> address = ResolveService(options.service);
  if (!address.ok()) return address.status();
  if (!address->keys) return Status::InvalidArgument("the service has no keys: it stays on its machine");
  const KeyPair own = MakeKeyPair();
  order.key = own.public_key;
  Result<ServiceConnection> connection = ServiceConnection::OpenService(*address);
  if (!connection.ok()) return connection.status();
  const Result<std::vector<AdmittedKey>> keys = connection->client().OrderKeys(order);
  if (!keys.ok()) return keys.status();
  const AdmittedKey& made = keys->back();
  const Status written = WriteServiceFile(path, {.role = order.role,
                                                 .endpoint = address->endpoint,
                                                 .server_key = address->keys->server_key,
                                                 .own = own,
                                                 .wire_version = kWireVersion,
                                                 .made = made.made});
  if (!written.ok()) {  // nobody has the secret key then
    (void)connection->client().OrderKeys({.action = KeysAction::kRevoke, .key = own.public_key});
    return written;
  }
  std::cout << fmt::format("{} has the key {} of {}: give them this file by a way that nobody else can read\n", path,
                           IdOfKey(own.public_key), order.name);
  return Status::Ok();
}

}  // namespace

Status RunKeys(const KeysOptions& options) {
  if (options.order.action == KeysAction::kIssue) return IssueKey(options);
  Result<ServiceConnection> connection = ServiceConnection::OpenService(options.service);
  if (!connection.ok()) return connection.status();
  const Result<std::vector<AdmittedKey>> keys = connection->client().OrderKeys(options.order);
  if (!keys.ok()) return keys.status();
  for (const AdmittedKey& key : *keys) {
    std::cout << fmt::format("{}  {:<6}  made {}  {}  {}{}\n", IdOfKey(key.public_key), NameOf(key.role), key.made, key.public_key,
                             key.name.empty() ? "" : key.name + ", ", HeardText(key));
  }
  return Status::Ok();
}

}  // namespace slabstream
