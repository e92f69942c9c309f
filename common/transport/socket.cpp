#include "common/transport/socket.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <zmq.hpp>

#include "common/base/check.h"
#include "common/base/limited_log.h"
#include "common/transport/authenticator.h"
#include "common/transport/connection_monitor.h"
#include "common/transport/connection_table.h"
#include "common/transport/context_impl.h"
#include "common/transport/endpoint.h"
#include "common/transport/ipc_listener.h"
#include "common/transport/latest_seals.h"
#include "common/transport/message_parts.h"
#include "common/transport/sealing.h"

namespace slabstream {

struct Socket::Impl {
  Impl(Context& the_context, zmq::socket_type type, SocketOptions the_options)
      : context(the_context),
        options(std::move(the_options)),
        socket(the_context.impl().context, type),
        router(type == zmq::socket_type::router) {}

  Context& context;
  const SocketOptions options;
  zmq::socket_t socket;
  const bool router;
  bool encrypted = false;  // all of its connections
  bool knows_connections = options.ends_connections;
  ConnectionTable connections;                        // of users
  std::unique_ptr<ConnectionTuner> tuner;             // of the tcp connections made here
  std::unique_ptr<ConnectionLimit> limit;             // of the connections accepted here
  std::shared_ptr<LatestSeals> seals;                 // if it listens for sealed connections
  std::vector<std::byte> unseal_scratch;              // of all of them
  std::optional<Sealer> sealer;                       // if it has a sealed connection
  LimitedLog complaints;                              // about forged frames
  std::vector<std::string> names;                     // inproc endpoints bound here
  std::vector<IpcListener> listeners;                 // ipc files bound here
  std::unordered_map<std::string, HeldBytes> unsent;  // by identity; of a dealer, one
  std::size_t next_sweep = 64;                        // entries of `unsent`

  const HeldBytes& UnsentOf(const std::string& identity) {
    if (unsent.size() >= next_sweep) {
      std::erase_if(unsent, [](const auto& entry) { return *entry.second == 0; });  // only this thread makes it more
      next_sweep = std::max(next_sweep, 2 * unsent.size());
    }
    HeldBytes& held = unsent[router ? identity : std::string()];
    if (held == nullptr) held = std::make_shared<std::atomic<std::uint64_t>>(0);
    return held;
  }

  // Says of what is coming who has sent it. `part`: any of it.
  void Name(Incoming& incoming, zmq::message_t& part) {
    const ConnectionTable::Sender& sender = connections.Heard(incoming.identity, part);
    incoming.user = sender.user;
    incoming.host = sender.host;
  }

  // Names and files are free again when the socket is gone; ZeroMQ alone would free them some time later.
  ~Impl() {
    for (const std::string& name : names) {
      try {
        socket.unbind(name);
      } catch (const zmq::error_t&) {  // nothing to free
      }
    }
    for (IpcListener& listener : listeners) listener.Remove();
  }
};

namespace {

constexpr int kSealedReceiveMark = 64;  // frames of a connection that wait to be opened: 16 MiB, also of one that nobody should have made
constexpr std::int64_t kHandshakeBytes = 512;  // more than any part of a PLAIN handshake has
constexpr int kSealedBatch = 256;              // frames opened in one call: 64 MiB

Status Failed(const std::string& endpoint, const zmq::error_t& error) {
  if (error.num() == EADDRNOTAVAIL) {
    const bool loopback = endpoint.starts_with("tcp://127.");
    return Status::InvalidArgument("endpoint \"" + endpoint + "\": this machine has no such address" +
                                   (loopback ? "; one with IPv6 alone has [::1], as in tcp://[::1]:7420" : ""));
  }
  return Status::Unavailable("endpoint \"" + endpoint + "\": " + (error.num() == EADDRINUSE ? "already in use" : error.what()));
}

// How long a tcp connection may go without an acknowledgement before it ends: less than any time-out of the service above it, so that
// messages pass again, over another connection, before somebody is taken for dead.
constexpr std::chrono::milliseconds kCutOff{3000};
constexpr std::chrono::seconds kIdle{2}, kProbeInterval{1};  // of a connection that is silent; then of the probes
constexpr std::chrono::milliseconds kConnect{2000};          // for one attempt to connect

// Without these the kernel alone decides, and it waits twice as long before each time that it sends a packet again: after a link was down
// for 10 s, nothing passed for up to 6 s more; a connection whose host has another address now hung for ever. The kernel rather than
// heartbeats of ZeroMQ judges, since those wait behind a message that takes long on a slow link, while every part of it is acknowledged.
void NoticeCutConnections(zmq::socket_t& socket) {
  socket.set(zmq::sockopt::tcp_maxrt, int(kCutOff.count()));
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, int(kIdle.count()));
  socket.set(zmq::sockopt::tcp_keepalive_intvl, int(kProbeInterval.count()));
  socket.set(zmq::sockopt::connect_timeout, int(kConnect.count()));
}

Result<std::unique_ptr<Socket::Impl>> MakeSocket(Context& context, zmq::socket_type type, const SocketOptions& options) {
  try {
    auto impl = std::make_unique<Socket::Impl>(context, type, options);
    impl->socket.set(zmq::sockopt::sndhwm, options.send_high_water_mark);
    impl->socket.set(zmq::sockopt::rcvhwm, options.receive_high_water_mark);
    impl->socket.set(zmq::sockopt::linger, static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(options.linger).count()));
    impl->socket.set(zmq::sockopt::handshake_ivl,
                     static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(options.handshake).count()));
    impl->socket.set(zmq::sockopt::maxmsgsize, options.max_message_bytes);
    NoticeCutConnections(impl->socket);
    if (impl->router) {
      impl->socket.set(zmq::sockopt::router_mandatory, true);
      impl->socket.set(zmq::sockopt::router_handover, false);  // nobody takes over another's identity
      impl->limit = std::make_unique<ConnectionLimit>(impl->socket, options.max_connections);
    }
    return impl;
  } catch (const zmq::error_t& error) {
    return Status::ResourceExhausted(std::string("socket: ") + error.what());
  }
}

// [::1] needs it; with it on always, ZeroMQ would report IPv4 endpoints in their mapped form.
void AllowAddressFamily(zmq::socket_t& socket, const Endpoint& endpoint) { socket.set(zmq::sockopt::ipv6, endpoint.host.starts_with('[')); }

Status KeysMissing(const Endpoint& endpoint) {
  return Status::InvalidArgument("endpoint \"" + endpoint.ToString() + "\": host \"" + endpoint.host +
                                 "\" is not loopback (127.0.0.0/8, [::1] or localhost): without keys the service stays on this machine (a "
                                 "service file, --service, has those of one that does not)");
}

// Connections of this endpoint are encrypted.
void UseServerKeys(Context& context, zmq::socket_t& socket, const ServerKeys& keys) {
  context.authenticator();  // without it everybody would be admitted
  socket.set(zmq::sockopt::curve_server, true);
  socket.set(zmq::sockopt::curve_secretkey, keys.secret_key);
  socket.set(zmq::sockopt::zap_domain, keys.plane);
}
void UseClientKeys(zmq::socket_t& socket, const ClientKeys& keys) {
  socket.set(zmq::sockopt::curve_serverkey, keys.server_key);
  socket.set(zmq::sockopt::curve_publickey, keys.own.public_key);
  socket.set(zmq::sockopt::curve_secretkey, keys.own.secret_key);
}

// Sealed connections are ZeroMQ's PLAIN ones: the public key is the user's name, the ticket is the password.
Status UseSealedServerKeys(Socket::Impl& impl, const ServerKeys& keys) {
  const std::optional<std::string> public_key = PublicKeyOf(keys.secret_key);
  if (!public_key) return Status::InvalidArgument("the secret key of the plane " + keys.plane + " is no key");
  impl.seals = std::make_shared<LatestSeals>(KeyPair{*public_key, keys.secret_key},
                                             std::uint64_t(std::max<std::int64_t>(impl.options.max_message_bytes, 0)));
  impl.context.authenticator().SetSealed(keys.plane, impl.seals);
  impl.socket.set(zmq::sockopt::plain_server, true);
  impl.socket.set(zmq::sockopt::zap_domain, keys.plane);
  impl.socket.set(zmq::sockopt::maxmsgsize, std::int64_t{kSealedFrameBytes});
  impl.socket.set(zmq::sockopt::rcvhwm, kSealedReceiveMark);
  return Status::Ok();
}
Status UseSealedClientKeys(Socket::Impl& impl, const ClientKeys& keys) {
  CHECK(!impl.sealer) << "a sealed socket connects once";
  const std::optional<Seal> seal = Seal::Make(keys.own, keys.server_key);
  if (!seal) return Status::InvalidArgument("the key of whoever listens, or the own one, is no key");
  impl.sealer.emplace(*seal);
  impl.socket.set(zmq::sockopt::plain_username, keys.own.public_key);
  impl.socket.set(zmq::sockopt::plain_password, seal->ticket);
  // One message of any size goes through an empty queue.
  const auto largest = std::uint64_t(std::max<std::int64_t>(impl.options.max_message_bytes, 0));
  impl.socket.set(zmq::sockopt::sndhwm, impl.options.send_high_water_mark + int(SealedFrames(largest)));
  // Nothing is expected from the other end, which need not be who it should.
  impl.socket.set(zmq::sockopt::maxmsgsize, kHandshakeBytes);
  return Status::Ok();
}

// Hands a listening descriptor to the socket, which owns it from then on.
void BindDescriptor(zmq::socket_t& socket, const std::string& endpoint, IpcListener& listener) {
  constexpr int kNone = -1;
  const int descriptor = listener.Release();
  socket.set(zmq::sockopt::use_fd, descriptor);
  socket.bind(endpoint);
  socket.set(zmq::sockopt::use_fd, kNone);
}

Status StatusOfSending(int error) {
  switch (error) {
    case 0: return Status::Ok();
    case EAGAIN: return Status::ResourceExhausted("send: the high-water mark is reached or nobody is connected");
    case EHOSTUNREACH: return Status::Unavailable("send: the peer is not connected");
    default: return Status::Unavailable(std::string("send: ") + zmq_strerror(error));
  }
}

// Each frame is a ZeroMQ message of its own, so that it is under way while the next one is sealed. If the queue is full before the last
// one, the receiver drops what it has got.
Status SendSealed(Socket::Impl& impl, std::span<const std::byte> header, const Bytes& payload) {
  if (header.size() > kMaxSealedHeaderBytes) {
    return Status::InvalidArgument("send: a header of " + std::to_string(header.size()) +
                                   " bytes; over a sealed connection it has at most " + std::to_string(kMaxSealedHeaderBytes));
  }
  impl.sealer->Begin(header, payload.span());
  int error = 0;
  while (error == 0) {
    PooledVector<std::byte> frame = impl.sealer->Next();
    if (frame.empty()) break;
    error = SendPart(impl.socket, Share(Bytes(std::move(frame)), impl.UnsentOf("")), false);
  }
  return StatusOfSending(error);
}

std::optional<Incoming> TryReceivePlain(Socket::Impl& impl) {
  zmq::message_t part;
  while (ReceivePart(impl.socket, part)) {
    Incoming incoming;
    bool more = part.more();
    if (impl.router) {
      incoming.identity = part.to_string();
    } else {
      incoming.parts.push_back(Adopt(std::move(part)));
    }
    // The parts of a message arrive together, so none of them needs a wait.
    std::size_t surplus = 0;
    while (more && ReceivePart(impl.socket, part)) {
      more = part.more();
      if (impl.knows_connections && incoming.parts.empty()) impl.Name(incoming, part);
      if (incoming.parts.size() < 2) {
        incoming.parts.push_back(Adopt(std::move(part)));
      } else {
        ++surplus;
      }
    }
    if (impl.encrypted && incoming.user.empty()) continue;  // the Authenticator has not admitted it
    if (!incoming.parts.empty() && surplus == 0) return incoming;
  }
  return std::nullopt;
}

// A whole message, if the frames that are there make one.
std::optional<Incoming> TryReceiveSealed(Socket::Impl& impl) {
  zmq::message_t part;
  for (int i = 0; i < kSealedBatch && ReceivePart(impl.socket, part); ++i) {
    Incoming incoming{.identity = part.to_string()};
    std::vector<Bytes> frames;
    for (bool more = part.more(); more && ReceivePart(impl.socket, part);) {
      more = part.more();
      if (frames.empty()) impl.Name(incoming, part);
      frames.push_back(Adopt(std::move(part)));
    }
    const std::shared_ptr<Unsealer> unsealer = impl.seals->Of(incoming.user);
    if (unsealer != nullptr && frames.size() == 1) {
      auto opened = unsealer->Open(frames[0].span(), impl.unseal_scratch);
      if (std::holds_alternative<Unsealer::More>(opened)) continue;
      if (auto* message = std::get_if<Unsealer::Message>(&opened)) {
        incoming.parts = std::move(*message);
        return incoming;
      }
    }
    impl.complaints.Warning("ended a sealed connection of the key " + IdOfKey(incoming.user) + ": its holder did not make what it brought");
    impl.connections.EndOne(incoming.identity);
  }
  return std::nullopt;
}

}  // namespace

Result<Socket> Socket::Router(Context& context, const SocketOptions& options) {
  auto impl = MakeSocket(context, zmq::socket_type::router, options);
  if (!impl.ok()) return impl.status();
  return Socket(*std::move(impl));
}

Result<Socket> Socket::Dealer(Context& context, const SocketOptions& options) {
  auto impl = MakeSocket(context, zmq::socket_type::dealer, options);
  if (!impl.ok()) return impl.status();
  return Socket(*std::move(impl));
}

Socket::Socket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Socket::Socket(Socket&&) noexcept = default;
Socket& Socket::operator=(Socket&&) noexcept = default;
Socket::~Socket() = default;

Result<std::string> Socket::Bind(const std::string& text) {
  const Result<Endpoint> endpoint = ParseEndpoint(text, true);
  if (!endpoint.ok()) return endpoint.status();
  const std::string name = endpoint->ToString();
  zmq::socket_t& socket = impl_->socket;
  try {
    switch (endpoint->scheme) {
      case Scheme::kTcp: {
        if (const auto& keys = impl_->options.server_keys) {
          if (!keys->sealed) {
            UseServerKeys(impl_->context, socket, *keys);
          } else if (Status status = UseSealedServerKeys(*impl_, *keys); !status.ok()) {
            return status;
          }
          impl_->encrypted = impl_->knows_connections = true;
        } else if (endpoint->remote()) {
          return KeysMissing(*endpoint);
        }
        AllowAddressFamily(socket, *endpoint);
        socket.bind(name);
        return socket.get(zmq::sockopt::last_endpoint);
      }
      case Scheme::kIpc: {
        Result<IpcListener> listener = IpcListener::Listen(endpoint->path);
        if (!listener.ok()) return listener.status();
        impl_->listeners.push_back(*std::move(listener));
        BindDescriptor(socket, name, impl_->listeners.back());
        return name;
      }
      case Scheme::kInproc: {
        socket.bind(name);
        impl_->names.push_back(name);
        return name;
      }
    }
  } catch (const zmq::error_t& error) {
    return Failed(name, error);
  }
  return Status::Internal("endpoint \"" + name + "\": unknown scheme");
}

Status Socket::Connect(const std::string& text) {
  const Result<Endpoint> endpoint = ParseEndpoint(text, false);
  if (!endpoint.ok()) return endpoint.status();
  const auto& keys = impl_->options.client_keys;
  if (endpoint->remote() && !keys) return KeysMissing(*endpoint);
  try {
    if (endpoint->scheme == Scheme::kTcp && keys && keys->sealed) {
      if (Status status = UseSealedClientKeys(*impl_, *keys); !status.ok()) return status;
    } else if (endpoint->scheme == Scheme::kTcp && keys) {
      UseClientKeys(impl_->socket, *keys);
    }
    AllowAddressFamily(impl_->socket, *endpoint);
    if (endpoint->scheme == Scheme::kTcp && impl_->tuner == nullptr) impl_->tuner = std::make_unique<ConnectionTuner>(impl_->socket);
    impl_->socket.connect(endpoint->ToString());
    return Status::Ok();
  } catch (const zmq::error_t& error) {
    return Failed(endpoint->ToString(), error);
  }
}

Status Socket::Send(const std::string& identity, std::vector<std::byte> header, const Bytes& payload) {
  zmq::socket_t& socket = impl_->socket;
  if (impl_->tuner != nullptr) impl_->tuner->HandleEvents();
  if (impl_->seals != nullptr) return Status::InvalidArgument("send: sealed connections go one way, to this socket");
  if (impl_->sealer) return SendSealed(*impl_, header, payload);
  // Make all parts before sending the first one: running out of memory between them would leave half a message.
  zmq::message_t to(identity.data(), identity.size()), head = Share(Bytes(std::move(header)));
  zmq::message_t body = payload.empty() ? zmq::message_t() : Share(payload, impl_->UnsentOf(identity));
  int error = impl_->router ? SendPart(socket, std::move(to), true) : 0;
  if (error == 0) error = SendPart(socket, std::move(head), !payload.empty());
  if (error == 0 && !payload.empty()) error = SendPart(socket, std::move(body), false);
  return StatusOfSending(error);
}

std::uint64_t Socket::UnsentBytes(const std::string& identity) const {
  const auto held = impl_->unsent.find(identity);
  return held == impl_->unsent.end() ? 0 : held->second->load();
}

bool Socket::refused() const {
  if (impl_->tuner == nullptr) return false;
  impl_->tuner->HandleEvents();
  return impl_->tuner->refused();
}

bool Socket::connected() const {
  if (impl_->tuner == nullptr) return false;
  impl_->tuner->HandleEvents();
  return impl_->tuner->connected();
}

bool Socket::TakeBroken() {
  if (impl_->tuner == nullptr) return false;
  impl_->tuner->HandleEvents();
  return impl_->tuner->TakeBroken();
}

std::string Socket::local_host() const {
  if (impl_->tuner == nullptr) return "";
  impl_->tuner->HandleEvents();
  return impl_->tuner->local_host();
}

void Socket::EndConnections(const std::string& user) {
  impl_->connections.End(user);
  if (impl_->seals != nullptr) impl_->seals->Retire(user);
}
void Socket::EndConnection(const std::string& identity) { impl_->connections.EndOne(identity); }

std::optional<Incoming> Socket::TryReceive() {
  std::optional<Incoming> incoming;
  if (impl_->seals != nullptr) {
    incoming = TryReceiveSealed(*impl_);
  } else if (!impl_->sealer) {  // whose socket expects nothing, and nothing that comes is authenticated
    incoming = TryReceivePlain(*impl_);
  }
  if (incoming) return incoming;
  if (impl_->tuner != nullptr) impl_->tuner->HandleEvents();
  if (impl_->limit != nullptr) impl_->limit->HandleEvents();
  return std::nullopt;
}

bool Wait(std::span<Socket* const> sockets, Wakeup* wakeup, Duration timeout) {
  std::vector<zmq::pollitem_t> items;
  items.reserve(sockets.size() + 1);
  for (Socket* socket : sockets) items.push_back({socket->impl().socket.handle(), 0, ZMQ_POLLIN, 0});
  if (wakeup != nullptr) items.push_back({nullptr, wakeup->file_descriptor(), ZMQ_POLLIN, 0});
  // Rounded up: a wait that ends before its time would be called again and again.
  const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(std::max(timeout, Duration::zero()));
  bool signalled = false;
  try {
    zmq::poll(items, milliseconds);
  } catch (const zmq::error_t& error) {
    CHECK_EQ(error.num(), EINTR);
    signalled = true;
  }
  const bool notified = wakeup != nullptr && wakeup->Drain();
  return notified || signalled;
}

}  // namespace slabstream
