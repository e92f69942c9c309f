#include "common/transport/connection_table.h"

#include <algorithm>
#include <cstring>

namespace slabstream {

sockaddr_storage ConnectionTable::PeerOf(int descriptor) {
  sockaddr_storage peer{};
  socklen_t bytes = sizeof(peer);
  if (::getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &bytes) != 0) return {};
  return peer;
}

std::string ConnectionTable::Heard(const std::string& identity, zmq::message_t& part) {
  if (const auto known = connections_.find(identity); known != connections_.end()) return known->second.user;
  const char* const user = zmq_msg_gets(part.handle(), "User-Id");
  if (user == nullptr || *user == '\0') return "";
  const int descriptor = zmq_msg_get(part.handle(), ZMQ_SRCFD);
  if (connections_.size() >= next_sweep_) ForgetClosed();
  connections_[identity] = {user, descriptor, PeerOf(descriptor)};
  return user;
}

void ConnectionTable::End(const std::string& user) {
  for (auto connection = connections_.begin(); connection != connections_.end();) {
    const auto& [of, descriptor, peer] = connection->second;
    if (of != user) {
      ++connection;
      continue;
    }
    const sockaddr_storage now = PeerOf(descriptor);
    if (now.ss_family != AF_UNSPEC && std::memcmp(&now, &peer, sizeof(peer)) == 0) (void)::shutdown(descriptor, SHUT_RDWR);
    connection = connections_.erase(connection);
  }
}

void ConnectionTable::ForgetClosed() {
  std::erase_if(connections_, [](const auto& entry) {
    const sockaddr_storage now = PeerOf(entry.second.descriptor);
    return now.ss_family == AF_UNSPEC || std::memcmp(&now, &entry.second.peer, sizeof(now)) != 0;
  });
  next_sweep_ = std::max<std::size_t>(64, 2 * connections_.size());
}

}  // namespace slabstream
