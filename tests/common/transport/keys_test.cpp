// Keys, and connections with keys, CURVE or sealed: who is admitted, as whom, and how a connection ends whose key is no longer wanted.
#include "common/transport/keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/common/transport/keyed_socket_test.h"
#include "tests/common/transport/tcp_relay.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

TEST(Keys, PairsBelongTogetherAndDiffer) {
  const KeyPair one = MakeKeyPair(), other = MakeKeyPair();
  EXPECT_TRUE(IsKey(one.public_key));
  EXPECT_TRUE(IsKey(one.secret_key));
  EXPECT_EQ(PublicKeyOf(one.secret_key), one.public_key);
  EXPECT_NE(one.secret_key, other.secret_key);
  EXPECT_THAT(IdOfKey(one.public_key), testing::MatchesRegex("[0-9a-f]{8}"));
  EXPECT_NE(IdOfKey(one.public_key), IdOfKey(other.public_key));
  for (const std::string& text : {std::string(), std::string(39, 'a'), std::string(41, 'a'), std::string(39, 'a') + '"'}) {
    EXPECT_FALSE(IsKey(text)) << text;
    EXPECT_FALSE(PublicKeyOf(text)) << text;
  }
}

// Every 85th key of CURVE's would begin so: of 1000, one in 10^5 runs would show none.
TEST(Keys, CommandLinesTakeThemForNoOption) {
  for (int i = 0; i < 1000; ++i) EXPECT_NE(MakeKeyPair().public_key.front(), '-');
}

class ConnectionsWithKeys : public KeyedSocketTest, public testing::WithParamInterface<bool> {
 protected:
  ConnectionsWithKeys() : KeyedSocketTest(GetParam()) {}
  bool IsRefused(Socket& socket) {
    return Until(*router_, [&] { return !router_->TryReceive() && socket.refused(); });
  }
};

TEST_P(ConnectionsWithKeys, UsersAreKnownByTheirKeys) {
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key, stranger_.public_key});
  Socket one = ConnectedAs(friend_), two = ConnectedAs(stranger_);
  for (auto& [socket, keys] : {std::pair(&one, friend_), std::pair(&two, stranger_)}) {
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(socket->Send({}, BytesOf("hello")).ok());
      const std::optional<Incoming> incoming = Receive();
      ASSERT_TRUE(incoming);
      EXPECT_EQ(TextOf(incoming->header()), "hello");
      EXPECT_EQ(incoming->user, keys.public_key);
      EXPECT_EQ(router_->Send(incoming->identity, BytesOf("you")).ok(), !sealed_) << "sealed ones go one way";
    }
  }
}

// Each of these sends first; only the friend's message comes. A dealer that is refused before it sends cannot send: that is no failure.
TEST_P(ConnectionsWithKeys, OthersAreNotHeard) {
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  ClientKeys other_way = KeysOf(friend_), deceived = KeysOf(friend_), false_name = KeysOf(friend_);
  other_way.sealed = !sealed_;
  deceived.server_key = MakeKeyPair().public_key;
  false_name.own.secret_key = stranger_.secret_key;
  std::vector<Socket> others;
  others.push_back(ConnectedAs(stranger_));
  others.push_back(Connected(endpoint_, {}));
  for (const ClientKeys& keys : {other_way, deceived, false_name}) others.push_back(Connected(endpoint_, {.client_keys = keys}));
  for (Socket& socket : others) (void)socket.Send({}, BytesOf("let me in"));
  Socket known = ConnectedAs(friend_);
  for (int i = 0; i < 3; ++i) ExpectHeard(known, "hello");
  EXPECT_TRUE(IsRefused(others[0]));
  if (sealed_) {  // with CURVE the handshake itself fails, and nobody is told
    for (const std::size_t refused : {3, 4}) EXPECT_TRUE(IsRefused(others[refused])) << refused;
  }
  EXPECT_FALSE(Receive(milliseconds(100)));
}

// Somebody on the network says once more what the friend has said: in a connection of their own, and then in the friend's.
TEST_P(ConnectionsWithKeys, WhatWasRecordedIsNotHeardAgain) {
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  TcpRelay network(port());
  Socket dealer = Connected(network.endpoint(), {.client_keys = KeysOf(friend_)});
  ExpectHeard(dealer, "once");
  const std::vector<std::string> once = network.Pieces();
  std::atomic<bool> over = false;
  std::jthread again([&] {
    EXPECT_TRUE(network.Replay(once)) << "the connection does not end";
    over = true;
  });
  while (!over) EXPECT_FALSE(Receive(milliseconds(10))) << "it was heard again";
  again.join();
  network.RepeatNext();
  ExpectHeard(dealer, "and this");
  EXPECT_TRUE(Until(*router_, [&] {
    EXPECT_FALSE(router_->TryReceive()) << "it was heard twice";
    return network.connections() >= 2;
  })) << "the connection does not end";
  ExpectHeard(dealer, "later");
}

TEST_P(ConnectionsWithKeys, NobodyIsAdmittedToAPlaneThatNamesNobody) {
  Socket early = ConnectedAs(friend_);
  (void)early.Send({}, BytesOf("too early"));  // fails if it is refused by then
  EXPECT_FALSE(Receive(milliseconds(300)));
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  EXPECT_TRUE(early.refused());
  Socket again = ConnectedAs(friend_);
  ExpectHeard(again, "hello");
  EXPECT_FALSE(again.refused());
}

TEST_P(ConnectionsWithKeys, APatientPlaneAdmitsWhoeverBecomesKnown) {
  for (const Duration patience : {kPatience, Duration(milliseconds(60))}) {  // after the short one it tries again
    const KeyPair late = MakeKeyPair();
    context_.authenticator().SetPatience(kPlane, patience);
    Socket early = Connected(endpoint_, {.handshake = 2 * patience, .client_keys = KeysOf(late)});
    ASSERT_TRUE(early.Send({}, BytesOf("hello")).ok());
    EXPECT_FALSE(Receive(milliseconds(300)));
    context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
    Socket known = ConnectedAs(friend_);
    ExpectHeard(known, "I am known");
    context_.authenticator().AdmitOnly(kPlane, {friend_.public_key, late.public_key});
    const std::optional<Incoming> incoming = Receive();
    ASSERT_TRUE(incoming);
    EXPECT_EQ(incoming->user, late.public_key);
  }
}

TEST_P(ConnectionsWithKeys, ThoseOfAKeyThatIsRevokedEnd) {
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key, stranger_.public_key});
  Socket stays = ConnectedAs(friend_), goes = ConnectedAs(stranger_);
  ASSERT_TRUE(goes.Send({}, BytesOf("hello")).ok());
  const std::optional<Incoming> last = Receive();
  ASSERT_TRUE(last);
  ASSERT_TRUE(stays.Send({}, BytesOf("hello")).ok());
  const std::optional<Incoming> other = Receive();
  ASSERT_TRUE(other);
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  router_->EndConnections(stranger_.public_key);
  if (!sealed_) {
    const auto sends_to_last = [&] {
      (void)router_->TryReceive();
      return router_->Send(last->identity, BytesOf("are you there?"));
    };
    EXPECT_TRUE(SendsUntil(StatusCode::kUnavailable, *router_, sends_to_last));
    EXPECT_TRUE(router_->Send(other->identity, BytesOf("you stay")).ok());
  }
  EXPECT_TRUE(Until(*router_, [&] {
    (void)goes.Send({}, BytesOf("and again"));
    EXPECT_FALSE(router_->TryReceive());
    return goes.refused();
  })) << "it was not connected anew";
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(stays.Send({}, BytesOf("hello")).ok());
    const std::optional<Incoming> incoming = Receive();
    ASSERT_TRUE(incoming);
    EXPECT_EQ(incoming->user, friend_.public_key);
  }
}

INSTANTIATE_TEST_SUITE_P(CurveAndSealed, ConnectionsWithKeys, testing::Bool());

}  // namespace
}  // namespace slabstream
