// Objects behind web servers, honest and other ones.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "common/base/files.h"
#include "data/stores/http_transfers.h"
#include "data/stores/store.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr char kTen[] = "0123456789";
constexpr int kTries = HttpTransfers::kTries;

class HttpStoreTest : public ::testing::Test {
 protected:
  std::shared_ptr<Store> StoreAt(const std::string& url) { return HttpStore(url, transfers_).value(); }
  static Result<std::string> Read(Store& store, const std::string& key, const ByteRange& range = {}, std::uint64_t most = 1000) {
    std::promise<Result<Bytes>> answer;
    store.Read(key, range, most, [&](Result<Bytes> bytes) { answer.set_value(std::move(bytes)); });
    const Result<Bytes> bytes = answer.get_future().get();
    if (!bytes.ok()) return bytes.status();
    return std::string(reinterpret_cast<const char*>(bytes->span().data()), bytes->size());
  }
  // Of an object that the server answers for in this way.
  Status FailureOf(const ScriptedServer::Script& script, const ByteRange& range = {}) {
    server_ = std::make_unique<ScriptedServer>(script);
    const Result<std::string> read = Read(*StoreAt(server_->url()), "object", range);
    EXPECT_FALSE(read.ok());
    EXPECT_THAT(read.status().message(), HasSubstr(server_->url() + "/object"));
    return read.status();
  }
  std::size_t asked() const { return server_->requests().size(); }

  HttpTransfers transfers_{{.first_pause = milliseconds(1), .connecting = seconds(20), .stalled = seconds(1)}};
  std::unique_ptr<ScriptedServer> server_;
};

TEST_F(HttpStoreTest, ReadsObjectsAndPartsOfThem) {
  const TemporaryDirectory folder;
  ASSERT_TRUE(WriteTextFile(folder / "ten", kTen).ok());
  ASSERT_TRUE(WriteTextFile(folder / "a%20b%23%C3%BC", "encoded").ok());
  ASSERT_TRUE(WriteTextFile(folder / "none", "").ok());
  const ScriptedServer server(ServesFolder(folder.path()));
  const std::shared_ptr<Store> store = StoreAt(server.url() + "/");
  EXPECT_EQ(store->name(), server.url());
  EXPECT_EQ(Read(*store, "ten").value(), kTen);
  EXPECT_EQ(Read(*store, "a b#\xC3\xBC").value(), "encoded");
  EXPECT_EQ(Read(*store, "none").value(), "");
  EXPECT_EQ(Read(*store, "ten", {2, 3}).value(), "234");
  EXPECT_EQ(Read(*store, "ten", {8, 5}).value(), "89") << "the object ends before";
  EXPECT_EQ(Read(*store, "ten", {10, 5}).value(), "");
  EXPECT_EQ(Read(*store, "ten", {4, ByteRange::kAll}).value(), "456789");
  EXPECT_EQ(Read(*store, "ten", {0, 4, true}).value(), "6789");
  EXPECT_EQ(Read(*store, "ten", {0, 40, true}).value(), kTen);
  EXPECT_EQ(Read(*store, "ten", {}, 9).status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(Read(*store, "ten", {0, 100}, 9).status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(Read(*store, "ten", {2, 100}, 8).value(), "23456789");
  EXPECT_EQ(Read(*store, "other").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(Read(*store, "../ten").status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(store->List("").status().code(), StatusCode::kInvalidArgument);
}

TEST_F(HttpStoreTest, TakesNoOtherAddresses) {
  for (const char* url : {"http://", "http:///x", "ftp://host/x", "http://host/x?y", "https://host/x#y"}) {
    EXPECT_EQ(HttpStore(url, transfers_).status().code(), StatusCode::kInvalidArgument) << url;
  }
  const Status secret = HttpStore("http://name:secret@host/x", transfers_).status();
  EXPECT_EQ(secret.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(secret.message(), testing::Not(HasSubstr("secret")));
}

TEST_F(HttpStoreTest, AsksAgainIfThatMayHelp) {
  for (const char* status : {"408 x", "429 x", "500 x", "502 x", "503 x", "504 x"}) {
    std::atomic<int> count = 0;
    const ScriptedServer server(
        [&](const ServerRequest&) { return ++count < 3 ? AnswerText(status, "wait") : AnswerText("200 OK", kTen); });
    EXPECT_EQ(Read(*StoreAt(server.url()), "object").value(), kTen) << status;
    EXPECT_EQ(count, 3);
  }
  const Status failure = FailureOf([](const ServerRequest&) { return AnswerText("503 Service Unavailable", ""); });
  EXPECT_EQ(failure.code(), StatusCode::kUnavailable);
  EXPECT_THAT(failure.message(), HasSubstr("HTTP 503, 6 tries"));
  EXPECT_EQ(asked(), std::size_t(kTries));
}

TEST_F(HttpStoreTest, DoesNotAskAgainIfThatCannotHelp) {
  EXPECT_EQ(FailureOf([](const ServerRequest&) { return AnswerText("404 Not Found", ""); }).code(), StatusCode::kNotFound);
  EXPECT_EQ(asked(), 1U);
  const Status forbidden = FailureOf([](const ServerRequest&) { return AnswerText("403 Forbidden", "a page about it"); });
  EXPECT_EQ(forbidden.code(), StatusCode::kUnavailable);
  EXPECT_THAT(forbidden.message(), HasSubstr("HTTP 403"));
  EXPECT_EQ(asked(), 1U);
  const Status later = FailureOf([](const ServerRequest&) { return AnswerText("429 Too Many Requests", "", "Retry-After: 3600\r\n"); });
  EXPECT_THAT(later.message(), HasSubstr("the server says to come back in 3600 s"));
  EXPECT_EQ(asked(), 1U);
}

TEST_F(HttpStoreTest, ConnectionsThatBreakOrStallAreLeft) {
  const std::string cut = "HTTP/1.1 200 OK\r\nContent-Length: 100\r\nConnection: close\r\n\r\nonly this";
  std::atomic<int> count = 0;
  const ScriptedServer server(
      [&](const ServerRequest&) { return ++count < 3 ? (count == 1 ? cut : std::string()) : AnswerText("200 OK", kTen); });
  EXPECT_EQ(Read(*StoreAt(server.url()), "object").value(), kTen);
  EXPECT_EQ(FailureOf([&](const ServerRequest&) { return cut; }).code(), StatusCode::kUnavailable);
  EXPECT_EQ(asked(), std::size_t(kTries));
  const std::string silent = "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nonly this";
  HttpTransfers impatient({.first_pause = milliseconds(1), .stalled = seconds(1), .tries = 2});
  const ScriptedServer stalls([&](const ServerRequest&) { return silent; });
  EXPECT_EQ(Read(**HttpStore(stalls.url(), impatient), "object").status().code(), StatusCode::kUnavailable);
  const std::string gone = ScriptedServer([](const ServerRequest&) { return ""; }).url();
  EXPECT_EQ(Read(*StoreAt(gone), "object").status().code(), StatusCode::kUnavailable) << "nobody listens";
}

TEST_F(HttpStoreTest, OtherBytesThanAskedForAreRefused) {
  const auto part = [](const std::string& range, const std::string& body) {
    return [=](const ServerRequest&) { return AnswerText("206 Partial Content", body, "Content-Range: " + range + "\r\n"); };
  };
  for (const char* range : {"bytes 3-5/10", "bytes x-5/10", "bytes", "", "bytes 99999999999999999999-5/10"}) {
    EXPECT_EQ(FailureOf(part(range, "234"), {2, 3}).code(), StatusCode::kDataLoss) << range;
  }
  EXPECT_EQ(FailureOf(part("bytes 2-5/10", "2345"), {2, 3}).code(), StatusCode::kDataLoss) << "more than asked for";
  const Status ignored = FailureOf([](const ServerRequest&) { return AnswerText("200 OK", kTen); }, {2, 3});
  EXPECT_THAT(ignored.message(), HasSubstr("no parts of them"));
  server_ = std::make_unique<ScriptedServer>([](const ServerRequest&) { return AnswerText("200 OK", kTen); });
  EXPECT_EQ(Read(*StoreAt(server_->url()), "object", {0, 20}).value(), kTen) << "the part is the whole";
  const std::string endless = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nFFFF\r\n" + std::string(0xFFFF, 'x') + "\r\n";
  EXPECT_EQ(FailureOf([&](const ServerRequest&) { return endless; }).code(), StatusCode::kResourceExhausted);
}

TEST_F(HttpStoreTest, AnObjectThatChangesIsNoMixture) {
  std::atomic<int> version = 1;
  const ScriptedServer server([&](const ServerRequest& request) {
    const std::string tag = fmt::format("ETag: \"{}\"\r\n", version.load());
    if (request.header("range").empty()) return AnswerText("200 OK", kTen, tag);
    return AnswerText("206 Partial Content", "234", "Content-Range: bytes 2-4/10\r\n" + tag);
  });
  const std::shared_ptr<Store> store = StoreAt(server.url());
  EXPECT_EQ(Read(*store, "object").value(), kTen);
  EXPECT_EQ(Read(*store, "object", {2, 3}).value(), "234");
  version = 2;
  const Status changed = Read(*store, "object", {2, 3}).status();
  EXPECT_EQ(changed.code(), StatusCode::kUnavailable);
  EXPECT_THAT(changed.message(), HasSubstr("has changed since it was opened"));
  EXPECT_EQ(Read(*store, "another").value(), kTen);
  EXPECT_EQ(Read(*StoreAt(server.url()), "object", {2, 3}).value(), "234") << "who opens it now sees the new one";
}

TEST_F(HttpStoreTest, RedirectsAreFollowedWhereTheyMayLead) {
  const auto leads_to = [](const std::string& where) { return AnswerText("302 Found", "", "Location: " + where + "\r\n"); };
  const ScriptedServer here([&](const ServerRequest& request) {
    return request.target == "/object"  ? leads_to("/moved")
           : request.target == "/moved" ? AnswerText("200 OK", kTen)
                                        : leads_to(request.target);
  });
  EXPECT_EQ(Read(*StoreAt(here.url()), "object").value(), kTen);
  EXPECT_THAT(Read(*StoreAt(here.url()), "circle").status().message(), HasSubstr("more than 5 times"));
  EXPECT_THAT(FailureOf([&](const ServerRequest&) { return leads_to("ftp://127.0.0.1/x"); }).message(), HasSubstr("a ftp address"));
  EXPECT_THAT(FailureOf([](const ServerRequest&) { return AnswerText("302 Found", ""); }).message(), HasSubstr("leads nowhere"));
  // localhost was named, 127.0.0.1 was not.
  const ScriptedServer elsewhere([&](const ServerRequest&) { return leads_to(here.url() + "/moved"); });
  const std::string named = fmt::format("http://localhost:{}", elsewhere.port());
  HttpTransfers fresh({.first_pause = milliseconds(1), .connecting = seconds(20), .stalled = seconds(1)});  // without kept connections
  const Status refused = Read(**HttpStore(named, fresh), "object").status();
  EXPECT_EQ(refused.code(), StatusCode::kUnavailable);
  EXPECT_THAT(refused.message(), HasSubstr("an address of this machine"));
}

// While all of the host's requests are under way, random parts of two objects wait. Then they need few requests.
TEST_F(HttpStoreTest, PartsThatWaitSideBySideAreOneRequest) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  std::string object;
  for (int i = 0; i < 100'000; ++i) object += char('a' + random.Integer(0, 25));
  std::promise<void> go;
  const std::shared_future<void> may_go(go.get_future());
  const ScriptedServer server([&](const ServerRequest& request) -> std::string {
    if (request.target.starts_with("/wait")) {
      may_go.wait();
      return AnswerText("200 OK", "x");
    }
    std::size_t begin = 0, last = 0;
    if (request.target == "/none") return AnswerText("404 x", "");
    if (std::sscanf(request.header("range").c_str(), "bytes=%zu-%zu", &begin, &last) != 2) return AnswerText("400 x", "");
    if (begin >= object.size()) return AnswerText("416 x", "", fmt::format("Content-Range: bytes */{}\r\n", object.size()));
    const std::string part = object.substr(begin, last + 1 - begin);
    return AnswerText("206 x", part, fmt::format("Content-Range: bytes {}-{}/{}\r\n", begin, begin + part.size() - 1, object.size()));
  });
  const std::shared_ptr<Store> store = StoreAt(server.url());
  constexpr std::size_t kWaiting = HttpTransfers::kMostOfAHost, kParts = 200;
  std::atomic<std::size_t> left = kWaiting + kParts + 3, wrong = 0;
  std::promise<void> all;
  const auto expect = [&](const std::string& key, const ByteRange& range, const std::string& wanted, StatusCode code = StatusCode::kOk) {
    store->Read(key, range, object.size(), [&, wanted, code](const Result<Bytes>& bytes) {
      const std::string text = bytes.ok() ? std::string(reinterpret_cast<const char*>(bytes->span().data()), bytes->size()) : "";
      if (text != wanted || (bytes.ok() ? StatusCode::kOk : bytes.status().code()) != code) ++wrong;
      if (--left == 0) all.set_value();
    });
  };
  for (std::size_t i = 0; i < kWaiting; ++i) expect(fmt::format("wait{}", i), {}, "x");
  std::uint64_t begin = 0;
  for (std::size_t i = 0; i < kParts; ++i) {
    const auto bytes = std::uint64_t(random.Integer(1, 600)), gap = std::uint64_t(random.Chance(0.2) ? random.Integer(0, 300) : 0);
    expect("object", {begin, bytes}, begin < object.size() ? object.substr(begin, bytes) : "");
    begin += bytes + gap;
  }
  for (std::uint64_t i = 0; i < 3; ++i) expect("none", {100 * i, 100}, "", StatusCode::kNotFound);
  go.set_value();
  all.get_future().get();
  EXPECT_EQ(wrong, 0U);
  const WebTraffic traffic = transfers_.traffic().front();
  EXPECT_EQ(traffic.requests - traffic.retries, kWaiting + 2) << "one for each object";
}

TEST_F(HttpStoreTest, AMissingObjectIsAskedForOnce) {
  server_ = std::make_unique<ScriptedServer>([](const ServerRequest&) { return AnswerText("404 Not Found", ""); });
  const std::shared_ptr<Store> store = StoreAt(server_->url());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(Read(*store, "chunk").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(Read(*store, "chunk", {0, 4, true}).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(asked(), 1U);
  EXPECT_EQ(Read(*store, "other").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(asked(), 2U);
}

TEST_F(HttpStoreTest, AServerThatFailsAThirdGivesRightBytesAndIsNotFlooded) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  std::mutex mutex;
  const ScriptedServer server([&](const ServerRequest& request) -> std::string {
    int dice = 0;
    {
      const std::lock_guard lock(mutex);
      dice = int(random.Integer(0, 11));
    }
    if (dice == 0) return "";
    if (dice == 1) return "HTTP/1.1 200 OK\r\nContent-Length: 100\r\nConnection: close\r\n\r\ncut";
    if (dice < 4) return AnswerText(dice == 2 ? "500 x" : "503 x", "a page");
    return AnswerText("200 OK", request.target);
  });
  const std::shared_ptr<Store> store = StoreAt(server.url());
  constexpr int kReads = 20000;
  std::atomic<int> right = 0, wrong = 0, failed = 0;
  std::promise<void> all;
  for (int i = 0; i < kReads; ++i) {
    const std::string key = fmt::format("{}", i);
    store->Read(key, {}, 1000, [&, key](const Result<Bytes>& bytes) {
      const std::string text = bytes.ok() ? std::string(reinterpret_cast<const char*>(bytes->span().data()), bytes->size()) : "";
      ++(!bytes.ok() ? failed : text == "/" + key ? right : wrong);
      if (right + wrong + failed == kReads) all.set_value();
    });
  }
  all.get_future().get();
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(failed, kReads / 50) << "a third to the power of six is 27 of 20000";
  EXPECT_LE(server.most_at_a_time(), int(HttpTransfers::kMostOfAHost));
  const WebTraffic counts = transfers_.traffic().front();
  EXPECT_LE(counts.requests, server.requests().size()) << "libcurl repeats what meets a connection that is just closed";
  EXPECT_EQ(counts.requests, kReads + counts.retries);
  EXPECT_EQ(counts.failures, std::uint64_t(failed));
}

}  // namespace
}  // namespace slabstream
