// Sealed connections between sockets: what passes over the network, and what somebody on the network can do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "common/transport/sealing.h"
#include "tests/common/transport/keyed_socket_test.h"
#include "tests/common/transport/tcp_relay.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

class SealedSocketTest : public KeyedSocketTest {
 protected:
  SealedSocketTest() : KeyedSocketTest(true) {}
  void SetUp() override {
    KeyedSocketTest::SetUp();
    context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  }
  Socket ConnectedTo(const TcpRelay& network) { return Connected(network.endpoint(), {.client_keys = KeysOf(friend_)}); }
  void ExpectNotHeardAgain(const TcpRelay& network, const std::vector<std::string>& pieces) {
    std::atomic<bool> over = false;
    std::jthread again([&] {
      EXPECT_TRUE(network.Replay(pieces));
      over = true;
    });
    while (!over) EXPECT_FALSE(Receive(milliseconds(10))) << "it was heard again";
  }
};

TEST_F(SealedSocketTest, MessagesArriveInOrderWithTheirSendersKey) {
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key, stranger_.public_key});
  for (const KeyPair& keys : {friend_, stranger_}) {
    Socket socket = ConnectedAs(keys);
    const Bytes payload(std::vector<std::byte>(std::size_t{20} << 20, std::byte{7}));  // more frames than the router lets wait
    ASSERT_TRUE(socket.Send({}, BytesOf("image"), payload).ok());
    ASSERT_TRUE(socket.Send({}, BytesOf("after it")).ok());
    const std::optional<Incoming> image = Receive();
    ASSERT_TRUE(image);
    EXPECT_EQ(image->user, keys.public_key);
    EXPECT_EQ(TextOf(image->header()), "image");
    ASSERT_EQ(image->parts.size(), 2U);
    EXPECT_TRUE(std::ranges::equal(image->parts[1].span(), payload.span()));
    EXPECT_EQ(ReceiveText(), "after it");
  }
}

TEST_F(SealedSocketTest, TheNetworkSeesNoMessage) {
  TcpRelay network(port());
  Socket dealer = ConnectedTo(network);
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
  Socket dealer = ConnectedTo(network);
  ExpectHeard(dealer, "once");
  const std::vector<std::string> once = network.Pieces();
  // The ticket is still that of the seal: the connection comes about, and ends at the first frame.
  ExpectNotHeardAgain(network, once);
  ExpectHeard(dealer, "and this");
  // Later seals make the ticket void.
  Socket later = ConnectedAs(friend_);
  ExpectHeard(later, "later");
  std::jthread([&] { EXPECT_TRUE(network.Replay(once)); }).join();
  ExpectHeard(later, "and this");
  ASSERT_TRUE(dealer.Send({}, BytesOf("of the earlier seal")).ok());
  EXPECT_FALSE(Receive(milliseconds(300)));
}

// What ended connections needed is given back; what was heard of them is still known.
TEST_F(SealedSocketTest, WhatWasRecordedIsNotHeardAgainAfterConnectionsWereEnded) {
  TcpRelay network(port());
  Socket dealer = ConnectedTo(network);
  ExpectHeard(dealer, "once");
  const std::vector<std::string> once = network.Pieces();
  router_->EndConnections(friend_.public_key);
  ExpectNotHeardAgain(network, once);
  EXPECT_TRUE(Until(*router_, [&] {
    EXPECT_FALSE(router_->TryReceive());
    return network.connections() >= 2;
  }));
  ExpectHeard(dealer, "and this");
}

TEST_F(SealedSocketTest, AnAlteredMessageEndsTheConnectionAndLaterOnesArrive) {
  TcpRelay network(port());
  Socket dealer = ConnectedTo(network);
  ExpectHeard(dealer, "before");
  network.AlterAfter(3 * kSealedFrameBytes);
  ASSERT_TRUE(dealer.Send({}, BytesOf("altered"), Bytes(std::vector<std::byte>(6 * kSealedFrameBytes))).ok());
  EXPECT_TRUE(Until(*router_, [&] {
    EXPECT_FALSE(router_->TryReceive());
    return network.connections() >= 2;
  }));
  ExpectHeard(dealer, "after");
}

}  // namespace
}  // namespace slabstream
