#include "common/otlp/trace_sender.h"
#include "common/json/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <cstdlib>
#include <functional>
#include <future>

#include "common/http/http.h"

namespace slabstream {
namespace {

namespace asio = boost::asio;
using testing::HasSubstr;
using testing::StartsWith;

// A collector on a free port: keeps what it is sent, and answers as it is told.
class Collector final : public HttpApplication {
 public:
  explicit Collector(HttpReply answer = {.body = "{}"}) : answer_(std::move(answer)), work_(asio::make_work_guard(io_)) {
    server_ = HttpServer::Start(io_, "127.0.0.1", 0, std::nullopt, {.body_bytes = std::size_t{16} << 20}, *this).value();
    thread_ = std::thread([this] { io_.run(); });
  }
  ~Collector() override {
    asio::post(io_, [this] {
      server_->Stop();
      work_.reset();
    });
    thread_.join();
  }

  HttpUrl url() const { return ParseCollector("--otlp", "http://127.0.0.1:" + std::to_string(server_->port())).value(); }

  // Waits until so many requests are there.
  std::vector<HttpRequest> Requests(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return requests_.size() >= count; });
    return requests_;
  }

  void Handle(HttpRequest request, std::function<void(HttpReply)> reply) override {
    const std::lock_guard lock(mutex_);
    request.gone.reset();
    requests_.push_back(std::move(request));
    changed_.notify_all();
    reply(answer_);
  }
  std::variant<HttpReply, WebSocketAccepted> Accept(const HttpRequest&) override { return HttpReply{.status = 404}; }
  std::vector<std::pair<std::string, std::string>> CommonHeaders() const override { return {}; }
  void CountRefusal(std::string_view) override {}

 private:
  const HttpReply answer_;
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  std::unique_ptr<HttpServer> server_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<HttpRequest> requests_;
  std::thread thread_;
};

// Takes connections and says nothing.
class SilentCollector {
 public:
  HttpUrl url() const { return {.host = "127.0.0.1", .port = acceptor_.local_endpoint().port()}; }

 private:
  asio::io_context io_;
  asio::ip::tcp::acceptor acceptor_{io_, {asio::ip::address_v4::loopback(), 0}};
};

HttpUrl NobodyListens() { return SilentCollector().url(); }

std::vector<TraceSpan> Trace(std::size_t spans) { return std::vector<TraceSpan>(spans); }

std::size_t SpansIn(const HttpRequest& request) {
  return Json::Parse(request.body).value()["resourceSpans"][0]["scopeSpans"][0]["spans"].size();
}

void WaitFor(const TraceSender& sender, const std::function<bool(TraceSender::Counts)>& condition) {
  while (!condition(sender.counts())) std::this_thread::yield();
}

TEST(CollectorAddressTest, IsAnHttpAddress) {
  const auto shown = [](const char* text) { return ToString(ParseCollector("--otlp", text).value()); };
  EXPECT_EQ(shown("http://127.0.0.1:4318"), "http://127.0.0.1:4318/v1/traces");
  EXPECT_EQ(shown("http://127.0.0.1:4318/"), "http://127.0.0.1:4318/v1/traces");
  EXPECT_EQ(shown("HTTP://otel.example:4318/my/traces?a=b"), "http://otel.example:4318/my/traces?a=b");
  EXPECT_EQ(shown("http://[::1]:4318"), "http://[::1]:4318/v1/traces");
  EXPECT_EQ(shown("http://collector"), "http://collector:80/v1/traces");
  EXPECT_EQ(ParseCollector("--otlp", "http://[::1]:4318")->host, "::1");
}

TEST(CollectorAddressTest, OthersAreRefusedInOneLine) {
  for (const char* text : {"", "4318", "127.0.0.1:4318", "grpc://a:1", "http://", "http:///v1", "http://:4318", "http://a:0",
                           "http://a:65536", "http://a:", "http://a:b", "http://a b", "http://user:secret@a:1", "http://a:1/#x",
                           "http://a:1/\n", "http://[::1", "http:/a:1", "http://a:1/\xc3\xa4"}) {
    const auto url = ParseCollector("--otlp", text);
    ASSERT_FALSE(url.ok()) << text;
    EXPECT_EQ(url.status().code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(url.status().message(), "--otlp '" + std::string(text) + "' is not an address such as http://127.0.0.1:4318");
  }
  EXPECT_EQ(ParseCollector("--otlp", "https://a:4318").status().message(),
            "--otlp 'https://a:4318' asks for TLS, which is not spoken here: it takes http://HOST:PORT");
}

TEST(CollectorAddressTest, TheStandardsVariableNamesTheBase) {
  constexpr const char* kVariable = "OTEL_EXPORTER_OTLP_ENDPOINT";
  const auto with = [](const char* text) {
    ::setenv(kVariable, text, 1);
    auto url = CollectorOfProcess();
    ::unsetenv(kVariable);
    return url;
  };
  EXPECT_EQ(CollectorOfProcess().value(), std::nullopt);
  EXPECT_EQ(with("").value(), std::nullopt);
  EXPECT_EQ(ToString(*with("http://a:4318").value()), "http://a:4318/v1/traces");
  EXPECT_EQ(ToString(*with("http://a:4318/base/").value()), "http://a:4318/base/v1/traces");
  EXPECT_THAT(with("https://a:4318").status().message(), StartsWith("$OTEL_EXPORTER_OTLP_ENDPOINT 'https://a:4318' asks for TLS"));
}

TEST(SendSpansTest, PostsBatchesOfJson) {
  Collector collector;
  const Status status = SendSpans(collector.url(), ThisProcess("test"), Trace(1000));
  EXPECT_TRUE(status.ok()) << status.message();
  const std::vector<HttpRequest> requests = collector.Requests(2);
  ASSERT_EQ(requests.size(), 2U);
  EXPECT_EQ(requests[0].method, "POST");
  EXPECT_EQ(requests[0].target, "/v1/traces");
  EXPECT_EQ(requests[0].host, HostOf(collector.url()));
  EXPECT_EQ(SpansIn(requests[0]) + SpansIn(requests[1]), 1000U);
}

TEST(SendSpansTest, NothingIsNotSent) { EXPECT_TRUE(SendSpans(NobodyListens(), ThisProcess("test"), {}).ok()); }

TEST(SendSpansTest, SaysWhyACollectorRefuses) {
  for (const unsigned answer : {301U, 400U, 503U}) {
    Collector collector({.status = answer, .body = "{\"message\":\n\"no\"}"});
    const Status status = SendSpans(collector.url(), ThisProcess("test"), Trace(1000));
    EXPECT_EQ(status.message(), ToString(collector.url()) + " answers " + std::to_string(answer) + ": {\"message\":?\"no\"}");
    EXPECT_EQ(collector.Requests(1).size(), 1U) << "the rest is not sent";
  }
  Collector rejecting({.body = R"({"partialSuccess":{"rejectedSpans":"3","errorMessage":"too old"}})"});
  EXPECT_THAT(SendSpans(rejecting.url(), ThisProcess("test"), Trace(3)).message(), HasSubstr("rejects 3 spans: too old"));
}

TEST(SendSpansTest, SaysThatNobodyListens) {
  const HttpUrl url = NobodyListens();
  const Status status = SendSpans(url, ThisProcess("test"), Trace(1));
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_EQ(status.message(), HostOf(url) + ": Connection refused");
}

TEST(SendSpansTest, AnAnswerThatIsTooLongIsAFailure) {
  Collector talker({.body = std::string(HttpPoster::kMostAnswerBytes + 1, 'x')});
  EXPECT_EQ(SendSpans(talker.url(), ThisProcess("test"), Trace(1)).code(), StatusCode::kUnavailable);
}

TEST(HttpPosterTest, WaitsSoLongAndNoLonger) {
  const SilentCollector collector;
  HttpPoster poster(collector.url());
  const auto answer = poster.Post("text/plain", "hello", std::chrono::milliseconds(20));
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.status().code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(answer.status().message(), HasSubstr("has not answered within"));
}

TEST(HttpPosterTest, ALimitFromAnotherThreadEndsIt) {
  const SilentCollector collector;
  HttpPoster poster(collector.url());
  auto answer = std::async(std::launch::async, [&] { return poster.Post("text/plain", "hello", std::chrono::hours(1)); });
  poster.EndBy(MonotonicNow());
  EXPECT_EQ(answer.get().status().code(), StatusCode::kDeadlineExceeded);
  EXPECT_EQ(poster.Post("text/plain", "hello", std::chrono::hours(1)).status().code(), StatusCode::kDeadlineExceeded);
}

TEST(HttpPosterTest, OneThatGaveUpCanPostAgain) {
  Collector collector;
  HttpPoster poster(collector.url());
  EXPECT_EQ(poster.Post("text/plain", "a", std::chrono::nanoseconds(0)).status().code(), StatusCode::kDeadlineExceeded);
  const auto answer = poster.Post("text/plain", "b", std::chrono::minutes(1));
  ASSERT_TRUE(answer.ok()) << answer.status().message();
  EXPECT_EQ(answer->status, 200U);
  EXPECT_EQ(answer->body, "{}");
}

TEST(TraceSenderTest, SendsWholeTracesAndCountsThem) {
  Collector collector;
  {
    TraceSender sender(collector.url(), ThisProcess("test"));
    for (const std::size_t spans : {1U, 700U, 3U}) sender.Put(Trace(spans));
    WaitFor(sender, [](TraceSender::Counts counts) { return counts.sent == 3; });
    EXPECT_EQ(sender.counts().dropped, 0U);
  }
  std::size_t spans = 0;
  for (const HttpRequest& request : collector.Requests(1)) spans += SpansIn(request);
  EXPECT_EQ(spans, 704U);
}

TEST(TraceSenderTest, SendsWhatWaitsWhenItEnds) {
  Collector collector;
  { TraceSender(collector.url(), ThisProcess("test")).Put(Trace(5)); }
  EXPECT_EQ(SpansIn(collector.Requests(1).front()), 5U);
}

TEST(TraceSenderTest, CountsWhatACollectorRefuses) {
  Collector collector({.status = 503});
  TraceSender sender(collector.url(), ThisProcess("test"));
  sender.Put(Trace(1));
  WaitFor(sender, [](TraceSender::Counts counts) { return counts.dropped == 1; });
  EXPECT_EQ(sender.counts().sent, 0U);
}

TEST(TraceSenderTest, NeverWaitsForACollectorAndHoldsABoundedQueue) {
  const SilentCollector collector;
  TraceSender sender(collector.url(), ThisProcess("test"));
  constexpr int kTraces = 100;
  for (int i = 0; i < kTraces; ++i) sender.Put(Trace(1000));
  // The collector has not answered once: what does not fit into the queue has gone already.
  const TraceSender::Counts counts = sender.counts();
  EXPECT_EQ(counts.sent, 0U);
  EXPECT_GE(counts.dropped, kTraces - 18U);  // 16 wait, one or two are being sent
  EXPECT_LT(counts.dropped, std::uint64_t{kTraces});
}

}  // namespace
}  // namespace slabstream
