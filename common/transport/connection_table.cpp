#include "common/transport/connection_table.h"

#include <sys/socket.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/transport/socket_cookie.h"

namespace slabstream {
namespace {

std::string Property(zmq::message_t& part, const char* name) {
  const char* const value = zmq_msg_gets(part.handle(), name);  // null: the connection has no such property
  return value == nullptr ? "" : value;
}

// IPv4 addresses that IPv6 sockets report, ::ffff:1.2.3.4, are those of IPv4.
std::string HostOf(std::string address) {
  constexpr std::string_view kMapped = "::ffff:";
  if (address.starts_with(kMapped) && address.find('.') != std::string::npos) address.erase(0, kMapped.size());
  return address.find(':') == std::string::npos ? address : "[" + address + "]";
}

}  // namespace

bool ConnectionTable::Connection::open() const { return cookie != 0 && SocketCookie(descriptor) == cookie; }

void ConnectionTable::Connection::ShutDown() const {
  if (open()) (void)::shutdown(descriptor, SHUT_RDWR);
}

const ConnectionTable::Sender& ConnectionTable::Heard(const std::string& identity, zmq::message_t& part) {
  if (const auto known = connections_.find(identity); known != connections_.end()) return known->second.sender;
  if (connections_.size() >= next_sweep_) {
    std::erase_if(connections_, [](const auto& entry) { return !entry.second.open(); });
    next_sweep_ = std::max<std::size_t>(64, 2 * connections_.size());
  }
  const int descriptor = zmq_msg_get(part.handle(), ZMQ_SRCFD);  // -1 over inproc
  Sender sender = {Property(part, "User-Id"), HostOf(Property(part, "Peer-Address"))};
  return connections_.insert_or_assign(identity, Connection{std::move(sender), descriptor, SocketCookie(descriptor)}).first->second.sender;
}

void ConnectionTable::End(const std::string& user) {
  std::erase_if(connections_, [&](const auto& entry) {
    if (entry.second.sender.user != user) return false;
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
