#include "worker/picture_sockets.h"

#include "common/base/log.h"
#include "common/wire/any_message.h"

namespace slabstream {
namespace {

constexpr Duration kIdle = std::chrono::minutes(1);  // longer than somebody looks at one picture

}  // namespace

void PictureSockets::Prepare(const PicturesAddress& to, Time now) {
  if (!own_) return;
  if (const auto known = connections_.find(to.key); known != connections_.end()) {
    known->second.last_used = now;
    return;
  }
  if (connections_.size() >= kMostConnections) return;
  Result<Socket> socket = Socket::Dealer(context_, {.client_keys = ClientKeys{.server_key = to.key, .own = *own_, .sealed = true}});
  const Status connected = socket.ok() ? socket->Connect(to.endpoint) : socket.status();
  if (!connected.ok()) return LogDebug("pictures plane: " + connected.message());
  connections_.emplace(to.key, Connection{std::move(*socket), now});
}

bool PictureSockets::Send(const PicturesAddress& to, const SentPicture& message, const Bytes& payload, Time now) {
  const auto connection = connections_.find(to.key);
  if (connection == connections_.end() || !connection->second.socket.connected()) return false;
  connection->second.last_used = now;
  return connection->second.socket.Send({}, Encode(message), payload).ok();
}

void PictureSockets::CloseIdle(Time now) {
  std::erase_if(connections_, [now](const auto& connection) { return now - connection.second.last_used > kIdle; });
}

}  // namespace slabstream
