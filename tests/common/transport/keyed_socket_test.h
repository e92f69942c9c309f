// A router with keys, CURVE or sealed, and dealers with keys that it knows or not.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "common/transport/authenticator.h"
#include "common/transport/keys.h"
#include "common/transport/socket.h"
#include "tests/common/transport/conversation.h"

namespace slabstream {

class KeyedSocketTest : public testing::Test {
 protected:
  static constexpr char kPlane[] = "test";

  explicit KeyedSocketTest(bool sealed) : sealed_(sealed) {}
  void SetUp() override {
    ASSERT_TRUE(router_.ok());
    const Result<std::string> bound = router_->Bind("tcp://127.0.0.1:*");
    ASSERT_TRUE(bound.ok()) << bound.status().message();
    endpoint_ = *bound;
  }

  ClientKeys KeysOf(const KeyPair& own) const { return {.server_key = server_.public_key, .own = own, .sealed = sealed_}; }
  Socket Connected(const std::string& endpoint, const SocketOptions& options) {
    Result<Socket> dealer = Socket::Dealer(context_, options);
    EXPECT_TRUE(dealer.ok() && dealer->Connect(endpoint).ok());
    return *std::move(dealer);
  }
  int port() const { return std::stoi(endpoint_.substr(endpoint_.rfind(':') + 1)); }
  Socket ConnectedAs(const KeyPair& own) { return Connected(endpoint_, {.client_keys = KeysOf(own)}); }

  std::optional<Incoming> Receive(Duration patience = kPatience) { return slabstream::Receive(*router_, patience); }
  // The header of the next message.
  std::string ReceiveText() {
    const std::optional<Incoming> incoming = Receive();
    return incoming ? TextOf(incoming->header()) : "nothing came";
  }
  // The next message is this one. What must not come has had its time then.
  void ExpectHeard(Socket& socket, const std::string& text) {
    ASSERT_TRUE(socket.Send({}, BytesOf(text)).ok());
    EXPECT_EQ(ReceiveText(), text);
  }

  const bool sealed_;
  const KeyPair server_ = MakeKeyPair(), friend_ = MakeKeyPair(), stranger_ = MakeKeyPair();
  Context context_;
  Result<Socket> router_ =
      Socket::Router(context_, {.server_keys = ServerKeys{.secret_key = server_.secret_key, .plane = kPlane, .sealed = sealed_}});
  std::string endpoint_;
};

}  // namespace slabstream
