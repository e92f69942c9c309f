// Whose images a worker takes: of those that the coordinator has named, until it says that they have gone.
#include "worker/known_peers.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace slabstream {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPatience = std::chrono::seconds(30);  // what should happen happens long before; else the test fails
constexpr char kPlane[] = "images";

class KnownPeersTest : public testing::Test {
 protected:
  void SetUp() override {
    endpoint_ = images_.Bind("tcp://127.0.0.1:*").value();
    known_.ForgetAll();
  }

  Peer PeerOf(WorkerId worker, const KeyPair& keys) const { return {worker, "tcp://127.0.0.1:1", 0, keys.public_key}; }
  Socket ConnectedAs(const KeyPair& own) {
    Socket socket =
        Socket::Dealer(context_, {.client_keys = ClientKeys{.server_key = own_.public_key, .own = own, .sealed = true}}).value();
    EXPECT_TRUE(socket.Connect(endpoint_).ok());
    return socket;
  }
  // The sender of the next message: its key.
  std::string Receive(Duration patience = kPatience) {
    const Time limit = MonotonicNow() + patience;
    const std::array<Socket*, 1> sockets = {&images_};
    while (MonotonicNow() < limit) {
      if (const std::optional<Incoming> incoming = images_.TryReceive()) return incoming->user;
      Wait(sockets, nullptr, milliseconds(20));
    }
    return "nobody";
  }
  void ExpectHeard(Socket& socket, const KeyPair& keys) {
    ASSERT_TRUE(socket.Send({}, std::vector<std::byte>(1)).ok());
    EXPECT_EQ(Receive(), keys.public_key);
  }
  void ExpectEnded(Socket& socket) {
    const Time limit = MonotonicNow() + kPatience;
    while (!socket.refused() && MonotonicNow() < limit) {
      (void)socket.Send({}, std::vector<std::byte>(1));
      EXPECT_EQ(Receive(milliseconds(10)), "nobody");
    }
    EXPECT_TRUE(socket.refused());
  }

  const KeyPair own_ = MakeKeyPair(), one_ = MakeKeyPair(), other_ = MakeKeyPair();
  Context context_;
  Socket images_ =
      Socket::Router(context_, {.server_keys = ServerKeys{.secret_key = own_.secret_key, .plane = kPlane, .sealed = true}}).value();
  KnownPeers known_{&context_.authenticator(), kPlane};
  std::string endpoint_;
};

TEST_F(KnownPeersTest, TheConnectionsOfWhoeverHasGoneEndAndNoOthers) {
  known_.Name(PeerOf(1, one_));
  known_.Name(PeerOf(2, other_));
  Socket one = ConnectedAs(one_), other = ConnectedAs(other_);
  ExpectHeard(one, one_);
  ExpectHeard(other, other_);
  known_.Gone(std::array<WorkerId, 2>{1, 77}, images_);
  EXPECT_EQ(known_.Find(1), nullptr);
  ExpectEnded(one);
  ASSERT_NE(known_.Find(2), nullptr);
  EXPECT_EQ(known_.Find(2)->images_key, other_.public_key);
  ExpectHeard(other, other_);
}

TEST_F(KnownPeersTest, AProcessThatIsAnotherWorkerByNowKeepsItsConnection) {
  known_.Name(PeerOf(1, one_));
  Socket one = ConnectedAs(one_);
  ExpectHeard(one, one_);
  known_.Name(PeerOf(3, one_));
  known_.Gone(std::array<WorkerId, 1>{1}, images_);
  for (int i = 0; i < 3; ++i) ExpectHeard(one, one_);
  Socket again = ConnectedAs(one_);
  ExpectHeard(again, one_);
}

TEST_F(KnownPeersTest, AfterAnotherRegistrationOnlyThoseNamedSinceMayConnect) {
  known_.Name(PeerOf(1, one_));
  known_.Name(PeerOf(2, other_));
  known_.ForgetAll();
  known_.Name(PeerOf(2, other_));
  Socket one = ConnectedAs(one_), other = ConnectedAs(other_);
  ExpectEnded(one);
  ExpectHeard(other, other_);
}

}  // namespace
}  // namespace slabstream
