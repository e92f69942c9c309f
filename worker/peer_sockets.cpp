#include "worker/peer_sockets.h"

#include <utility>

namespace slabstream {

Status PeerSockets::Send(const std::string& endpoint, std::vector<std::byte> header, const Bytes& payload, Time now) {
  auto peer = peers_.find(endpoint);
  if (peer == peers_.end()) {
    Result<Socket> socket = Socket::Dealer(context_);
    if (!socket.ok()) return socket.status();
    if (Status status = socket->Connect(endpoint); !status.ok()) return status;
    peer = peers_.emplace(endpoint, Peer{std::move(*socket), now}).first;
  }
  peer->second.last_used = now;
  return peer->second.socket.Send({}, std::move(header), payload);
}

void PeerSockets::CloseIdle(Time now) {
  std::erase_if(peers_, [now](const auto& peer) { return now - peer.second.last_used > kPeerIdle; });
}

}  // namespace slabstream
