// Connections whose other end behaves as no browser does.
#include "common/http/http.h"

#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>
#include <future>
#include <istream>
#include <string>
#include <thread>
#include <utility>

namespace slabstream {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;

// Sends so many bytes at once. Keeps why it was closed.
class Session final : public WebSocketSession {
 public:
  Session(std::size_t bytes, std::promise<std::string> closed) : bytes_(bytes), closed_(std::move(closed)) {}
  void OnOpen(WebSocketPeer& peer) override {
    if (bytes_ > 0) peer.SendBinary("", std::make_shared<const std::vector<std::byte>>(bytes_));
  }
  void OnText(std::string_view) override {}
  void OnClosed(const std::string& reason) override { closed_.set_value(reason); }

 private:
  const std::size_t bytes_;
  std::promise<std::string> closed_;
};

class Server final : public HttpApplication {
 public:
  // `bytes`: that a WebSocket's session sends.
  explicit Server(const HttpLimits& limits, std::size_t bytes = 0) : bytes_(bytes), work_(asio::make_work_guard(io_)) {
    server_ = HttpServer::Start(io_, "127.0.0.1", 0, std::nullopt, limits, *this).value();
    thread_ = std::thread([this] { io_.run(); });
  }
  ~Server() override {
    asio::post(io_, [this] {
      server_->Stop();
      work_.reset();
    });
    thread_.join();
  }

  std::uint16_t port() const { return server_->port(); }
  std::future<std::string>& closed() { return closed_; }  // of the only session

  void Handle(HttpRequest, std::function<void(HttpReply)> reply) override { reply({.status = 404}); }
  std::variant<HttpReply, WebSocketAccepted> Accept(const HttpRequest&) override {
    std::promise<std::string> closed;
    closed_ = closed.get_future();
    return WebSocketAccepted{.session = std::make_shared<Session>(bytes_, std::move(closed)), .subprotocol = "any"};
  }
  std::vector<std::pair<std::string, std::string>> CommonHeaders() const override { return {}; }
  void CountRefusal(std::string_view) override {}

 private:
  const std::size_t bytes_;
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  std::unique_ptr<HttpServer> server_;
  std::future<std::string> closed_;
  std::thread thread_;
};

class Peer {
 public:
  explicit Peer(const Server& server) { socket_.connect({asio::ip::address_v4::loopback(), server.port()}); }
  void Upgrade() {
    asio::write(socket_, asio::buffer(std::string("GET / HTTP/1.1\r\nHost: a\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                                                  "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n")));
    const std::size_t head = asio::read_until(socket_, buffer_, "\r\n\r\n");
    buffer_.consume(head);
  }

  // Sends bytes as they are, and then one of `more` again and again until the other end closes the connection. What it says before that.
  std::string Drip(const std::string& bytes, const std::string& more) {
    asio::write(socket_, asio::buffer(bytes));
    std::future<std::string> said = std::async(std::launch::async, [this] {
      boost::system::error_code end;
      asio::read(socket_, buffer_, end);
      return Take(buffer_.size());
    });
    boost::system::error_code error;
    while (said.wait_for(milliseconds(1)) != std::future_status::ready) asio::write(socket_, asio::buffer(more), error);
    return said.get();
  }
  // The payload of the next ping.
  std::string Ping() {
    const std::string head = Take(2);
    EXPECT_EQ(head[0], '\x89');
    return Take(std::size_t(head[1]));
  }
  // A short frame, masked by zeros. False: the connection has ended.
  bool Send(int opcode, const std::string& payload) {
    boost::system::error_code error;
    asio::write(socket_, asio::buffer(std::string{char(0x80 | opcode), char(0x80 | payload.size())} + std::string(4, '\0') + payload),
                error);
    return !error;
  }

 private:
  std::string Take(std::size_t bytes) {
    if (buffer_.size() < bytes) asio::read(socket_, buffer_, asio::transfer_at_least(bytes - buffer_.size()));
    std::string taken(bytes, '\0');
    std::istream(&buffer_).read(taken.data(), std::streamsize(bytes));
    return taken;
  }

  asio::io_context io_;
  asio::ip::tcp::socket socket_{io_};
  asio::streambuf buffer_;
};

constexpr Duration kForEver = std::chrono::hours(1);
constexpr int kText = 1, kPong = 10;
constexpr char kUnanswered[] = "it did not answer a ping in time";

// Sends a frame again and again until the session ends, and says why it did.
std::string EndOfSending(Server& server, Peer& peer, int opcode, const std::string& payload) {
  while (server.closed().wait_for(milliseconds(1)) != std::future_status::ready) peer.Send(opcode, payload);
  return server.closed().get();
}

TEST(WebSocketTest, WhatAPageSendsIsNoAnswerToAPing) {
  Server server({.silence = milliseconds(100)});
  Peer peer(server);
  peer.Upgrade();
  EXPECT_EQ(EndOfSending(server, peer, kText, "a view"), kUnanswered);
}

TEST(WebSocketTest, APongOfAnotherPingIsNoAnswer) {
  for (const std::string& payload : {std::string(), std::string("0"), std::string(125, 'x')}) {
    Server server({.silence = milliseconds(100)});
    Peer peer(server);
    peer.Upgrade();
    EXPECT_EQ(EndOfSending(server, peer, kPong, payload), kUnanswered) << payload;
  }
}

TEST(WebSocketTest, WhoAnswersPingsStaysAndPingsDiffer) {
  Server server({.silence = milliseconds(1500)});
  Peer peer(server);
  peer.Upgrade();
  std::string before;
  for (int i = 0; i < 3; ++i) {
    const std::string ping = peer.Ping();
    EXPECT_NE(ping, before);
    EXPECT_TRUE(peer.Send(kPong, ping));
    before = ping;
  }
  EXPECT_EQ(server.closed().wait_for(milliseconds(0)), std::future_status::timeout);
  EXPECT_EQ(EndOfSending(server, peer, kPong, before), kUnanswered);  // it has answered before, and then says the same
}

TEST(WebSocketTest, AMessageLeavesInTimeWhateverThePageSends) {
  Server server({.writing = milliseconds(100), .silence = kForEver}, std::size_t{64} << 20);
  Peer peer(server);
  peer.Upgrade();
  EXPECT_EQ(EndOfSending(server, peer, kText, "a view"), "a message did not leave in time");
}

TEST(HttpTest, ARequestArrivesWithinItsTimeByteByByteOrNot) {
  for (const char* begin : {"", "GET / HTTP/1.1\r\nHost: a\r\nX: ", "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1000000\r\n\r\n"}) {
    Server server({.header_bytes = std::size_t{1} << 20, .reading = milliseconds(100)});
    Peer peer(server);
    EXPECT_EQ(peer.Drip(begin, "x"), "") << begin;
  }
}

}  // namespace
}  // namespace slabstream
