#include "common/metrics/metrics_listener.h"

#include <fmt/format.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <thread>
#include <utility>

#include "common/base/log.h"
#include "common/cli/add_option.h"
#include "common/http/http.h"
#include "common/threads/guarded.h"

namespace slabstream {
namespace {

namespace asio = boost::asio;

HttpLimits Limits() {
  return {.header_bytes = std::size_t{8} << 10,
          .body_bytes = std::size_t{1} << 10,
          .connections = 16,
          .connections_an_address = 16,
          .reading = std::chrono::seconds(10),
          .writing = std::chrono::seconds(10)};
}

HttpReply Refusal(unsigned status, std::string_view why) {
  return {.status = status, .type = "text/plain", .body = fmt::format("{}\n", why)};
}

}  // namespace

void AddMetricsOptions(const Command& app, MetricsOptions& options) {
  AddParsed(app, "--metrics", options.listen, ParseMetricsAddress,
            "Serve metrics for Prometheus at http://HOST:PORT/metrics; HOST is 127.0.0.1 unless given, port 0 takes any free port")
      .TypeName("[HOST:]PORT")
      .Default("no metrics");
  app.AddText("--metrics-token-file", options.token_file,
              "Serve metrics to those who send the token in this file, as 'Authorization: Bearer TOKEN': 16 to 128 letters, digits, - and "
              "_. Required for addresses that are not loopback")
      .TypeName("FILE");
}

Result<ListenAddress> ParseMetricsAddress(std::string_view option, std::string_view text) {
  const bool port_alone = !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  Result<ListenAddress> address = ParseListenAddress(option, port_alone ? fmt::format("127.0.0.1:{}", text) : std::string(text));
  const std::size_t host_end = text.starts_with('[') ? text.find(']') : 0;
  if (address.ok() && (port_alone || text.find(':', host_end) != std::string_view::npos)) return address;
  return Status::InvalidArgument(fmt::format("{} '{}' is not a port, or an address with a port such as 192.168.1.7:9464", option, text));
}

struct MetricsListener::Impl final : public HttpApplication {
  Impl(ListenAddress address, std::string wanted, std::function<std::string()> make_text)
      : listen(std::move(address)),
        rules(listen, false, {}),
        token(std::move(wanted)),
        text(std::move(make_text)),
        work(asio::make_work_guard(io)) {}

  ~Impl() override {
    if (!thread.joinable()) return;
    asio::post(io, [this] {
      server->Stop();
      work.reset();
    });
    thread.join();
  }

  Status Start() {
    Result<std::unique_ptr<HttpServer>> started = HttpServer::Start(io, listen.host, listen.port, std::nullopt, Limits(), *this);
    if (!started.ok()) return started.status();
    server = *std::move(started);
    listen.port = server->port();
    return Guarded("metrics", [this] { thread = std::thread([this] { Run(); }); });
  }

  // A request for which there is no memory ends its connection, not the process.
  void Run() {
    while (true) {
      const Status status = Guarded("metrics", [this] { io.run(); });
      if (status.ok()) return;
      LogWarning(status.message());
    }
  }

  HttpReply Answer(const HttpRequest& request) const {
    if (!token.empty() && !IsBearer(request.authorization, token)) {
      HttpReply reply = Refusal(401, "the token is missing or wrong");
      reply.headers.emplace_back("WWW-Authenticate", "Bearer");
      return reply;
    }
    // Without a token, pages of other sites are kept out by these names. With one, the names of this host are not known here.
    if (token.empty()) {
      if (const auto why = rules.Refusal(request.host, request.origin)) return Refusal(403, *why);
    }
    if (request.target.substr(0, request.target.find('?')) != "/metrics") return Refusal(404, "there is only /metrics");
    if (request.method != "GET" && request.method != "HEAD") {
      HttpReply reply = Refusal(405, "the methods of /metrics are GET and HEAD");
      reply.headers.emplace_back("Allow", "GET, HEAD");
      return reply;
    }
    return {.type = "text/plain; version=0.0.4; charset=utf-8", .body = text()};
  }

  void Handle(HttpRequest request, std::function<void(HttpReply)> reply) override { reply(Answer(request)); }
  std::variant<HttpReply, WebSocketAccepted> Accept(const HttpRequest&) override { return Refusal(404, "there are no WebSockets"); }
  std::vector<std::pair<std::string, std::string>> CommonHeaders() const override { return {{"X-Content-Type-Options", "nosniff"}}; }
  void CountRefusal(std::string_view) override {}

  ListenAddress listen;
  const OriginRules rules;
  const std::string token;  // empty: none is wanted
  const std::function<std::string()> text;
  asio::io_context io{1};
  asio::executor_work_guard<asio::io_context::executor_type> work;
  std::unique_ptr<HttpServer> server;
  std::thread thread;
};

Result<std::unique_ptr<MetricsListener>> MetricsListener::Start(const MetricsOptions& options, std::function<std::string()> text) {
  if (!options.listen) {
    if (options.token_file.empty()) return std::unique_ptr<MetricsListener>();
    return Status::InvalidArgument("--metrics-token-file needs --metrics");
  }
  std::string token;
  if (!options.token_file.empty()) {
    Result<std::string> read = ReadToken("--metrics-token-file", options.token_file);
    if (!read.ok()) return read.status();
    token = *std::move(read);
  } else if (!options.listen->loopback) {
    return Status::InvalidArgument(fmt::format("--metrics {} is not loopback: it needs --metrics-token-file", options.listen->host));
  }
  auto impl = std::make_unique<Impl>(*options.listen, std::move(token), std::move(text));
  if (Status status = impl->Start(); !status.ok()) return Status(status.code(), "--metrics: " + status.message());
  std::unique_ptr<MetricsListener> listener(new MetricsListener(std::move(impl)));
  LogInfo("serves metrics at " + listener->url());
  return listener;
}

MetricsListener::MetricsListener(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MetricsListener::~MetricsListener() = default;

std::string MetricsListener::url() const {
  return ToString(HttpUrl{.host = impl_->listen.host, .port = impl_->listen.port, .target = "/metrics"});
}

}  // namespace slabstream
