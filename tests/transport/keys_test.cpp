// Encrypted connections: who is admitted, as whom, and how a connection ends whose key is no longer wanted.
#include "common/transport/keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "common/transport/authenticator.h"
#include "common/transport/socket.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPatience = std::chrono::seconds(30);  // what should happen happens long before; else the test fails
constexpr char kPlane[] = "test";

std::vector<std::byte> BytesOf(std::string_view text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}
std::string TextOf(const Incoming& incoming) {
  const auto text = incoming.parts.at(0).span();
  return {reinterpret_cast<const char*>(text.data()), text.size()};
}

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

class EncryptedTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(router_.ok());
    const Result<std::string> bound = router_->Bind("tcp://127.0.0.1:*");
    ASSERT_TRUE(bound.ok()) << bound.status().message();
    endpoint_ = *bound;
  }

  Socket Connected(const ClientKeys& keys) {
    SocketOptions options;
    options.handshake = handshake_;
    options.client_keys = keys;
    Result<Socket> dealer = Socket::Dealer(context_, options);
    EXPECT_TRUE(dealer.ok() && dealer->Connect(endpoint_).ok());
    return *std::move(dealer);
  }
  Socket ConnectedAs(const KeyPair& own) { return Connected({server_.public_key, own}); }

  // The next message of the router. Others whose messages must not come have had their time when it comes.
  std::optional<Incoming> Receive(Duration patience = kPatience) {
    const Time limit = MonotonicNow() + patience;
    const std::array<Socket*, 1> sockets = {&*router_};
    while (MonotonicNow() < limit) {
      if (std::optional<Incoming> incoming = router_->TryReceive()) return incoming;
      Wait(sockets, nullptr, milliseconds(20));
    }
    return std::nullopt;
  }

  Duration handshake_ = kPatience;  // of sockets that connect
  const KeyPair server_ = MakeKeyPair(), friend_ = MakeKeyPair(), stranger_ = MakeKeyPair();
  Context context_;
  Result<Socket> router_ = [this] {
    SocketOptions options;
    options.server_keys = ServerKeys{server_.secret_key, kPlane};
    return Socket::Router(context_, options);
  }();
  std::string endpoint_;
};

TEST_F(EncryptedTest, UsersAreKnownByTheirKeys) {
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key, stranger_.public_key});
  Socket one = ConnectedAs(friend_), two = ConnectedAs(stranger_);
  for (auto& [socket, keys] : {std::pair(&one, friend_), std::pair(&two, stranger_)}) {
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(socket->Send({}, BytesOf("hello")).ok());
      const std::optional<Incoming> incoming = Receive();
      ASSERT_TRUE(incoming);
      EXPECT_EQ(TextOf(*incoming), "hello");
      EXPECT_EQ(incoming->user, keys.public_key);
      EXPECT_TRUE(router_->Send(incoming->identity, BytesOf("you")).ok());
    }
  }
}

// Each of these sends first; only the friend's message comes.
TEST_F(EncryptedTest, OthersAreNotHeard) {
  context_.authenticator().AdmitOnly(kPlane, {friend_.public_key});
  Socket unknown = ConnectedAs(stranger_);
  Socket deceived = Connected({MakeKeyPair().public_key, friend_});  // expects another server
  Result<Socket> plain = Socket::Dealer(context_);
  ASSERT_TRUE(plain.ok() && plain->Connect(endpoint_).ok());
  for (Socket* socket : {&unknown, &deceived, &*plain}) ASSERT_TRUE(socket->Send({}, BytesOf("let me in")).ok());
  Socket known = ConnectedAs(friend_);
  ASSERT_TRUE(known.Send({}, BytesOf("hello")).ok());
  for (int i = 0; i < 3; ++i) {
    const std::optional<Incoming> incoming = Receive();
    ASSERT_TRUE(incoming);
    EXPECT_EQ(TextOf(*incoming), "hello");
    ASSERT_TRUE(known.Send({}, BytesOf("hello")).ok());
  }
}

TEST_F(EncryptedTest, NobodyIsAdmittedToAPlaneThatNamesNobody) {
  Socket early = ConnectedAs(friend_);
  ASSERT_TRUE(early.Send({}, BytesOf("too early")).ok());
  EXPECT_FALSE(Receive(milliseconds(300)));
  context_.authenticator().Admit(kPlane, friend_.public_key);
  EXPECT_TRUE(early.refused());
  Socket again = ConnectedAs(friend_);
  ASSERT_TRUE(again.Send({}, BytesOf("hello")).ok());
  const std::optional<Incoming> incoming = Receive();
  ASSERT_TRUE(incoming);
  EXPECT_EQ(TextOf(*incoming), "hello");
  EXPECT_FALSE(again.refused());
}

TEST_F(EncryptedTest, APatientPlaneAdmitsWhoeverBecomesKnown) {
  for (const Duration patience : {kPatience, Duration(milliseconds(60))}) {  // after the short one it tries again
    handshake_ = 2 * patience;
    const KeyPair late = MakeKeyPair();
    context_.authenticator().SetPatience(kPlane, patience);
    Socket early = ConnectedAs(late);
    ASSERT_TRUE(early.Send({}, BytesOf("hello")).ok());
    EXPECT_FALSE(Receive(milliseconds(300)));
    context_.authenticator().Admit(kPlane, late.public_key);
    const std::optional<Incoming> incoming = Receive();
    ASSERT_TRUE(incoming);
    EXPECT_EQ(incoming->user, late.public_key);
  }
}

TEST_F(EncryptedTest, ConnectionsOfAKeyThatIsRevokedEnd) {
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
  // The router notices when it sends: nobody of that identity is there.
  const Time limit = MonotonicNow() + kPatience;
  while (router_->Send(last->identity, BytesOf("are you there?")).ok() && MonotonicNow() < limit) (void)Receive(milliseconds(10));
  EXPECT_LT(MonotonicNow(), limit);
  ASSERT_TRUE(goes.Send({}, BytesOf("and again")).ok());  // after another handshake, which fails
  EXPECT_TRUE(router_->Send(other->identity, BytesOf("you stay")).ok());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(stays.Send({}, BytesOf("hello")).ok());
    const std::optional<Incoming> incoming = Receive();
    ASSERT_TRUE(incoming);
    EXPECT_EQ(incoming->user, friend_.public_key);
  }
}

}  // namespace
}  // namespace slabstream
