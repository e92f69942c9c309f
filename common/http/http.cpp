#include "common/http/http.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <deque>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "common/base/limited_log.h"
#include "common/text/split.h"

namespace slabstream {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using Error = beast::error_code;
using PlainStream = beast::tcp_stream;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;

class Connection;

// What connections share.
struct Shared {
  const HttpLimits limits;
  HttpApplication& application;
  std::set<Connection*> open;
  LimitedLog log;
};

// Whatever is open and must be closed when the server stops.
class Connection {
 public:
  Connection(std::shared_ptr<Shared> shared, asio::ip::address address) : shared_(std::move(shared)), address_(std::move(address)) {
    shared_->open.insert(this);
  }
  virtual ~Connection() { shared_->open.erase(this); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  virtual void CloseNow() = 0;
  const asio::ip::address& address() const { return address_; }  // of the other end
  // Since when it has been waiting for a request to arrive, or for a response to leave. Time::max(): it is not.
  Time waits_since() const { return waits_since_; }

 protected:
  std::shared_ptr<Shared> shared_;
  Time waits_since_ = Time::max();

 private:
  const asio::ip::address address_;
};

std::string_view View(beast::string_view text) { return {text.data(), text.size()}; }

std::vector<std::string> Items(std::string_view list) {
  std::vector<std::string> items;
  for (std::string_view item : Split(list, ',')) {
    while (item.starts_with(' ')) item.remove_prefix(1);
    while (item.ends_with(' ')) item.remove_suffix(1);
    if (!item.empty()) items.emplace_back(item);
  }
  return items;
}

HttpRequest RequestOf(const http::request<http::string_body>& message) {
  HttpRequest request;
  request.method = View(message.method_string());
  request.target = View(message.target());
  request.host = View(message[http::field::host]);
  request.body = message.body();
  const auto optional = [&](http::field field) -> std::optional<std::string> {
    const auto found = message.find(field);
    return found == message.end() ? std::nullopt : std::optional<std::string>(View(found->value()));
  };
  request.origin = optional(http::field::origin);
  request.authorization = optional(http::field::authorization);
  request.accept_encoding = View(message[http::field::accept_encoding]);
  request.traceparent = View(message["traceparent"]);
  request.subprotocols = Items(View(message[http::field::sec_websocket_protocol]));
  return request;
}

http::response<http::string_body> ResponseOf(HttpReply reply, unsigned version, bool keep_alive, const Shared& shared) {
  http::response<http::string_body> response(http::int_to_status(reply.status), version);
  response.set(http::field::content_type, reply.type);
  for (const auto& [name, value] : shared.application.CommonHeaders()) response.set(name, value);
  for (const auto& [name, value] : reply.headers) response.set(name, value);
  response.keep_alive(keep_alive);
  if (reply.rest != nullptr) {  // WritePart sends it; the end of an HTTP/1.0 body is the connection's
    if (version < 11) response.keep_alive(false);
    response.chunked(version >= 11);
    return response;
  }
  response.body() = std::move(reply.body);
  response.prepare_payload();
  return response;
}

// A connection with or without TLS, and with handlers of one type: so Beast's templates, which take long to compile, are made once.
class Stream {
 public:
  using executor_type = PlainStream::executor_type;

  explicit Stream(PlainStream stream) : stream_(std::move(stream)) {}
  Stream(PlainStream stream, asio::ssl::context& tls) : stream_(std::in_place_type<TlsStream>, std::move(stream), tls) {}

  TlsStream* tls() { return std::get_if<TlsStream>(&stream_); }  // null: there is none
  // As Beast names them.
  PlainStream& next_layer() { return tls() != nullptr ? tls()->next_layer() : std::get<PlainStream>(stream_); }
  executor_type get_executor() { return next_layer().get_executor(); }
  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    Read({asio::buffer_sequence_begin(buffers), asio::buffer_sequence_end(buffers)}, Erased(std::forward<Handler>(handler)));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    Write({asio::buffer_sequence_begin(buffers), asio::buffer_sequence_end(buffers)}, Erased(std::forward<Handler>(handler)));
  }
  template <class Handler>
  friend void async_teardown(beast::role_type role, Stream& stream, Handler&& handler) {
    stream.TearDown(role, Erased(std::forward<Handler>(handler)));
  }

 private:
  using Moved = std::function<void(Error, std::size_t)>;

  // Beast's handlers cannot be copied.
  template <class Handler>
  static auto Erased(Handler&& handler) {
    return [shared = std::make_shared<std::decay_t<Handler>>(std::forward<Handler>(handler))](auto... what) { (*shared)(what...); };
  }
  void Read(const std::vector<asio::mutable_buffer>& buffers, Moved moved) {
    std::visit([&](auto& stream) { stream.async_read_some(buffers, std::move(moved)); }, stream_);
  }
  void Write(const std::vector<asio::const_buffer>& buffers, Moved moved) {
    std::visit([&](auto& stream) { stream.async_write_some(buffers, std::move(moved)); }, stream_);
  }
  void TearDown(beast::role_type role, std::function<void(Error)> done) {
    using websocket::async_teardown;
    std::visit([&](auto& stream) { async_teardown(role, stream, std::move(done)); }, stream_);
  }

  std::variant<PlainStream, TlsStream> stream_;
};

// ---- WebSockets

class WebSocketConnection final : public Connection, public WebSocketPeer, public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(Stream stream, std::shared_ptr<Shared> shared, const asio::ip::address& address, WebSocketAccepted accepted)
      : Connection(std::move(shared), address),
        socket_(std::move(stream)),
        accepted_(std::move(accepted)),
        timer_(socket_.get_executor()),
        answer_timer_(socket_.get_executor()) {}

  void Run(const http::request<http::string_body>& request) {
    beast::get_lowest_layer(socket_).expires_never();  // the WebSocket has times of its own
    const HttpLimits& limits = shared_->limits;
    socket_.set_option(websocket::stream_base::timeout{
        .handshake_timeout = limits.reading, .idle_timeout = websocket::stream_base::none(), .keep_alive_pings = false});
    socket_.control_callback([this](websocket::frame_type kind, beast::string_view text) {
      if (kind == websocket::frame_type::pong && View(text) == asked_) asked_.clear();
    });
    socket_.set_option(websocket::stream_base::decorator([this](websocket::response_type& response) {
      for (const auto& [name, value] : shared_->application.CommonHeaders()) response.set(name, value);
      response.set(http::field::sec_websocket_protocol, accepted_.subprotocol);
    }));
    socket_.read_message_max(limits.message_bytes);
    socket_.auto_fragment(false);
    socket_.write_buffer_bytes(std::size_t{1} << 16);
    socket_.async_accept(request, [self = shared_from_this()](Error error) {
      if (error) return self->End(error.message());
      self->open_ = true;
      self->accepted_.session->OnOpen(*self);
      self->Ping();
      self->Read();
    });
  }

  void SendText(std::string text) override { Queue({.text = true, .head = std::move(text), .tail = nullptr}); }
  void SendBinary(std::string head, std::shared_ptr<const std::vector<std::byte>> tail) override {
    Queue({.text = false, .head = std::move(head), .tail = std::move(tail)});
  }

  void Close(std::uint16_t code, std::string reason) override {
    if (std::exchange(closing_, true)) return;
    why_ = reason;
    constexpr std::size_t kMaxReasonBytes = 120;
    websocket::close_reason closing(static_cast<websocket::close_code>(code), reason.substr(0, kMaxReasonBytes));
    // The other end may be one that does not read: it has only so long.
    timer_.expires_after(std::chrono::seconds(2));
    timer_.async_wait([self = shared_from_this()](Error error) {
      if (!error) self->CloseNow();
    });
    if (writing_) {
      close_after_write_ = closing;
    } else {
      SendClose(closing);
    }
  }

  void CloseNow() override { beast::get_lowest_layer(socket_).close(); }

 private:
  struct Message {
    bool text = true;
    std::string head;
    std::shared_ptr<const std::vector<std::byte>> tail;
  };

  void SendClose(const websocket::close_reason& closing) {
    socket_.async_close(closing, [self = shared_from_this()](Error) { self->timer_.cancel(); });
  }

  void Queue(Message message) {
    if (closing_ || !open_) return;
    constexpr std::size_t kMaxQueued = 256;
    if (queue_.size() >= kMaxQueued) return Drop("it does not read its messages");
    queue_.push_back(std::move(message));
    if (!writing_) Write();
  }

  void Write() {
    writing_ = true;
    const Message& message = queue_.front();
    socket_.text(message.text);
    timer_.expires_after(shared_->limits.writing);
    timer_.async_wait([self = shared_from_this()](Error error) {
      if (!error && self->writing_ && !self->closing_) self->Drop("a message did not leave in time");
    });
    const std::array<asio::const_buffer, 2> buffers = {
        asio::buffer(message.head),
        message.tail == nullptr ? asio::const_buffer() : asio::const_buffer(message.tail->data(), message.tail->size())};
    socket_.async_write(buffers, [self = shared_from_this()](Error error, std::size_t) { self->OnWritten(error); });
  }

  void OnWritten(const Error& error) {
    writing_ = false;
    if (!closing_) timer_.cancel();
    if (error) return End(error.message());
    queue_.pop_front();
    if (close_after_write_) return SendClose(*close_after_write_);
    if (!closing_ && !queue_.empty()) Write();
  }

  void Drop(const std::string& why) {
    shared_->application.CountRefusal("slow reader");
    shared_->log.Warning(fmt::format("a viewer was dropped: {}", why));
    closing_ = true;
    why_ = why;
    CloseNow();
  }

  // The other end answers with the number in the ping, which it knows only when it has read all that left before.
  void Ping() {
    asked_ = fmt::format("{:x}", std::random_device()());
    socket_.async_ping(websocket::ping_data(asked_), [self = shared_from_this()](Error error) {
      if (error || self->closing_) return;
      // From now on: what had to leave before it has a limit of its own.
      self->answer_timer_.expires_after(self->shared_->limits.silence);
      self->answer_timer_.async_wait([self](Error stopped) {
        if (stopped || self->closing_) return;
        self->asked_.empty() ? self->Ping() : self->Drop("it did not answer a ping in time");
      });
    });
  }

  void Read() {
    socket_.async_read(buffer_, [self = shared_from_this()](Error error, std::size_t) { self->OnRead(error); });
  }

  void OnRead(const Error& error) {
    if (error) return End(error == websocket::error::closed ? std::string() : error.message());
    if (!socket_.got_text()) {
      Close(1003, "messages to the gateway are text");
    } else if (!closing_) {
      const auto data = buffer_.cdata();
      accepted_.session->OnText({static_cast<const char*>(data.data()), data.size()});
    }
    buffer_.consume(buffer_.size());
    Read();
  }

  void End(const std::string& why) {
    if (std::exchange(ended_, true)) return;
    timer_.cancel();
    answer_timer_.cancel();
    closing_ = true;
    accepted_.session->OnClosed(why_.empty() ? why : why_);
    CloseNow();
  }

  websocket::stream<Stream, false> socket_;  // false: without compression, which pictures have already
  WebSocketAccepted accepted_;
  asio::steady_timer timer_, answer_timer_;
  std::string asked_;  // in a ping that was not answered yet; empty: there is none
  beast::flat_buffer buffer_;
  std::deque<Message> queue_;  // the first one is being written, if any is
  std::optional<websocket::close_reason> close_after_write_;
  std::string why_;
  bool open_ = false, writing_ = false, closing_ = false, ended_ = false;
};

// ---- HTTP

class HttpConnection final : public Connection, public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(Stream stream, std::shared_ptr<Shared> shared, const asio::ip::address& address)
      : Connection(std::move(shared), address), stream_(std::move(stream)), watch_(stream_.get_executor()) {}

  void Run() {
    if (TlsStream* tls = stream_.tls()) {
      WaitAtMost(shared_->limits.reading);
      tls->async_handshake(asio::ssl::stream_base::server, [self = shared_from_this()](Error error) {
        if (!error) self->Read();
      });
    } else {
      Read();
    }
  }

  void CloseNow() override {
    if (rest_ != nullptr) std::exchange(rest_, nullptr)->Abandon();
    Lowest().close();
  }

 private:
  PlainStream& Lowest() { return stream_.next_layer(); }

  // For the application. It may let go of it on any thread, and last of all: the connection ends on the io thread even then.
  std::shared_ptr<HttpConnection> Lent() {
    return {this, [self = shared_from_this()](HttpConnection*) mutable {
              const auto executor = self->stream_.get_executor();
              asio::post(executor, [self = std::move(self)] {});
            }};
  }

  // The other end has so long for its part.
  void WaitAtMost(Duration time) {
    waits_since_ = MonotonicNow();
    Lowest().expires_after(time);
  }
  // The application has it now.
  void Work() {
    waits_since_ = Time::max();
    Lowest().expires_never();
  }

  void Read() {
    parser_.emplace();
    parser_->header_limit(std::uint32_t(shared_->limits.header_bytes));
    parser_->body_limit(shared_->limits.body_bytes);
    WaitAtMost(shared_->limits.reading);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](Error error, std::size_t) { self->OnRead(error); });
  }

  void OnRead(const Error& error) {
    if (error == http::error::header_limit || error == http::error::buffer_overflow) return Refuse(431, "header", "the header is too long");
    if (error == http::error::body_limit) return Refuse(413, "body", "the body is too long");
    if (error == http::error::end_of_stream || error == beast::error::timeout) return Shutdown();
    if (error.category() == http::make_error_code(http::error::bad_version).category()) {
      return Refuse(400, "malformed", "the request is not HTTP/1.1");
    }
    if (error) return;
    Work();
    message_ = parser_->release();
    // A proxy and this server might each believe another one of them.
    for (const http::field once : {http::field::host, http::field::origin, http::field::authorization}) {
      if (message_.count(once) > 1) return Refuse(400, "malformed", fmt::format("the request has {} twice", View(http::to_string(once))));
    }
    HttpRequest request = RequestOf(message_);
    if (websocket::is_upgrade(message_)) return Upgrade(request);
    gone_ = request.gone;
    shared_->application.Handle(std::move(request), [self = Lent()](HttpReply reply) {
      self->gone_.reset();
      self->watch_.cancel();
      self->Write(std::move(reply), self->message_.keep_alive());
    });
    if (gone_ != nullptr && *gone_) Watch();
  }

  // Looks now and then whether the other end is still there, while the application works on the reply or its next part. A read would
  // tell sooner, but it would also take what belongs to the next request, or to TLS.
  void Watch() {
    watch_.expires_after(kWatchInterval);
    watch_.async_wait([self = shared_from_this()](Error error) {
      if (error || self->gone_ == nullptr) return;
      if (self->IsThere()) return self->Watch();
      const auto gone = std::exchange(self->gone_, nullptr);
      (*gone)();
      self->CloseNow();
    });
  }

  bool IsThere() {
    if (!Lowest().socket().is_open()) return false;
    pollfd state{.fd = Lowest().socket().native_handle(), .events = POLLRDHUP, .revents = 0};
    return ::poll(&state, 1, 0) <= 0 || (state.revents & (POLLRDHUP | POLLHUP | POLLERR)) == 0;
  }

  void Upgrade(const HttpRequest& request) {
    auto answer = shared_->application.Accept(request);
    if (auto* reply = std::get_if<HttpReply>(&answer)) return Write(std::move(*reply), false);
    std::make_shared<WebSocketConnection>(std::move(stream_), shared_, address(), std::move(std::get<WebSocketAccepted>(answer)))
        ->Run(message_);
  }

  void Refuse(unsigned status, std::string_view what, std::string_view why) {
    shared_->application.CountRefusal(what);
    Write({.status = status, .body = fmt::format("{{\"error\":\"{}\"}}", why)}, false);
  }

  void Write(HttpReply reply, bool keep_alive) {
    const bool head = message_.method() == http::verb::head;
    if (reply.rest != nullptr && head) {
      reply.rest->Abandon();
    } else if (reply.rest != nullptr) {
      rest_ = reply.rest;
      part_ = std::move(reply.body);
    }
    response_.emplace(ResponseOf(std::move(reply), message_.version() == 0 ? 11 : message_.version(), keep_alive, *shared_));
    WaitAtMost(shared_->limits.writing);
    const auto written = [self = shared_from_this()](Error error, std::size_t) {
      if (error) return self->DropAfter(error);
      if (self->rest_ == nullptr) return self->Next();
      self->part_.empty() ? self->ReadPart() : self->WritePart();
    };
    if (head || rest_ != nullptr) {  // the length of the body, but no body
      head_.emplace(response_->base());
      header_.emplace(*head_);
      return http::async_write_header(stream_, *header_, written);
    }
    http::async_write(stream_, *response_, written);
  }

  void DropAfter(const Error& error) {
    if (error == beast::error::timeout) {
      shared_->application.CountRefusal("slow reader");
      shared_->log.Warning("a connection was dropped: a response did not leave in time");
    }
    CloseNow();
  }

  // After a response.
  void Next() { response_->keep_alive() ? Read() : Shutdown(); }

  // The next part of a body that is made while it leaves. One of no bytes is the end.
  void WritePart() {
    WaitAtMost(shared_->limits.writing);
    const bool last = part_.empty();
    const auto written = [self = shared_from_this(), last](Error error, std::size_t) {
      if (error || self->rest_ == nullptr) return self->DropAfter(error);
      if (!last) return self->ReadPart();
      self->rest_.reset();
      self->Next();
    };
    if (!response_->chunked()) return asio::async_write(stream_, asio::buffer(part_), written);
    if (last) return asio::async_write(stream_, http::make_chunk_last(), written);
    asio::async_write(stream_, http::make_chunk(asio::buffer(part_)), written);
  }

  void ReadPart() {
    Work();
    gone_ = std::make_shared<std::function<void()>>([] {});  // CloseNow tells the stream
    Watch();
    rest_->Read([self = Lent()](Result<std::string> part) {
      self->gone_.reset();
      self->watch_.cancel();
      if (!part.ok()) return self->CloseNow();
      self->part_ = *std::move(part);
      self->WritePart();
    });
  }

  void Shutdown() {
    WaitAtMost(std::chrono::seconds(2));
    if (TlsStream* tls = stream_.tls()) {
      tls->async_shutdown([self = shared_from_this()](Error) { self->CloseNow(); });
    } else {
      Error ignored;
      Lowest().socket().shutdown(tcp::socket::shutdown_send, ignored);
      Drain();
    }
  }

  // Closing with unread bytes would reset the connection, and the response could be lost with it. So what still comes is thrown away, for
  // a while.
  void Drain() {
    if (drained_ > shared_->limits.body_bytes) return;
    stream_.async_read_some(asio::buffer(waste_), [self = shared_from_this()](Error error, std::size_t size) {
      self->drained_ += size;
      if (!error) self->Drain();
    });
  }

  static constexpr auto kWatchInterval = std::chrono::milliseconds(200);

  Stream stream_;
  asio::steady_timer watch_;
  std::shared_ptr<std::function<void()>> gone_;  // while the application works on a reply
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::request<http::string_body> message_;
  std::optional<http::response<http::string_body>> response_;
  std::optional<http::response<http::empty_body>> head_;
  std::optional<http::response_serializer<http::empty_body>> header_;
  std::shared_ptr<BodyStream> rest_;  // of the body that is being sent
  std::string part_;                  // of it, that is being sent
  std::array<char, 4096> waste_{};
  std::size_t drained_ = 0;
};

// ---- the server

class Server final : public HttpServer {
 public:
  Server(asio::io_context& io, std::shared_ptr<Shared> shared) : acceptor_(io), pause_(io), shared_(std::move(shared)) {}
  ~Server() override { Stop(); }

  Status Listen(const std::string& host, std::uint16_t port, const std::optional<TlsFiles>& tls) {
    if (tls) {
      if (Status status = Load(*tls); !status.ok()) return status;
    }
    Error error;
    const asio::ip::address address = asio::ip::make_address(host, error);
    const tcp::endpoint endpoint(address, port);
    if (!error) acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) return Status::Unavailable(fmt::format("cannot listen at {} port {}: {}", host, port, error.message()));
    AcceptNext();
    return Status::Ok();
  }

  std::uint16_t port() const override {
    Error error;
    return acceptor_.local_endpoint(error).port();
  }

  void Stop() override {
    Error ignored;
    acceptor_.close(ignored);
    pause_.cancel();
    for (Connection* connection : std::set<Connection*>(shared_->open)) connection->CloseNow();
  }

 private:
  Status Load(const TlsFiles& files) {
    tls_.emplace(asio::ssl::context::tls_server);
    Error error;
    tls_->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1, error);
    tls_->use_certificate_chain_file(files.certificate, error);
    if (error) return Status::InvalidArgument(fmt::format("--tls-cert {}: {}", files.certificate, error.message()));
    tls_->use_private_key_file(files.key, asio::ssl::context::pem, error);
    if (error) return Status::InvalidArgument(fmt::format("--tls-key {}: {}", files.key, error.message()));
    return Status::Ok();
  }

  void AcceptNext() {
    acceptor_.async_accept([this](Error error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) return AcceptLater();
      AcceptNext();  // first, so that the listener stays even if there is no memory for this connection
      Begin(std::move(socket));
    });
  }

  // Without a free file descriptor the next call would fail at once, too, and the thread would never rest.
  void AcceptLater() {
    pause_.expires_after(std::chrono::milliseconds(100));
    pause_.async_wait([this](Error error) {
      if (!error && acceptor_.is_open()) AcceptNext();
    });
  }

  void Begin(tcp::socket socket) {
    Error error;
    const tcp::endpoint from = socket.remote_endpoint(error);
    if (error || !MakeRoomFor(from.address())) return;  // an error: it has gone already
    socket.set_option(tcp::no_delay(true), error);
    PlainStream plain(std::move(socket));
    std::make_shared<HttpConnection>(tls_ ? Stream(std::move(plain), *tls_) : Stream(std::move(plain)), shared_, from.address())->Run();
  }

  // At a limit, the slowest connection goes: of this address if it has as many as it may, else of the address that has most. Viewers and
  // those whose request is worked on stay. False: there is no room.
  bool MakeRoomFor(const asio::ip::address& address) {
    const HttpLimits& limits = shared_->limits;
    std::map<asio::ip::address, std::size_t> counts;
    for (const Connection* connection : shared_->open) ++counts[connection->address()];
    const bool of_it = counts[address] >= limits.connections_an_address;
    if (!of_it && shared_->open.size() < limits.connections) return true;
    const auto rank = [&](const Connection* c) { return std::pair(counts[c->address()], MonotonicNow() - c->waits_since()); };
    Connection* slowest = nullptr;
    for (Connection* c : shared_->open) {
      if (c->waits_since() == Time::max() || (of_it && c->address() != address)) continue;
      if (slowest == nullptr || rank(c) > rank(slowest)) slowest = c;
    }
    shared_->application.CountRefusal("connections");
    shared_->log.Warning(
        fmt::format("a connection was closed: {} has {} of {} open ones", address.to_string(), counts[address], shared_->open.size()));
    if (slowest == nullptr) return false;
    shared_->open.erase(slowest);  // at once, not when it has heard of it
    slowest->CloseNow();
    return true;
  }

  std::optional<asio::ssl::context> tls_;
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
  std::shared_ptr<Shared> shared_;
};

}  // namespace

Result<std::unique_ptr<HttpServer>> HttpServer::Start(boost::asio::io_context& io, const std::string& host, std::uint16_t port,
                                                      const std::optional<TlsFiles>& tls, const HttpLimits& limits,
                                                      HttpApplication& application) {
  auto shared = std::make_shared<Shared>(Shared{.limits = limits, .application = application, .open = {}, .log = LimitedLog()});
  auto server = std::make_unique<Server>(io, std::move(shared));
  if (Status status = server->Listen(host, port, tls); !status.ok()) return status;
  return std::unique_ptr<HttpServer>(std::move(server));
}

}  // namespace slabstream
