#include "worker/service/picture_sockets.h"

#include "common/base/log.h"
#include "common/wire/any_message.h"

namespace slabstream {
namespace {

constexpr Duration kIdle = std::chrono::minutes(1);         // longer than somebody looks at one picture
constexpr Duration kStandstill = std::chrono::seconds(10);  // longer than a link that works needs for a part of a picture

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
  connections_.emplace(to.key, Connection{.socket = std::move(*socket), .last_used = now, .moved = now});
}

std::uint64_t PictureSockets::Unsent() const {
  std::uint64_t unsent = 0;
  for (const auto& [key, connection] : connections_) unsent += connection.socket.UnsentBytes();
  return unsent;
}

bool PictureSockets::Send(const PicturesAddress& to, const SentPicture& message, const Bytes& payload, Time now) {
  const auto connection = connections_.find(to.key);
  if (connection == connections_.end() || !connection->second.socket.connected()) return false;
  if (const std::uint64_t unsent = Unsent(); unsent > 0 && unsent + payload.size() > most_unsent_) return false;
  connection->second.last_used = now;
  return connection->second.socket.Send({}, Encode(message), payload).ok();
}

void PictureSockets::CloseIdle(Time now) {
  for (auto& [key, connection] : connections_) {
    const std::uint64_t unsent = connection.socket.UnsentBytes();
    if (unsent == 0 || unsent < connection.unsent) connection.moved = now;
    connection.unsent = unsent;
  }
  std::erase_if(connections_,
                [now](const auto& entry) { return now - entry.second.last_used > kIdle || now - entry.second.moved > kStandstill; });
}

}  // namespace slabstream
