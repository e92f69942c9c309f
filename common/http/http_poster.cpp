#include "common/http/http_poster.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <optional>
#include <utility>

namespace slabstream {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Error = beast::error_code;

// One request, from the name of the server to the end of the answer. Whatever is not finished ends with the io_context's work.
class Exchange : public std::enable_shared_from_this<Exchange> {
 public:
  Exchange(asio::io_context& io, const HttpUrl& url, std::string_view type, const std::string& body)
      : resolver_(io), stream_(io), request_(http::verb::post, url.target, 11) {
    request_.set(http::field::host, HostOf(url));
    request_.set(http::field::user_agent, "slabstream");
    request_.set(http::field::content_type, beast::string_view(type.data(), type.size()));
    request_.keep_alive(false);
    request_.body() = body;
    request_.prepare_payload();
    parser_.body_limit(HttpPoster::kMostAnswerBytes);
  }

  void Start(const HttpUrl& url) {
    const auto found = [self = shared_from_this()](Error error, const tcp::resolver::results_type& addresses) {
      if (error || self->ended_) return self->End(error);
      self->stream_.async_connect(addresses, [self](Error connected, const tcp::endpoint&) {
        if (connected || self->ended_) return self->End(connected);
        self->Send();
      });
    };
    resolver_.async_resolve(url.host, std::to_string(url.port), found);
  }

  void GiveUp() {
    ended_ = true;
    resolver_.cancel();
    stream_.close();
  }

  bool ended() const { return ended_; }
  const Error& error() const { return error_; }
  HttpAnswer TakeAnswer() { return {.status = parser_.get().result_int(), .body = std::move(parser_.get().body())}; }

 private:
  void Send() {
    http::async_write(stream_, request_, [self = shared_from_this()](Error written, std::size_t) {
      if (self->ended_) return;
      // A server that refuses may answer before it has read everything, and close the connection: its answer says more.
      self->written_ = written;
      // The header by itself: Beast misses a body that is too long if it comes in one piece with its header.
      http::async_read_header(self->stream_, self->buffer_, self->parser_, [self](Error read, std::size_t) {
        if (read) return self->End(self->written_ ? self->written_ : read);
        http::async_read(self->stream_, self->buffer_, self->parser_, [self](Error rest, std::size_t) { self->End(rest); });
      });
    });
  }

  void End(const Error& error) {
    if (std::exchange(ended_, true)) return;
    error_ = error;
    stream_.close();
  }

  tcp::resolver resolver_;
  beast::tcp_stream stream_;
  http::request<http::string_body> request_;
  http::response_parser<http::string_body> parser_;
  beast::flat_buffer buffer_;
  Error written_, error_;
  bool ended_ = false;
};

}  // namespace

struct HttpPoster::Impl {
  asio::io_context io{1};
  std::atomic<Time> limit{Time::max()};
};

HttpPoster::HttpPoster(HttpUrl url) : url_(std::move(url)), impl_(std::make_unique<Impl>()) {}
HttpPoster::~HttpPoster() = default;

Result<HttpAnswer> HttpPoster::Post(std::string_view type, const std::string& body, Duration time) {
  const Time begin = MonotonicNow();
  const auto exchange = std::make_shared<Exchange>(impl_->io, url_, type, body);
  exchange->Start(url_);
  impl_->io.restart();
  while (!exchange->ended()) {
    const Time limit = std::min(begin + time, impl_->limit.load());
    if (MonotonicNow() >= limit) {
      exchange->GiveUp();
      impl_->io.poll();  // what was cancelled
      const double allowed = std::chrono::duration<double>(std::max(limit - begin, Duration(0))).count();
      return Status::DeadlineExceeded(fmt::format("{} has not answered within {:.1f} s", HostOf(url_), allowed));
    }
    impl_->io.run_one_until(limit);
  }
  impl_->io.poll();
  if (exchange->error()) return Status::Unavailable(fmt::format("{}: {}", HostOf(url_), exchange->error().message()));
  return exchange->TakeAnswer();
}

void HttpPoster::EndBy(Time limit) {
  impl_->limit = limit;
  asio::post(impl_->io, [] {});  // so that Post looks at it
}

}  // namespace slabstream
