// Objects behind web servers, honest and other ones.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "common/files/files.h"
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

// Of an object, what a request asks for, as web servers answer it.
std::string AnswerPart(const ServerRequest& request, const std::string& object, const std::string& headers = "") {
  std::size_t begin = 0, last = 0;
  if (request.method == "HEAD") return fmt::format("HTTP/1.1 200 OK\r\nContent-Length: {}\r\n{}\r\n", object.size(), headers);
  if (std::sscanf(request.header("range").c_str(), "bytes=%zu-%zu", &begin, &last) != 2) return AnswerText("200 OK", object, headers);
  const std::string all = fmt::format("/{}\r\n", object.size());
  if (begin >= object.size()) return AnswerText("416 x", "", "Content-Range: bytes *" + all + headers);
  const std::string part = object.substr(begin, last + 1 - begin);
  return AnswerText("206 x", part, fmt::format("Content-Range: bytes {}-{}{}{}", begin, begin + part.size() - 1, all, headers));
}

std::string FromHex(const std::string& digits) {
  std::string bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2) bytes += char(std::stoi(digits.substr(i, 2), nullptr, 16));
  return bytes;
}

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
  for (const bool has_tags : {true, false}) {
    std::atomic<int> version = 1;
    const ScriptedServer server([&](const ServerRequest& request) {
      const std::string tag = has_tags ? fmt::format("ETag: \"{}\"\r\n", version.load()) : "";
      const std::string object = version == 1 ? kTen : version == 2 ? "abcdefghij" : "0123456789x";
      return AnswerPart(request, object, tag);
    });
    const std::shared_ptr<Store> store = StoreAt(server.url());
    EXPECT_EQ(Read(*store, "whole").value(), kTen);
    EXPECT_EQ(Read(*store, "parts", {2, 3}).value(), "234");
    for (const int changed : {2, 3}) {  // other bytes, another size
      version = changed;
      std::vector<Status> reads = {Read(*store, "parts", {2, 3}).status(), Read(*store, "whole").status()};
      if (has_tags) reads.push_back(Read(*store, "parts", {7, 2}).status());  // only its version tells
      for (const Status& status : reads) {
        EXPECT_EQ(status.code(), StatusCode::kUnavailable);
        EXPECT_THAT(status.message(), HasSubstr("has changed since it was opened"));
      }
    }
    version = 2;
    EXPECT_EQ(Read(*store, "another").value(), "abcdefghij");
    EXPECT_EQ(Read(*StoreAt(server.url()), "parts", {2, 3}).value(), "cde") << "who opens it now sees the new one";
  }
}

// Replicas behind one address have ETags of their own; pages made on request are as old as the answer.
TEST_F(HttpStoreTest, OtherVersionsOfTheSameBytesAreNoChange) {
  for (const std::string name : {"ETag: \"{}\"\r\n", "Last-Modified: Thu, 01 Jan 1970 00:00:{:02} GMT\r\n"}) {
    std::atomic<int> count = 0;
    const ScriptedServer server([&](const ServerRequest& request) {
      const int turn = ++count;
      return AnswerPart(request, kTen, fmt::format(fmt::runtime(name), name.starts_with("E") ? turn % 2 : turn % 60));
    });
    const std::shared_ptr<Store> store = StoreAt(server.url());
    EXPECT_EQ(Read(*store, "shard", {0, 4, true}).value(), "6789");
    for (std::uint64_t i = 0; i < 8; ++i) EXPECT_EQ(Read(*store, "shard", {i, 2}).value(), std::string(kTen).substr(i, 2));
    EXPECT_EQ(Read(*store, "shard").value(), kTen);
  }
}

// ---- servers that answer otherwise

// A bucket that does not let strangers list it says 403 of what is not there.
TEST_F(HttpStoreTest, ForbiddenIsMissingWhereOthersCanBeRead) {
  std::atomic<bool> open = true;
  const ScriptedServer server([&](const ServerRequest& request) {
    if (open && request.target.starts_with("/there")) return AnswerText("200 OK", kTen);
    if (request.target == "/empty") return std::string("HTTP/1.1 204 No Content\r\n\r\n");
    return AnswerText("403 Forbidden", "<?xml?><Error><Code>AccessDenied</Code></Error>");
  });
  const std::shared_ptr<Store> store = StoreAt(server.url());
  const Status first = Read(*store, "missing").status();
  EXPECT_EQ(first.code(), StatusCode::kUnavailable) << "perhaps all is forbidden";
  EXPECT_THAT(first.message(), HasSubstr("HTTP 403 (AccessDenied): it is not public"));
  EXPECT_EQ(Read(*store, "there").value(), kTen);
  EXPECT_EQ(Read(*store, "empty").status().code(), StatusCode::kNotFound);
  std::atomic<int> left = 40, missing = 0;
  std::promise<void> all;
  for (int i = 0; i < 40; ++i) {
    store->Read(fmt::format("missing{}", i), i % 2 == 0 ? ByteRange{} : ByteRange{0, 4, true}, 100, [&](const Result<Bytes>& bytes) {
      if (bytes.status().code() == StatusCode::kNotFound) ++missing;
      if (--left == 0) all.set_value();
    });
  }
  all.get_future().get();
  EXPECT_EQ(missing, 40);
  // A token that has run out must not look like missing chunks.
  open = false;
  EXPECT_EQ(Read(*store, "there2").status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(Read(*store, "missing").status().code(), StatusCode::kUnavailable);
  open = true;
  EXPECT_EQ(Read(*store, "there2").value(), kTen);
  EXPECT_THAT(FailureOf([](const ServerRequest&) { return AnswerText("401 Unauthorized", ""); }).message(), HasSubstr("HTTP 401"));
}

TEST_F(HttpStoreTest, APageOfHtmlIsNoObject) {
  const std::string page = "\n<!DOCTYPE html><html><body>log in</body></html>";
  const ScriptedServer server([&](const ServerRequest& request) {
    return request.target == "/there" ? AnswerText("200 OK", kTen, "Content-Type: text/html\r\n")
                                      : AnswerPart(request, page, "Content-Type: text/html; charset=utf-8\r\n");
  });
  const std::shared_ptr<Store> store = StoreAt(server.url());
  EXPECT_EQ(Read(*store, "chunk").status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(Read(*store, "there").value(), kTen) << "what it is called is not what it is";
  EXPECT_EQ(Read(*store, "chunk").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(Read(*store, "shard", {0, 4, true}).status().code(), StatusCode::kNotFound);
}

TEST_F(HttpStoreTest, SizesAreKnownWithoutHead) {
  const auto unsized = [](const ServerRequest&) { return std::string("HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n"); };
  const std::pair<std::string, ScriptedServer::Script> heads[] = {{"without a length", unsized},
                                                                  {"405", [](const ServerRequest&) { return AnswerText("405 x", ""); }},
                                                                  {"403", [](const ServerRequest&) { return AnswerText("403 x", ""); }},
                                                                  {"501", [](const ServerRequest&) { return AnswerText("501 x", ""); }}};
  const std::string large(1000, 'x');
  for (const auto& [name, head] : heads) {
    const ScriptedServer server([&](const ServerRequest& request) {
      if (request.method == "HEAD") return head(request);
      return AnswerPart(request, request.target == "/large" ? large : request.target == "/none" ? "" : kTen);
    });
    const std::shared_ptr<Store> store = StoreAt(server.url());
    EXPECT_EQ(Read(*store, "ten", {0, 4, true}).value(), "6789") << name;
    EXPECT_EQ(Read(*store, "ten", {4, ByteRange::kAll}).value(), "456789") << name;
    EXPECT_EQ(Read(*store, "large", {0, 4, true}).value(), "xxxx") << name;
    EXPECT_EQ(Read(*store, "none", {0, 4, true}).value(), "") << name;
  }
}

TEST_F(HttpStoreTest, WhatComesEncodedIsDecoded) {
  // "0123456789" as `gzip -n` and `brotli` write it.
  const std::string gzip = FromHex("1f8b08000000000000033330343236313533b7b00400c6c784a60a000000");
  const std::string brotli = FromHex("8b04803031323334353637383903");
  const auto answer = [](const std::string& body, const std::string& encoding) {
    return [=](const ServerRequest& request) {
      EXPECT_EQ(request.header("accept-encoding"), "");
      return AnswerText("200 OK", body, "Content-Encoding: " + encoding + "\r\n");
    };
  };
  const auto read = [&](const ScriptedServer::Script& script, const std::string& key, std::uint64_t most = 1000) {
    const ScriptedServer server(script);
    return Read(*StoreAt(server.url()), key, {}, most);
  };
  EXPECT_EQ(read(answer(gzip, "gzip"), "zarr.json").value(), kTen);
  EXPECT_EQ(read(answer(brotli, "br"), "zarr.json").value(), kTen);
  EXPECT_EQ(read(answer(gzip, "gzip"), "info.gz").value(), gzip) << "the name says that it is compressed";
  EXPECT_EQ(read(answer(kTen, "gzip"), "chunk").value(), kTen) << "what is said is not so";
  EXPECT_EQ(read(answer(kTen, "aws-chunked"), "chunk").value(), kTen);
  EXPECT_EQ(read(answer(gzip, "gzip"), "zarr.json", 9).status().code(), StatusCode::kResourceExhausted);
}

// ---- what goes along with requests

TEST_F(HttpStoreTest, QueryAndHeadersGoToThisServerAlone) {
  const TemporaryDirectory folder;
  ASSERT_TRUE(WriteTextFile(folder / "token", "Bearer secret\n").ok());
  ASSERT_TRUE(WriteTextFile(folder / "lines", "a\nb\n").ok());
  const ScriptedServer other([](const ServerRequest&) { return AnswerText("200 OK", "x"); });
  const ScriptedServer server([&](const ServerRequest& request) {
    const bool right = request.header("authorization") == "Bearer secret" && request.header("x-more") == "1";
    if (request.target.ends_with("?away")) return AnswerText("302 x", "", fmt::format("Location: {}/x\r\n", other.url()));
    return AnswerText(right && request.target == "/a%20b?sig=secret%2B" ? "200 OK" : "401 x", kTen);
  });
  const auto open = [&](const std::string& query, const std::string& file) {
    return HttpStore(server.url(), transfers_, nullptr, {.query = query, .headers = {"Authorization:@" + folder / file, "X-More: 1"}});
  };
  EXPECT_EQ(Read(*open("sig=secret%2B", "token").value(), "a b").value(), kTen);
  const Status refused = Read(*open("sig=other", "token").value(), "a b").status();
  EXPECT_THAT(refused.message(), HasSubstr("/a%20b: HTTP 401"));
  EXPECT_EQ(Read(*open("away", "token").value(), "a").value(), "x");
  ASSERT_EQ(other.requests().size(), 1U);
  EXPECT_EQ(other.requests().front().header("authorization"), "") << "another port is another server";
  EXPECT_EQ(other.requests().front().target, "/x");
  for (const char* file : {"lines", "none"}) {
    EXPECT_EQ(open("", file).status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(open("", file).status().message(), HasSubstr("header Authorization: "));
  }
}

// More requests than may be under way at a time: those that wait do not wait for a turn each.
TEST_F(HttpStoreTest, ASilentServerIsLeftInTimeByAllWhoWait) {
  HttpTransfers impatient({.first_pause = milliseconds(1), .stalled = seconds(20), .silence = seconds(1), .rest = std::chrono::hours(1)});
  std::promise<void> end;
  const std::shared_future<void> ended(end.get_future());
  const ScriptedServer server([&](const ServerRequest&) {
    ended.wait();
    return std::string();
  }),
      other([](const ServerRequest&) { return AnswerText("200 OK", kTen); });
  const std::shared_ptr<Store> store = HttpStore(server.url(), impatient).value();
  constexpr std::size_t kReads = 10 * HttpTransfers::kMostOfAHost;
  std::vector<std::promise<Status>> ends(kReads);
  for (std::size_t i = 0; i < kReads; ++i) {
    store->Read(fmt::format("{}", i), {}, 1000, [&, i](const Result<Bytes>& bytes) { ends[i].set_value(bytes.status()); });
  }
  for (std::promise<Status>& each : ends) {
    const Status failure = each.get_future().get();
    EXPECT_EQ(failure.code(), StatusCode::kUnavailable);
    EXPECT_THAT(failure.message(), testing::AllOf(HasSubstr(fmt::format("no answer from 127.0.0.1:{} within 1 s", server.port())),
                                                  HasSubstr("less than 1024 bytes a second")));
  }
  const std::size_t requests = server.requests().size();
  EXPECT_LE(requests, HttpTransfers::kMostOfAHost);
  EXPECT_EQ(Read(*store, "later").status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(server.requests().size(), requests) << "it is not asked again at once";
  EXPECT_EQ(Read(**HttpStore(other.url(), impatient), "object").value(), kTen) << "another server is";
  end.set_value();
}

TEST_F(HttpStoreTest, AServerThatSaysWhenToComeBackIsNotSilentUntilThen) {
  HttpTransfers impatient({.first_pause = milliseconds(1), .silence = milliseconds(100)});
  std::atomic<int> count = 0;
  const ScriptedServer server(
      [&](const ServerRequest&) { return ++count == 1 ? AnswerText("503 x", "", "Retry-After: 1\r\n") : AnswerText("200 OK", kTen); });
  EXPECT_EQ(Read(**HttpStore(server.url(), impatient), "object").value(), kTen);
}

TEST_F(HttpStoreTest, AServerThatWasSilentIsAskedAgain) {
  HttpTransfers impatient({.first_pause = milliseconds(1), .stalled = seconds(20), .silence = seconds(1), .rest = milliseconds(0)});
  std::promise<void> end;
  const std::shared_future<void> ended(end.get_future());
  std::atomic<int> count = 0;
  const ScriptedServer server([&](const ServerRequest&) {
    if (++count == 1) ended.wait();
    return AnswerText("200 OK", kTen);
  });
  const std::shared_ptr<Store> store = HttpStore(server.url(), impatient).value();
  EXPECT_EQ(Read(*store, "object").status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(Read(*store, "object").value(), kTen);
  end.set_value();
}

TEST_F(HttpStoreTest, WhatNobodyWantsAnyMoreEndsAtOnce) {
  std::promise<void> end, asked;
  const std::shared_future<void> ended(end.get_future());
  std::atomic<int> count = 0;
  const ScriptedServer server([&](const ServerRequest&) {
    if (++count == int(HttpTransfers::kMostOfAHost)) asked.set_value();
    ended.wait();
    return AnswerText("200 OK", kTen);
  });
  const std::shared_ptr<Store> store = StoreAt(server.url());
  std::atomic<bool> wanted = true;
  std::vector<std::promise<Result<Bytes>>> answers(2 * HttpTransfers::kMostOfAHost);  // so that some wait
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const auto done = [&answer = answers[i]](Result<Bytes> bytes) { answer.set_value(std::move(bytes)); };
    store->Read(std::to_string(i), {}, 1000, done, [&] { return wanted.load(); });
  }
  asked.get_future().wait();
  wanted = false;
  for (auto& answer : answers) EXPECT_EQ(answer.get_future().get().status().code(), StatusCode::kCancelled);
  end.set_value();
}

TEST_F(HttpStoreTest, AStoreThatIsToldToStopReadsNothingMore) {
  std::promise<void> end, asked;
  const std::shared_future<void> ended(end.get_future());
  const ScriptedServer server([&](const ServerRequest& request) {
    if (request.target == "/other") return AnswerText("200 OK", kTen);
    asked.set_value();
    ended.wait();
    return AnswerText("200 OK", kTen);
  });
  std::stop_source stop;
  std::shared_ptr<Store> store;
  {
    const StoresStop of_store(stop.get_token());
    store = StoreAt(server.url());
  }
  const std::shared_ptr<Store> other = StoreAt(server.url());
  std::future<Result<Bytes>> read = BeginRead(*store, "object");
  asked.get_future().wait();
  stop.request_stop();
  EXPECT_EQ(read.get().status().code(), StatusCode::kCancelled);
  EXPECT_EQ(Read(*other, "other").value(), kTen);
  end.set_value();
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
  // localhost was named, 127.0.0.1 was not; but both are this machine.
  const ScriptedServer elsewhere([&](const ServerRequest&) { return leads_to(here.url() + "/moved"); });
  EXPECT_EQ(Read(*StoreAt(fmt::format("http://localhost:{}", elsewhere.port())), "object").value(), kTen);
  for (const char* const address : {"10.0.0.1", "192.168.1.1", "100.64.0.1", "100.100.100.200", "169.254.169.254", "192.0.0.192", "0.0.0.0",
                                    "[fd00:ec2::254]", "[fd12::1]", "[fe80::1]", "[::ffff:10.0.0.1]"}) {
    const Status refused = FailureOf([&](const ServerRequest&) { return leads_to(fmt::format("http://{}:1/x", address)); });
    EXPECT_EQ(refused.code(), StatusCode::kUnavailable);
    EXPECT_THAT(refused.message(),
                testing::AllOf(HasSubstr(fmt::format("leads to {}:1, which is an address of", address)), HasSubstr("was not named")));
    EXPECT_EQ(asked(), 1U);
  }
}

// ---- answers without an end

// What an answer sends again and again, and never ends.
class EndlessServer : public ScriptedServer {
 public:
  EndlessServer(std::string begin, std::string more) : ScriptedServer([=](const ServerRequest&) { return begin + Repeated(more); }) {}

 private:
  // More than anybody takes.
  static std::string Repeated(const std::string& text) {
    constexpr std::size_t kBytes = 4 << 20;
    std::string all;
    while (all.size() < kBytes) all += text;
    return all;
  }
};

TEST_F(HttpStoreTest, AnswersWithoutAnEndAreLeft) {
  const std::string chunked = "Transfer-Encoding: chunked\r\n\r\n", chunk = "400\r\n" + std::string(1024, 'z') + "\r\n";
  const std::string field = "X-More: " + std::string(1000, 'x') + "\r\n";
  const std::tuple<const char*, std::string, std::string, const char*> answers[] = {
      {"a page of an error", "HTTP/1.1 403 Forbidden\r\n" + chunked, chunk, "HTTP 403, with a page of more than 1048576 bytes"},
      {"a page of what is not there", "HTTP/1.1 404 Not Found\r\n" + chunked, chunk, "HTTP 404, with a page of more than"},
      {"a page of what may pass", "HTTP/1.1 503 x\r\n" + chunked, chunk, "HTTP 503, with a page of more than"},
      {"a redirect", "HTTP/1.1 302 Found\r\nLocation: /other\r\n" + chunked, chunk, "HTTP 302, with a page of more than"},
      {"headers", "HTTP/1.1 200 OK\r\n", field, "headers"},
      {"answers before the answer", "", "HTTP/1.1 103 Early Hints\r\n" + field + "\r\n", "headers"},
      {"trailers", "HTTP/1.1 200 OK\r\n" + chunked + "1\r\nx\r\n0\r\n", field, "headers"}};
  for (const auto& [what, begin, more, reason] : answers) {
    const EndlessServer server(begin, more);
    const Status left = Read(*StoreAt(server.url()), "object").status();
    EXPECT_EQ(left.code(), StatusCode::kUnavailable) << what;
    EXPECT_THAT(left.message(), HasSubstr(reason)) << what;
    EXPECT_EQ(server.requests().size(), 1U) << what;
  }
}

TEST_F(HttpStoreTest, AVersionThatIsTooLongToRememberIsNone) {
  const ScriptedServer server(
      [](const ServerRequest& request) { return AnswerPart(request, kTen, fmt::format("ETag: \"{}\"\r\n", std::string(10'000, 'x'))); });
  std::promise<Result<HttpObject>> answer;
  transfers_.Get({.url = server.url() + "/object", .span = {}, .most = 100},
                 [&](Result<HttpObject> object) { answer.set_value(std::move(object)); });
  const Result<HttpObject> object = answer.get_future().get();
  ASSERT_TRUE(object.ok());
  EXPECT_EQ(object->version, "");
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
    return request.target == "/none" ? AnswerText("404 x", "") : AnswerPart(request, object);
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
