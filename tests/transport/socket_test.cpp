// One suite over tcp, ipc and inproc: what every caller may rely on. Then what is special about one of them.
#include "common/transport/socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "common/transport/endpoint.h"
#include "common/transport/mailbox.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr Duration kPatience = std::chrono::seconds(30);  // what should happen happens long before; else the test fails

std::vector<std::byte> BytesOf(std::string_view text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}
Bytes PayloadOf(std::string_view text) { return Bytes(BytesOf(text)); }
std::string TextOf(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.span().data()), bytes.size()}; }

// The next message, waited for.
std::optional<Incoming> Receive(Socket& socket) {
  const Time limit = MonotonicNow() + kPatience;
  const std::array<Socket*, 1> sockets = {&socket};
  while (MonotonicNow() < limit) {
    if (std::optional<Incoming> incoming = socket.TryReceive()) return incoming;
    Wait(sockets, nullptr, milliseconds(100));
  }
  return std::nullopt;
}

// Calls `send` until its status has the code, letting the socket take notice of what happens in between.
template <class Send>
bool Until(StatusCode code, Socket& socket, Send&& send) {
  const Time limit = MonotonicNow() + kPatience;
  const std::array<Socket*, 1> sockets = {&socket};
  while (MonotonicNow() < limit) {
    const Status status = send();
    if (status.code() == code) return true;
    Wait(sockets, nullptr, milliseconds(1));
  }
  return false;
}

class SocketTest : public testing::TestWithParam<std::string> {
 protected:
  std::string endpoint() const {
    if (GetParam() == "tcp") return "tcp://127.0.0.1:*";
    if (GetParam() == "tcp6") return "tcp://[::1]:*";
    return GetParam() == "ipc" ? "ipc://" + (directory_ / "socket") : "inproc://socket";
  }

  // A router that is bound and a dealer that is connected to it. False: this machine has no such address.
  bool MakePair(const SocketOptions& options = {}) {
    Result<Socket> router = Socket::Router(context_, options);
    Result<Socket> dealer = Socket::Dealer(context_, options);
    if (!router.ok() || !dealer.ok()) return false;
    const Result<std::string> bound = router->Bind(endpoint());
    if (!bound.ok()) return false;
    bound_ = *bound;
    EXPECT_TRUE(dealer->Connect(bound_).ok());
    router_ = std::make_unique<Socket>(*std::move(router));
    dealer_ = std::make_unique<Socket>(*std::move(dealer));
    return true;
  }

  // Where nobody listens now, but could. "": this machine has no such address.
  std::string FreeEndpoint() const {
    Context context;  // when it has ended, so have its listeners
    Result<Socket> router = Socket::Router(context);
    const Result<std::string> bound = router.ok() ? router->Bind(endpoint()) : router.status();
    return bound.ok() ? *bound : "";
  }

  // The identity by which the router knows the dealer.
  std::string Introduce() {
    EXPECT_TRUE(dealer_->Send({}, BytesOf("hello")).ok());
    const std::optional<Incoming> hello = Receive(*router_);
    return hello ? hello->identity : "";
  }

  TemporaryDirectory directory_{"/tmp"};
  Context context_;
  std::string bound_;
  std::unique_ptr<Socket> router_, dealer_;
};

#define MAKE_PAIR_OR_SKIP(...) \
  if (!MakePair(__VA_ARGS__)) GTEST_SKIP() << "cannot bind " << endpoint()

TEST_P(SocketTest, BindTellsTheEndpointToConnectTo) {
  MAKE_PAIR_OR_SKIP();
  EXPECT_THAT(bound_, testing::Not(HasSubstr("*")));
  if (endpoint().find('*') == std::string::npos) {
    EXPECT_EQ(bound_, endpoint());
  }
}

TEST_P(SocketTest, MessagesGoBothWaysInOrderAndWhole) {
  MAKE_PAIR_OR_SKIP();
  const std::string identity = Introduce();
  ASSERT_FALSE(identity.empty());
  for (int i = 0; i < 100; ++i) {
    const std::string header = "header " + std::to_string(i), payload(static_cast<std::size_t>(i) * 97, static_cast<char>(i));
    ASSERT_TRUE(dealer_->Send("ignored", BytesOf(header), PayloadOf(payload)).ok());
    ASSERT_TRUE(router_->Send(identity, BytesOf(header), PayloadOf(payload)).ok());
  }
  for (Socket* socket : {router_.get(), dealer_.get()}) {
    for (int i = 0; i < 100; ++i) {
      const std::optional<Incoming> incoming = Receive(*socket);
      ASSERT_TRUE(incoming);
      EXPECT_EQ(incoming->identity, socket == router_.get() ? identity : "");
      ASSERT_EQ(incoming->parts.size(), i == 0 ? 1U : 2U);  // an empty payload is no part
      EXPECT_EQ(TextOf(incoming->parts[0]), "header " + std::to_string(i));
      if (i > 0) {
        EXPECT_EQ(TextOf(incoming->parts[1]), std::string(static_cast<std::size_t>(i) * 97, static_cast<char>(i)));
      }
    }
    EXPECT_FALSE(socket->TryReceive());
  }
}

TEST_P(SocketTest, BigPayloadArrivesUnchangedAndIsLetGo) {
  MAKE_PAIR_OR_SKIP();
  std::vector<std::byte> data(std::size_t{64} << 20);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::byte>(i * 2654435761U >> 13U);
  auto owner = std::make_shared<const std::vector<std::byte>>(std::move(data));
  const std::weak_ptr<const void> watch = owner;
  const std::span<const std::byte> sent = *owner;
  ASSERT_TRUE(dealer_->Send({}, BytesOf("big"), Bytes(owner, sent)).ok());
  {
    const std::optional<Incoming> incoming = Receive(*router_);
    ASSERT_TRUE(incoming && incoming->parts.size() == 2);
    const std::span<const std::byte> received = incoming->parts[1].span();
    EXPECT_TRUE(std::equal(received.begin(), received.end(), owner->begin(), owner->end()));
    if (GetParam() == "inproc") {
      EXPECT_EQ(received.data(), sent.data()) << "the very memory, not a copy";
    }
  }
  // Nobody keeps the payload once it has been delivered.
  owner.reset();
  EXPECT_TRUE(Until(StatusCode::kOk, *router_, [&] { return watch.expired() ? Status::Ok() : Status::Unavailable("still held"); }));
}

TEST_P(SocketTest, UnknownIdentityIsUnavailable) {
  MAKE_PAIR_OR_SKIP();
  EXPECT_EQ(router_->Send("nobody", BytesOf("header"), PayloadOf("payload")).code(), StatusCode::kUnavailable);
  EXPECT_EQ(router_->Send("", BytesOf("header")).code(), StatusCode::kUnavailable);
  ASSERT_FALSE(Introduce().empty());  // and the router still works
}

TEST_P(SocketTest, PeerThatClosesIsNoticed) {
  MAKE_PAIR_OR_SKIP();
  const std::string identity = Introduce();
  ASSERT_TRUE(router_->Send(identity, BytesOf("still there?")).ok());
  dealer_.reset();
  EXPECT_TRUE(Until(StatusCode::kUnavailable, *router_, [&] { return router_->Send(identity, BytesOf("still there?")); }));
}

TEST_P(SocketTest, HighWaterMarkIsResourceExhaustedAndPasses) {
  SocketOptions options;
  options.send_high_water_mark = options.receive_high_water_mark = 4;
  MAKE_PAIR_OR_SKIP(options);
  const std::string identity = Introduce();
  // Large payloads, so that the kernel's buffers do not swallow them all.
  const Bytes payload(std::vector<std::byte>(std::size_t{1} << 20));
  int accepted = 0;
  const auto send = [&] {
    const Status status = router_->Send(identity, BytesOf("header"), payload);
    if (status.ok()) ++accepted;
    return status;
  };
  ASSERT_TRUE(Until(StatusCode::kResourceExhausted, *router_, send));
  for (int i = 0; i < accepted; ++i) {
    const std::optional<Incoming> incoming = Receive(*dealer_);
    ASSERT_TRUE(incoming) << i;
    ASSERT_EQ(incoming->parts.size(), 2U) << "messages are whole though a send was refused between them";
  }
  EXPECT_TRUE(Until(StatusCode::kOk, *router_, send));
}

TEST_P(SocketTest, DealerHighWaterMarkIsResourceExhausted) {
  SocketOptions options;
  options.send_high_water_mark = options.receive_high_water_mark = 4;
  MAKE_PAIR_OR_SKIP(options);
  const Bytes payload(std::vector<std::byte>(std::size_t{1} << 20));
  EXPECT_TRUE(Until(StatusCode::kResourceExhausted, *dealer_, [&] { return dealer_->Send({}, BytesOf("header"), payload); }));
}

TEST_P(SocketTest, WhatIsSentBeforeTheServerIsThereArrives) {
  const std::string free_endpoint = FreeEndpoint();
  if (free_endpoint.empty()) GTEST_SKIP() << "cannot bind " << endpoint();
  Result<Socket> early = Socket::Dealer(context_);
  ASSERT_TRUE(early.ok() && early->Connect(free_endpoint).ok());
  ASSERT_TRUE(early->Send({}, BytesOf("first")).ok());
  Result<Socket> late = Socket::Router(context_);
  ASSERT_TRUE(late.ok());
  const Result<std::string> bound = late->Bind(free_endpoint);
  ASSERT_TRUE(bound.ok()) << bound.status().message();
  const std::optional<Incoming> incoming = Receive(*late);
  ASSERT_TRUE(incoming);
  EXPECT_EQ(TextOf(incoming->parts[0]), "first");
}

TEST_P(SocketTest, SecondServerIsToldThatTheEndpointIsInUse) {
  MAKE_PAIR_OR_SKIP();
  Result<Socket> second = Socket::Router(context_);
  ASSERT_TRUE(second.ok());
  const Result<std::string> bound = second->Bind(bound_);
  ASSERT_FALSE(bound.ok());
  EXPECT_EQ(bound.status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(bound.status().message(), "endpoint \"" + bound_ + "\": already in use");
  ASSERT_FALSE(Introduce().empty()) << "the first one is not disturbed";
}

INSTANTIATE_TEST_SUITE_P(Transports, SocketTest, testing::Values("tcp", "tcp6", "ipc", "inproc"),
                         [](const auto& transport) { return transport.param; });

TEST(Socket, FrameBeyondTheLimitClosesTheConnection) {
  Context context;
  SocketOptions options;
  options.max_message_bytes = 1000;
  Result<Socket> router = Socket::Router(context, options);
  ASSERT_TRUE(router.ok());
  const Result<std::string> bound = router->Bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(bound.ok());
  Result<Socket> dealer = Socket::Dealer(context);
  ASSERT_TRUE(dealer.ok() && dealer->Connect(*bound).ok());
  ASSERT_TRUE(dealer->Send({}, BytesOf("before")).ok());
  ASSERT_TRUE(dealer->Send({}, BytesOf("too big"), Bytes(std::vector<std::byte>(1001))).ok());
  const std::optional<Incoming> before = Receive(*router);
  ASSERT_TRUE(before);
  EXPECT_TRUE(Until(StatusCode::kUnavailable, *router, [&] { return router->Send(before->identity, BytesOf("there?")); }));
}

// A connection to 127.0.0.1:`port` that says nothing.
class SilentConnection {
 public:
  explicit SilentConnection(std::uint16_t port) : descriptor_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  }
  ~SilentConnection() { ::close(descriptor_); }
  SilentConnection(const SilentConnection&) = delete;
  SilentConnection& operator=(const SilentConnection&) = delete;

  // The other end has closed it; what that said before is passed over.
  bool closed() const {
    std::array<char, 256> said{};
    ssize_t count = 0;
    do {
      count = ::recv(descriptor_, said.data(), said.size(), MSG_DONTWAIT);
    } while (count > 0);
    return count == 0 || errno == ECONNRESET;
  }

 private:
  const int descriptor_;
};

TEST(Socket, ConnectionsBeyondTheLimitAreClosedAndLeaveTheOthersAlone) {
  Context context;
  Result<Socket> router = Socket::Router(context, {.max_connections = 2, .handshake = std::chrono::hours(1)});
  ASSERT_TRUE(router.ok());
  const Result<std::string> bound = router->Bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(bound.ok());
  Result<Socket> dealer = Socket::Dealer(context);
  ASSERT_TRUE(dealer.ok() && dealer->Connect(*bound).ok());
  ASSERT_TRUE(dealer->Send({}, BytesOf("first")).ok());
  ASSERT_TRUE(Receive(*router));

  const std::uint16_t port = ParseEndpoint(*bound, false)->port;
  auto second = std::make_unique<SilentConnection>(port);
  const auto is_closed = [&](const SilentConnection& connection) {
    return Until(StatusCode::kOk, *router, [&] {
      (void)router->TryReceive();
      return connection.closed() ? Status::Ok() : Status::Unavailable("open");
    });
  };
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(is_closed(SilentConnection(port)));
  EXPECT_FALSE(second->closed());
  ASSERT_TRUE(dealer->Send({}, BytesOf("still there")).ok());
  EXPECT_TRUE(Receive(*router));

  second.reset();  // its place is free when ZeroMQ has noticed, and ZeroMQ's dealers try again until then
  Result<Socket> other = Socket::Dealer(context);
  ASSERT_TRUE(other.ok() && other->Connect(*bound).ok());
  ASSERT_TRUE(other->Send({}, BytesOf("next")).ok());
  EXPECT_TRUE(Receive(*router));
}

TEST(Socket, MessagesOfMoreThanTwoPartsAreDropped) {
  Context context;
  Result<Socket> router = Socket::Router(context);
  ASSERT_TRUE(router.ok());
  const Result<std::string> bound = router->Bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(bound.ok());
  zmq::context_t foreign_context;
  zmq::socket_t foreign(foreign_context, zmq::socket_type::dealer);
  foreign.connect(*bound);
  for (const int parts : {3, 1, 9, 2}) {
    for (int i = parts; i > 0; --i)
      foreign.send(zmq::buffer(std::to_string(parts)), i > 1 ? zmq::send_flags::sndmore : zmq::send_flags::none);
  }
  for (const std::size_t parts : {1, 2}) {
    const std::optional<Incoming> incoming = Receive(*router);
    ASSERT_TRUE(incoming);
    EXPECT_EQ(incoming->parts.size(), parts);
    EXPECT_EQ(TextOf(incoming->parts[0]), std::to_string(parts));
  }
}

// The congestion control of this process' connections to 127.0.0.1:`port`, by their descriptors.
std::vector<std::string> CongestionControlsTo(std::uint16_t port) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int descriptor = std::stoi(entry.path().filename());
    sockaddr_in peer = {};
    socklen_t bytes = sizeof(peer);
    if (::getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &bytes) != 0) continue;
    if (peer.sin_family != AF_INET || ntohs(peer.sin_port) != port) continue;
    std::array<char, 16> name{};
    bytes = name.size() - 1;
    if (::getsockopt(descriptor, IPPROTO_TCP, TCP_CONGESTION, name.data(), &bytes) == 0) names.emplace_back(name.data());
  }
  return names;
}

TEST(Socket, ConnectionsWithinTheHostAreNotPaced) {
  Context context;
  Result<Socket> router = Socket::Router(context);
  ASSERT_TRUE(router.ok());
  const Result<std::string> bound = router->Bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(bound.ok());
  Result<Socket> dealer = Socket::Dealer(context);
  ASSERT_TRUE(dealer.ok() && dealer->Connect(*bound).ok());
  ASSERT_TRUE(dealer->Send({}, BytesOf("makes the connection")).ok());
  ASSERT_TRUE(Receive(*router));
  ASSERT_TRUE(dealer->Send({}, BytesOf("finds it there")).ok());
  EXPECT_THAT(CongestionControlsTo(ParseEndpoint(*bound, false)->port), testing::ElementsAre("reno"));
}

// False: not within a time that is far above what is needed.
bool BreaksSoon(Socket& dealer) {
  const Time limit = MonotonicNow() + std::chrono::seconds(30);
  const std::array<Socket*, 1> sockets = {&dealer};
  while (MonotonicNow() < limit) {
    if (dealer.TakeBroken()) return true;
    Wait(sockets, nullptr, std::chrono::milliseconds(10));
  }
  return false;
}

TEST(Socket, DealersTellWhereTheyConnectFromAndThatConnectionsBroke) {
  for (const std::string host : {"127.0.0.1", "[::1]"}) {
    Context context;
    std::optional<Socket> router = Socket::Router(context).value();
    const Result<std::string> bound = router->Bind("tcp://" + host + ":*");
    if (!bound.ok()) continue;  // no IPv6
    Socket dealer = Socket::Dealer(context).value();
    EXPECT_EQ(dealer.local_host(), "");
    ASSERT_TRUE(dealer.Connect(*bound).ok());
    ASSERT_TRUE(dealer.Send({}, BytesOf("makes the connection")).ok());
    ASSERT_TRUE(Receive(*router));
    EXPECT_EQ(dealer.local_host(), host);
    EXPECT_FALSE(dealer.TakeBroken());
    router.reset();
    EXPECT_TRUE(BreaksSoon(dealer));
    EXPECT_TRUE(BreaksSoon(dealer)) << "and it cannot be made again";
  }
}

TEST(Socket, RefusesWhatIsNotLoopbackWithoutKeys) {
  Context context;
  Result<Socket> socket = Socket::Router(context);
  ASSERT_TRUE(socket.ok());
  for (const Status& status : {socket->Bind("tcp://192.168.1.2:*").status(), socket->Connect("tcp://8.8.8.8:7420")}) {
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), HasSubstr("is not loopback (127.0.0.0/8, [::1] or localhost): without keys the service stays on this"));
  }
  EXPECT_EQ(socket->Connect("tcp://127.0.0.1:*").code(), StatusCode::kInvalidArgument);
}

class IpcFileTest : public testing::Test {
 protected:
  Result<std::string> Bind(Socket& socket) { return socket.Bind("ipc://" + path()); }
  std::string path() const { return directory_ / "service"; }

  TemporaryDirectory directory_{"/tmp"};
  Context context_;
  Result<Socket> socket_ = Socket::Router(context_);
};

TEST_F(IpcFileTest, FileIsGoneAtOnceAndThePathFreeAgain) {
  for (int i = 0; i < 10; ++i) {
    Result<Socket> socket = Socket::Router(context_);
    ASSERT_TRUE(socket.ok());
    ASSERT_TRUE(Bind(*socket).ok());
    EXPECT_TRUE(std::filesystem::is_socket(path()));
    { const Socket closed = *std::move(socket); }
    EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(path())));
  }
}

TEST_F(IpcFileTest, StaleSocketFileIsReplaced) {
  // What a killed process leaves: a socket file without a listener.
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(path().size(), sizeof(address.sun_path));
  path().copy(address.sun_path, path().size());
  ASSERT_EQ(::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ::close(descriptor);
  ASSERT_TRUE(std::filesystem::is_socket(path()));

  const Result<std::string> bound = Bind(*socket_);
  ASSERT_TRUE(bound.ok()) << bound.status().message();
  Result<Socket> dealer = Socket::Dealer(context_);
  ASSERT_TRUE(dealer.ok() && dealer->Connect(*bound).ok());
  ASSERT_TRUE(dealer->Send({}, BytesOf("hello")).ok());
  EXPECT_TRUE(Receive(*socket_));
}

TEST_F(IpcFileTest, FileThatIsNotASocketIsLeftAlone) {
  std::ofstream(path()) << "precious";
  const Result<std::string> bound = Bind(*socket_);
  ASSERT_FALSE(bound.ok());
  EXPECT_EQ(bound.status().message(), "endpoint \"ipc://" + path() + "\": a file that is not a socket is there");
  std::string content;
  std::ifstream(path()) >> content;
  EXPECT_EQ(content, "precious");
}

TEST_F(IpcFileTest, MissingDirectoryIsNamed) {
  const Result<std::string> bound = socket_->Bind("ipc://" + path() + "/deeper");
  ASSERT_FALSE(bound.ok());
  EXPECT_EQ(bound.status().code(), StatusCode::kUnavailable);
  EXPECT_THAT(bound.status().message(), HasSubstr(path() + "/deeper"));
}

TEST(Wakeup, EndsAWaitFromAnotherThread) {
  Mailbox<int> mailbox;
  std::thread poster([&] {
    for (int i = 0; i < 1000; ++i) mailbox.Post(i);
  });
  std::vector<int> values;
  while (values.size() < 1000) {
    Wait({}, &mailbox.wakeup(), kPatience);
    for (const int value : mailbox.TakeAll()) values.push_back(value);
  }
  poster.join();
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(values[static_cast<std::size_t>(i)], i);
}

TEST(Wakeup, NotificationsAreConsumedAndNotLost) {
  Wakeup wakeup;
  wakeup.Notify();
  wakeup.Notify();
  Wait({}, &wakeup, kPatience);  // returns at once: it was notified before
  const Time begin = MonotonicNow();
  Wait({}, &wakeup, milliseconds(5));
  EXPECT_GE(MonotonicNow() - begin, milliseconds(5)) << "both notifications were consumed by the first wait";
}

TEST(Wakeup, ASignalEndsAWait) {
  static Wakeup* notified = nullptr;
  Wakeup wakeup;
  notified = &wakeup;
  const auto before = std::signal(SIGUSR1, [](int) { notified->Notify(); });
  std::atomic<bool> done = false;
  const pthread_t waiter = pthread_self();
  std::thread sender([&] {
    while (!done) {
      pthread_kill(waiter, SIGUSR1);
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < 20; ++i) Wait({}, &wakeup, kPatience);
  done = true;
  sender.join();
  std::signal(SIGUSR1, before);
}

}  // namespace
}  // namespace slabstream
