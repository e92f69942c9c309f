// Connections over tcp: when sockets close them, how they are tuned, and what sockets tell of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/transport/authenticator.h"
#include "common/transport/endpoint.h"
#include "common/transport/socket.h"
#include "tests/common/transport/conversation.h"
#include "tests/common/transport/silent_connection.h"

namespace slabstream {
namespace {

// A router of this host, and a dealer that is connected to it.
struct TcpPair {
  explicit TcpPair(const SocketOptions& options) : router(Socket::Router(context, options).value()) {
    endpoint = router.Bind("tcp://127.0.0.1:*").value();
    EXPECT_TRUE(dealer.Connect(endpoint).ok());
  }
  Context context;
  Socket router;
  Socket dealer = Socket::Dealer(context).value();
  std::string endpoint;
};

TEST(Connections, AMessageBeyondTheLimitEndsOne) {
  TcpPair pair({.max_message_bytes = 1000});
  ASSERT_TRUE(pair.dealer.Send({}, BytesOf("before")).ok());
  ASSERT_TRUE(pair.dealer.Send({}, BytesOf("too big"), Bytes(std::vector<std::byte>(1001))).ok());
  const std::optional<Incoming> before = Receive(pair.router);
  ASSERT_TRUE(before);
  EXPECT_TRUE(SendsUntil(StatusCode::kUnavailable, pair.router, [&] { return pair.router.Send(before->identity, BytesOf("there?")); }));
}

enum class Kind { kPlain, kCurve, kSealed };
class ConnectionLimitTest : public testing::TestWithParam<Kind> {};

TEST_P(ConnectionLimitTest, MoreConnectionsAreClosedAndLeaveTheOthersAlone) {
  const KeyPair server = MakeKeyPair(), own = MakeKeyPair();
  const bool sealed = GetParam() == Kind::kSealed;
  SocketOptions listens = {.max_connections = 2, .handshake = std::chrono::hours(1)}, connects;
  if (GetParam() != Kind::kPlain) {
    listens.server_keys = {.secret_key = server.secret_key, .plane = "test", .sealed = sealed};
    connects.client_keys = {.server_key = server.public_key, .own = own, .sealed = sealed};
  }
  Context context;
  context.authenticator().AdmitOnly("test", {own.public_key});
  Socket router = Socket::Router(context, listens).value();
  const std::string endpoint = router.Bind("tcp://127.0.0.1:*").value();
  Socket dealer = Socket::Dealer(context, connects).value();
  ASSERT_TRUE(dealer.Connect(endpoint).ok());
  ASSERT_TRUE(dealer.Send({}, BytesOf("first")).ok());
  ASSERT_TRUE(Receive(router));

  const std::uint16_t port = ParseEndpoint(endpoint, false)->port;
  auto second = std::make_unique<SilentConnection>(port);
  for (int i = 0; i < 3; ++i) {
    const SilentConnection third(port);
    EXPECT_TRUE(Until(router, [&] { return !router.TryReceive() && third.closed(); }));
  }
  EXPECT_FALSE(second->closed());
  ASSERT_TRUE(dealer.Send({}, BytesOf("still there")).ok());
  EXPECT_TRUE(Receive(router));

  second.reset();  // its place is free when ZeroMQ has noticed, and ZeroMQ's dealers try again until then
  Socket other = Socket::Dealer(context, connects).value();
  ASSERT_TRUE(other.Connect(endpoint).ok());
  ASSERT_TRUE(other.Send({}, BytesOf("next")).ok());
  EXPECT_TRUE(Receive(router));
}

INSTANTIATE_TEST_SUITE_P(Kinds, ConnectionLimitTest, testing::Values(Kind::kPlain, Kind::kCurve, Kind::kSealed));

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

TEST(Connections, WithinTheHostTheyAreNotPaced) {
  TcpPair pair({});
  ASSERT_TRUE(pair.dealer.Send({}, BytesOf("makes the connection")).ok());
  ASSERT_TRUE(Receive(pair.router));
  ASSERT_TRUE(pair.dealer.Send({}, BytesOf("finds it there")).ok());
  EXPECT_THAT(CongestionControlsTo(ParseEndpoint(pair.endpoint, false)->port), testing::ElementsAre("reno"));
}

TEST(Connections, DealersTellWhereTheyComeFromAndThatTheyBroke) {
  for (const std::string host : {"127.0.0.1", "[::1]"}) {
    Context context;
    std::optional<Socket> router = Socket::Router(context).value();
    const Result<std::string> bound = router->Bind("tcp://" + host + ":*");
    if (!bound.ok()) continue;  // no IPv6
    Socket dealer = Socket::Dealer(context).value();
    const auto breaks = [&] { return dealer.TakeBroken(); };
    EXPECT_EQ(dealer.local_host(), "");
    ASSERT_TRUE(dealer.Connect(*bound).ok());
    ASSERT_TRUE(dealer.Send({}, BytesOf("makes the connection")).ok());
    ASSERT_TRUE(Receive(*router));
    EXPECT_EQ(dealer.local_host(), host);
    EXPECT_FALSE(dealer.TakeBroken());
    router.reset();
    EXPECT_TRUE(Until(dealer, breaks));
    EXPECT_TRUE(Until(dealer, breaks)) << "and it cannot be made again";
  }
}

}  // namespace
}  // namespace slabstream
