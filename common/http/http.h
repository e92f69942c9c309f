// HTTP and WebSockets for an application that knows neither sockets nor Boost: an HttpServer reads requests, checks their limits, and
// hands them over as values. All calls between the two are made on the thread that runs the io_context.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"

namespace boost::asio {
class io_context;
}

namespace slabstream {

struct HttpLimits {
  std::size_t header_bytes = std::size_t{16} << 10;
  std::size_t body_bytes = std::size_t{1} << 20;
  std::size_t message_bytes = std::size_t{1} << 20;  // bytes of a WebSocket's message
  std::size_t connections = 256;                     // one more takes the place of the slowest, or is closed at once
  std::size_t connections_an_address = 128;          // the same; so one address alone cannot keep others out
  Duration reading = std::chrono::seconds(30);       // for a request to arrive, also on a connection that waits for one
  Duration writing = std::chrono::seconds(30);       // for a response or message to leave
  Duration silence = std::chrono::seconds(30);       // for a WebSocket to answer a ping; what it sends otherwise is no answer
};

using Gone = std::shared_ptr<std::function<void()>>;

struct HttpRequest {
  std::string method, target;
  std::string host;  // empty: there is none
  std::optional<std::string> origin, authorization;
  std::string accept_encoding;            // empty: there is none
  std::string traceparent;                // empty: there is none
  std::vector<std::string> subprotocols;  // that a WebSocket offers
  std::string body;
  // Never null. An application that works on the reply for long may put a function there: it is called, on the io thread, if the
  // connection closes before the reply.
  Gone gone = std::make_shared<std::function<void()>>();
};

// A body that is made while it leaves. All calls on the io thread.
class BodyStream {
 public:
  virtual ~BodyStream() = default;
  // Calls `next` once, later: with the next bytes; with none, at the end; or with an error, which cuts the connection off.
  virtual void Read(std::function<void(Result<std::string>)> next) = 0;
  // It is no longer read. Drops `next`.
  virtual void Abandon() = 0;
};

struct HttpReply {
  unsigned status = 200;
  std::string type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};  // more of them
  std::shared_ptr<BodyStream> rest = nullptr;  // the rest of the body, if it is not all there; HTTP/1.1 sends it in chunks
};

// The other end of a WebSocket.
class WebSocketPeer {
 public:
  virtual ~WebSocketPeer() = default;
  // Messages leave in the order of the calls.
  virtual void SendText(std::string text) = 0;
  // One message: the head, then the tail.
  virtual void SendBinary(std::string head, std::shared_ptr<const std::vector<std::byte>> tail) = 0;
  virtual void Close(std::uint16_t code, std::string reason) = 0;  // OnClosed follows
};

// This end. OnClosed is the last call, and comes in any case, even if OnOpen never did.
class WebSocketSession {
 public:
  virtual ~WebSocketSession() = default;
  virtual void OnOpen(WebSocketPeer& peer) = 0;
  virtual void OnText(std::string_view text) = 0;
  virtual void OnClosed(const std::string& reason) = 0;  // empty: the other end closed it in an orderly way
};

struct WebSocketAccepted {
  std::shared_ptr<WebSocketSession> session;
  std::string subprotocol;
};

class HttpApplication {
 public:
  virtual ~HttpApplication() = default;
  // `reply` is called once, on the io thread, unless `request.gone` was called before.
  virtual void Handle(HttpRequest request, std::function<void(HttpReply)> reply) = 0;
  virtual std::variant<HttpReply, WebSocketAccepted> Accept(const HttpRequest& request) = 0;
  // What goes into every response.
  virtual std::vector<std::pair<std::string, std::string>> CommonHeaders() const = 0;
  // Counts what the application does not see: "connections", "slow reader", "header", ...
  virtual void CountRefusal(std::string_view reason) = 0;
};

struct TlsFiles {
  std::string certificate, key;  // PEM
};

class HttpServer {
 public:
  // Listens and accepts at once. `host` is a numeric address; port 0: any. InvalidArgument: the TLS files. Unavailable: the address.
  static Result<std::unique_ptr<HttpServer>> Start(boost::asio::io_context& io, const std::string& host, std::uint16_t port,
                                                   const std::optional<TlsFiles>& tls, const HttpLimits& limits,
                                                   HttpApplication& application);
  virtual ~HttpServer() = default;
  virtual std::uint16_t port() const = 0;
  // Stops accepting and closes all connections; the io_context has nothing left to do for it then.
  virtual void Stop() = 0;
};

}  // namespace slabstream
