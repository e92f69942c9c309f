#include "common/transport/connection_table.h"

#include <sys/socket.h>

#include <algorithm>

#include "common/transport/socket_cookie.h"

namespace slabstream {

bool ConnectionTable::Connection::open() const { return cookie != 0 && SocketCookie(descriptor) == cookie; }

void ConnectionTable::Connection::ShutDown() const {
  if (open()) (void)::shutdown(descriptor, SHUT_RDWR);
}

std::string ConnectionTable::Heard(const std::string& identity, zmq::message_t& part) {
  if (const auto known = connections_.find(identity); known != connections_.end()) return known->second.user;
  if (connections_.size() >= next_sweep_) {
    std::erase_if(connections_, [](const auto& entry) { return !entry.second.open(); });
    next_sweep_ = std::max<std::size_t>(64, 2 * connections_.size());
  }
  const char* const user = zmq_msg_gets(part.handle(), "User-Id");  // null over connections without CURVE
  const int descriptor = zmq_msg_get(part.handle(), ZMQ_SRCFD);     // -1 over inproc
  return connections_.insert_or_assign(identity, Connection{user == nullptr ? "" : user, descriptor, SocketCookie(descriptor)})
      .first->second.user;
}

void ConnectionTable::End(const std::string& user) {
  std::erase_if(connections_, [&](const auto& entry) {
    if (entry.second.user != user) return false;
    entry.second.ShutDown();
    return true;
  });
}

void ConnectionTable::EndOne(const std::string& identity) {
  const auto connection = connections_.find(identity);
  if (connection == connections_.end()) return;
  connection->second.ShutDown();
  connections_.erase(connection);
}

}  // namespace slabstream
