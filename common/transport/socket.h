// ROUTER and DEALER sockets that move frames of bytes. cppzmq and its exceptions stay inside socket.cpp.
//
//   1. One Context a process.
//   2. Socket::Router / Socket::Dealer, then Bind or Connect.
//   3. A loop: Wait(sockets, wakeup, timeout), then TryReceive until empty, then Send.
// A socket belongs to the thread that uses it; it may be made in one thread and handed to another before its first use. Context and Wakeup
// are thread-safe. Only Wait blocks.
//
// Routers are MANDATORY: sending to an identity that is not connected fails with Unavailable, which is also how a router notices that a
// peer has gone. ZeroMQ makes the identities, and never the same one twice. A dealer queues what it sends until its connection is up, and
// again while it is broken, up to the high-water mark: tcp and ipc reconnect by themselves (every 100 ms), and the queue then reaches
// whoever listens there now. So receivers check epochs, and a dealer whose peer is known to be dead is closed, which drops the queue after
// the linger time. inproc does not reconnect: after its peer has closed, sending ends in ResourceExhausted.
//
// A tcp connection ends if its other end acknowledges nothing for 3 s, whether it has vanished, is cut off, or has another address.
// Sealed connections (keys.h) carry the same messages, in one direction. Sending one seals it, at some 3 GB/s, before Send returns.
// Messages of which any frame is altered, lost, repeated or made by another one never arrive.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/transport/context.h"
#include "common/transport/keys.h"

namespace slabstream {

struct Incoming {
  std::string identity;      // routers: who sent it
  std::string user;          // routers: the sender's public key, as the Authenticator admitted it; empty: the connection is not encrypted
  std::string host;          // routers with keys: where the sender's connection comes from, as the host of an endpoint
  std::vector<Bytes> parts;  // 1 or 2: header, payload; the bytes are the message's own memory, not a copy

  std::span<const std::byte> header() const { return parts.front().span(); }
  Bytes payload() const { return parts.size() > 1 ? parts[1] : Bytes(); }
};

struct SocketOptions {
  int send_high_water_mark = 4096;  // messages; a backstop, credits bound the bytes
  int receive_high_water_mark = 4096;
  Duration linger = std::chrono::milliseconds(500);        // how long unsent messages outlive the socket
  std::int64_t max_message_bytes = std::int64_t{2} << 30;  // a larger frame closes the connection
  std::size_t max_connections = 2048;                      // connections that a router accepts at a time; further ones are closed
  bool ends_connections = false;                           // routers: EndConnection works
  Duration handshake = std::chrono::seconds(5);            // how long a connection may take to become one
  // With keys, tcp connections are encrypted; without, endpoints that leave this machine are refused. ipc and inproc are never encrypted.
  std::optional<ServerKeys> server_keys;  // to bind
  std::optional<ClientKeys> client_keys;  // to connect
};

class Socket {
 public:
  static Result<Socket> Router(Context& context, const SocketOptions& options = {});
  static Result<Socket> Dealer(Context& context, const SocketOptions& options = {});
  Socket(Socket&&) noexcept;
  Socket& operator=(Socket&&) noexcept;
  ~Socket();

  // The endpoint with the port that was chosen. Unavailable (in use, no permission) names the endpoint; InvalidArgument: as ParseEndpoint,
  // or keys are missing, or the address is not this machine's.
  // An ipc socket file that a dead process left is replaced. Closing frees inproc names and ipc files at once, a tcp port a moment later.
  Result<std::string> Bind(const std::string& endpoint);
  // Ok does not mean that anybody listens there. InvalidArgument: as ParseEndpoint, or keys are missing.
  Status Connect(const std::string& endpoint);

  // Sends header and, if not empty, payload as one message, without copying the payload. `identity` is ignored by dealers.
  // Unavailable: nobody with this identity (router); ResourceExhausted: the high-water mark is reached.
  Status Send(const std::string& identity, std::vector<std::byte> header, const Bytes& payload = {});

  // Bytes of payloads that Send has taken and that have not left this process: to `identity`; of dealers, all.
  std::uint64_t UnsentBytes(const std::string& identity = {}) const;

  // Dealers: whether the other end has refused this socket's key, or has keys while this socket has none, or the other way round.
  bool refused() const;

  // Dealers over tcp: whether there is a connection, and the other end has admitted this one. What is sent now leaves at once.
  bool connected() const;

  // Dealers over tcp: whether a connection broke, or could not be made, since the last call. What was sent may be lost.
  bool TakeBroken();
  // Dealers over tcp: this machine's address on the latest connection, as the host of an endpoint; empty: there was none.
  std::string local_host() const;

  // Ends the connections from which messages of this user have come, or of this identity; what is queued for them is gone. The other end
  // makes them again, unless the Authenticator refuses it.
  void EndConnections(const std::string& user);
  void EndConnection(const std::string& identity);

  // The next whole message, if there is one. Messages with no part or more than two parts are dropped.
  std::optional<Incoming> TryReceive();

  struct Impl;
  Impl& impl() const { return *impl_; }

 private:
  explicit Socket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Lets other threads and signal handlers end a Wait early. Any thread may Notify; the waiting thread's Wait consumes all notifications.
class Wakeup {
 public:
  Wakeup();
  ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;
  void Notify();
  int file_descriptor() const { return file_descriptor_; }
  bool Drain();  // true: it was notified

 private:
  int file_descriptor_ = -1;  // an eventfd
};

// Returns when a socket may have a message, the wakeup was notified, a signal was handled, or the timeout is over (zero: at once). It may
// also return for nothing. True: the wakeup was notified or a signal was handled; there may be messages, too.
bool Wait(std::span<Socket* const> sockets, Wakeup* wakeup, Duration timeout);

}  // namespace slabstream
