// Sealed connections between sockets: who is admitted, what passes over the network, and what somebody on the network can do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "common/transport/authenticator.h"
#include "common/transport/sealing.h"
#include "common/transport/socket.h"
#include "tests/transport/tcp_relay.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr Duration kPatience = std::chrono::seconds(30);  // what should happen happens long before; else the test fails
constexpr char kPlane[] = "test";

std::vector<std::byte> BytesOf(std::string_view text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}
std::string TextOf(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.span().data()), bytes.size()}; }

class SealedSocketTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(router_.ok());
    const Result<std::string> bound = router_->Bind("tcp://127.0.0.1:*");
    ASSERT_TRUE(bound.ok()) << bound.status().message();
    endpoint_ = *bound;
    context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  }

  Socket Connected(const std::string& endpoint, const SocketOptions& options) {
    Result<Socket> dealer = Socket::Dealer(context_, options);
    EXPECT_TRUE(dealer.ok() && dealer->Connect(endpoint).ok());
    return *std::move(dealer);
  }
  Socket ConnectedAs(const KeyPair& own, const std::string& endpoint) {
    return Connected(endpoint, {.client_keys = ClientKeys{.server_key = server_.public_key, .own = own, .sealed = true}});
  }
  Socket ConnectedAs(const KeyPair& own) { return ConnectedAs(own, endpoint_); }
  int port() const { return std::stoi(endpoint_.substr(endpoint_.rfind(':') + 1)); }

  std::optional<Incoming> Receive(Duration patience = kPatience) {
    const Time limit = MonotonicNow() + patience;
    const std::array<Socket*, 1> sockets = {&*router_};
    while (MonotonicNow() < limit) {
      if (std::optional<Incoming> incoming = router_->TryReceive()) return incoming;
      Wait(sockets, nullptr, milliseconds(20));
    }
    return std::nullopt;
  }
  // The header of the next message.
  std::string ReceiveText() {
    const std::optional<Incoming> incoming = Receive();
    return incoming ? TextOf(incoming->parts.at(0)) : "nothing came";
  }
  // The next message is this one. What must not come has had its time then.
  void ExpectHeard(Socket& socket, const std::string& text) {
    ASSERT_TRUE(socket.Send({}, BytesOf(text)).ok());
    EXPECT_EQ(ReceiveText(), text);
  }

  const KeyPair server_ = MakeKeyPair(), friend_ = MakeKeyPair(), stranger_ = MakeKeyPair();
  Context context_;
  Result<Socket> router_ =
      Socket::Router(context_, {.server_keys = ServerKeys{.secret_key = server_.secret_key, .plane = kPlane, .sealed = true}});
  std::string endpoint_;
};

TEST_F(SealedSocketTest, MessagesArriveInOrderWithTheirSendersKey) {
  context_.authenticator().Admit(kPlane, stranger_.public_key);
  for (const KeyPair& keys : {friend_, stranger_}) {
    Socket socket = ConnectedAs(keys);
    const Bytes payload(std::vector<std::byte>(std::size_t{20} << 20, std::byte{7}));  // more frames than the router lets wait
    ASSERT_TRUE(socket.Send({}, BytesOf("image"), payload).ok());
    ASSERT_TRUE(socket.Send({}, BytesOf("after it")).ok());
    const std::optional<Incoming> image = Receive();
    ASSERT_TRUE(image);
    EXPECT_EQ(image->user, keys.public_key);
    EXPECT_EQ(TextOf(image->parts.at(0)), "image");
    ASSERT_EQ(image->parts.size(), 2U);
    EXPECT_TRUE(std::ranges::equal(image->parts[1].span(), payload.span()));
    EXPECT_EQ(ReceiveText(), "after it");
    EXPECT_FALSE(router_->Send(image->identity, BytesOf("back")).ok()) << "they go one way";
  }
}

TEST_F(SealedSocketTest, OthersAreNotHeard) {
  const ClientKeys curve{.server_key = server_.public_key, .own = friend_};
  const ClientKeys deceived{.server_key = MakeKeyPair().public_key, .own = friend_, .sealed = true};
  // The name of one, but the secret of another one.
  const ClientKeys false_name{.server_key = server_.public_key, .own = {friend_.public_key, stranger_.secret_key}, .sealed = true};
  std::vector<Socket> others;
  others.push_back(ConnectedAs(stranger_));
  others.push_back(Connected(endpoint_, {}));
  for (const ClientKeys& keys : {curve, deceived, false_name}) others.push_back(Connected(endpoint_, {.client_keys = keys}));
  for (Socket& socket : others) ASSERT_TRUE(socket.Send({}, BytesOf("let me in")).ok());
  Socket known = ConnectedAs(friend_);
  for (int i = 0; i < 3; ++i) ExpectHeard(known, "hello");
  const Time limit = MonotonicNow() + kPatience;
  for (const std::size_t refused : {0, 3, 4}) {
    while (!others[refused].refused() && MonotonicNow() < limit) (void)Receive(milliseconds(10));
    EXPECT_TRUE(others[refused].refused()) << refused;
  }
  EXPECT_FALSE(Receive(milliseconds(100)));
}

TEST_F(SealedSocketTest, APatientPlaneAdmitsWhoeverBecomesKnown) {
  context_.authenticator().SetPatience(kPlane, kPatience);
  Socket early = ConnectedAs(stranger_);
  ASSERT_TRUE(early.Send({}, BytesOf("hello")).ok());
  Socket known = ConnectedAs(friend_);
  ExpectHeard(known, "I am known");
  context_.authenticator().Admit(kPlane, stranger_.public_key);
  EXPECT_EQ(ReceiveText(), "hello");
}

TEST_F(SealedSocketTest, ConnectionsOfAKeyThatIsRevokedEnd) {
  context_.authenticator().Admit(kPlane, stranger_.public_key);
  Socket stays = ConnectedAs(friend_), goes = ConnectedAs(stranger_);
  ExpectHeard(stays, "hello");
  ExpectHeard(goes, "hello");
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  router_->EndConnections(stranger_.public_key);
  const Time limit = MonotonicNow() + kPatience;
  while (!goes.refused() && MonotonicNow() < limit) {
    (void)goes.Send({}, BytesOf("and again"));
    EXPECT_FALSE(Receive(milliseconds(10)));
  }
  EXPECT_TRUE(goes.refused()) << "it was not connected anew";
  for (int i = 0; i < 3; ++i) ExpectHeard(stays, "hello");
}

TEST_F(SealedSocketTest, TheNetworkSeesNoMessage) {
  TcpRelay network(port());
  Socket dealer = ConnectedAs(friend_, network.endpoint());
  const std::string header = "a header that nobody else has", payload = "a payload that nobody else has";
  ASSERT_TRUE(dealer.Send({}, BytesOf(header), Bytes(BytesOf(payload))).ok());
  EXPECT_EQ(ReceiveText(), header);
  const std::string passed = network.Recorded();
  EXPECT_THAT(passed, HasSubstr(friend_.public_key)) << "nothing was recorded";
  EXPECT_EQ(passed.find(header.substr(0, 8)), std::string::npos);
  EXPECT_EQ(passed.find(payload.substr(0, 8)), std::string::npos);
  for (const std::string& secret : {friend_.secret_key, server_.secret_key}) EXPECT_EQ(passed.find(secret), std::string::npos);
}

TEST_F(SealedSocketTest, WhatWasRecordedIsNotHeardAgain) {
  TcpRelay network(port());
  Socket dealer = ConnectedAs(friend_, network.endpoint());
  ExpectHeard(dealer, "once");
  const std::vector<std::string> once = network.Pieces();
  // The ticket is still that of the session: the connection comes about, and ends at the first frame.
  std::atomic<bool> over = false;
  std::jthread again([&] {
    EXPECT_TRUE(network.Replay(once));
    over = true;
  });
  while (!over) EXPECT_FALSE(Receive(milliseconds(10))) << "it was heard again";
  again.join();
  ExpectHeard(dealer, "and this");
  // Later sessions make the ticket void.
  Socket later = ConnectedAs(friend_);
  ExpectHeard(later, "later");
  std::jthread([&] { EXPECT_TRUE(network.Replay(once)); }).join();
  ExpectHeard(later, "and this");
  ASSERT_TRUE(dealer.Send({}, BytesOf("of the earlier session")).ok());
  EXPECT_FALSE(Receive(milliseconds(300)));
}

TEST_F(SealedSocketTest, AnAlteredMessageEndsTheConnectionAndLaterOnesArrive) {
  TcpRelay network(port());
  Socket dealer = ConnectedAs(friend_, network.endpoint());
  ExpectHeard(dealer, "before");
  network.AlterAfter(3 * kSealedFrameBytes);
  ASSERT_TRUE(dealer.Send({}, BytesOf("altered"), Bytes(std::vector<std::byte>(6 * kSealedFrameBytes))).ok());
  const Time limit = MonotonicNow() + kPatience;
  while (network.connections() < 2 && MonotonicNow() < limit) EXPECT_FALSE(Receive(milliseconds(10)));
  EXPECT_EQ(network.connections(), 2);
  ExpectHeard(dealer, "after");
}

}  // namespace
}  // namespace slabstream
