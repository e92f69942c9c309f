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
#include "tests/common/transport/conversation.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

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
    ASSERT_TRUE(dealer_->Send("ignored", BytesOf(header), Bytes(BytesOf(payload))).ok());
    ASSERT_TRUE(router_->Send(identity, BytesOf(header), Bytes(BytesOf(payload))).ok());
  }
  for (Socket* socket : {router_.get(), dealer_.get()}) {
    for (int i = 0; i < 100; ++i) {
      const std::optional<Incoming> incoming = Receive(*socket);
      ASSERT_TRUE(incoming);
      EXPECT_EQ(incoming->identity, socket == router_.get() ? identity : "");
      ASSERT_EQ(incoming->parts.size(), i == 0 ? 1U : 2U);  // an empty payload is no part
      EXPECT_EQ(TextOf(incoming->header()), "header " + std::to_string(i));
      if (i > 0) {
        EXPECT_EQ(TextOf(incoming->parts[1].span()), std::string(static_cast<std::size_t>(i) * 97, static_cast<char>(i)));
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
  EXPECT_TRUE(SendsUntil(StatusCode::kOk, *router_, [&] { return watch.expired() ? Status::Ok() : Status::Unavailable("still held"); }));
}

TEST_P(SocketTest, UnknownIdentityIsUnavailable) {
  MAKE_PAIR_OR_SKIP();
  EXPECT_EQ(router_->Send("nobody", BytesOf("header"), Bytes(BytesOf("payload"))).code(), StatusCode::kUnavailable);
  EXPECT_EQ(router_->Send("", BytesOf("header")).code(), StatusCode::kUnavailable);
  ASSERT_FALSE(Introduce().empty());  // and the router still works
}

TEST_P(SocketTest, PeerThatClosesIsNoticed) {
  MAKE_PAIR_OR_SKIP();
  const std::string identity = Introduce();
  ASSERT_TRUE(router_->Send(identity, BytesOf("still there?")).ok());
  dealer_.reset();
  EXPECT_TRUE(SendsUntil(StatusCode::kUnavailable, *router_, [&] { return router_->Send(identity, BytesOf("still there?")); }));
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
  ASSERT_TRUE(SendsUntil(StatusCode::kResourceExhausted, *router_, send));
  for (int i = 0; i < accepted; ++i) {
    const std::optional<Incoming> incoming = Receive(*dealer_);
    ASSERT_TRUE(incoming) << i;
    ASSERT_EQ(incoming->parts.size(), 2U) << "messages are whole though a send was refused between them";
  }
  EXPECT_TRUE(SendsUntil(StatusCode::kOk, *router_, send));
}

// However fast: ZeroMQ by itself notes only now and then that messages were read.
TEST_P(SocketTest, AQueueWhoseMessagesWereReadIsNotFull) {
  SocketOptions options;
  options.send_high_water_mark = options.receive_high_water_mark = 4;
  MAKE_PAIR_OR_SKIP(options);
  const std::string identity = Introduce();
  for (int i = 0; i < 2000; ++i) {
    const Status sent = router_->Send(identity, BytesOf("header"), Bytes(BytesOf("payload")));
    ASSERT_TRUE(sent.ok()) << i << ": " << sent.message();
    ASSERT_TRUE(Receive(*dealer_)) << i;
  }
}

TEST_P(SocketTest, DealerHighWaterMarkIsResourceExhausted) {
  SocketOptions options;
  options.send_high_water_mark = options.receive_high_water_mark = 4;
  MAKE_PAIR_OR_SKIP(options);
  const Bytes payload(std::vector<std::byte>(std::size_t{1} << 20));
  EXPECT_TRUE(SendsUntil(StatusCode::kResourceExhausted, *dealer_, [&] { return dealer_->Send({}, BytesOf("header"), payload); }));
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
  EXPECT_EQ(TextOf(incoming->header()), "first");
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
    EXPECT_EQ(TextOf(incoming->header()), std::to_string(parts));
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

}  // namespace
}  // namespace slabstream
