#include "worker/service/peer_sockets.h"

namespace slabstream {

Status PeerSockets::Send(const Peer& to, std::vector<std::byte> header, const Bytes& payload, Time now) {
  auto connection = connections_.find(to.images_endpoint);
  if (connection == connections_.end()) {
    SocketOptions options;
    if (own_ && !to.images_key.empty()) options.client_keys = ClientKeys{.server_key = to.images_key, .own = *own_, .sealed = true};
    Result<Socket> socket = Socket::Dealer(context_, options);
    if (!socket.ok()) return socket.status();
    if (Status status = socket->Connect(to.images_endpoint); !status.ok()) return status;
    connection = connections_.emplace(to.images_endpoint, Connection{std::move(*socket), now}).first;
  }
  connection->second.last_used = now;
  connection->second.worker = to.worker;
  return connection->second.socket.Send({}, std::move(header), payload);
}

std::vector<WorkerId> PeerSockets::TakeBroken() {
  std::vector<WorkerId> broken;
  for (auto& [endpoint, connection] : connections_) {
    if (connection.socket.TakeBroken()) broken.push_back(connection.worker);
  }
  return broken;
}

void PeerSockets::CloseIdle(Time now) {
  std::erase_if(connections_, [now](const auto& connection) { return now - connection.second.last_used > kPeerIdle; });
}

}  // namespace slabstream
