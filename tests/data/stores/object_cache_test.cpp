#include "data/stores/object_cache.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <thread>
#include <vector>

#include "data/stores/http_transfers.h"
#include "data/stores/store.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/text_of.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t kBudget = 1 << 20;

Bytes BytesOf(const std::string& text) {
  const auto data = std::as_bytes(std::span(text));
  return Bytes(std::vector<std::byte>(data.begin(), data.end()));
}

class ObjectCacheTest : public testing::Test {
 protected:
  ObjectCache Open() const { return ObjectCache::Open(folder_, kBudget).value(); }
  std::vector<fs::path> Files() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.is_regular_file()) files.push_back(entry.path());
    }
    return files;
  }
  std::uint64_t Size() const {
    std::uint64_t bytes = 0;
    for (const fs::path& file : Files()) bytes += fs::file_size(file);
    return bytes;
  }

  const TemporaryDirectory temporary_;
  const std::string folder_ = temporary_ / "objects";
};

TEST_F(ObjectCacheTest, KeepsWhatItWasGivenForOtherProcessesAndLaterOnes) {
  ObjectCache first = Open(), second = Open();
  EXPECT_FALSE(first.Find("a"));
  first.Keep("a", {"\"v1\"", 100, BytesOf("ten bytes.")});
  first.Keep("empty", {"\"v2\"", 0, {}});
  ObjectCache third = Open();
  for (ObjectCache* cache : {&first, &second, &third}) {
    const auto a = cache->Find("a"), empty = cache->Find("empty");
    ASSERT_TRUE(a && empty);
    EXPECT_EQ(a->version, "\"v1\"");
    EXPECT_EQ(a->size, 100U);
    EXPECT_EQ(TextOf(a->bytes.span()), "ten bytes.");
    EXPECT_EQ(empty->bytes.size(), 0U);
  }
  second.Keep("a", {"\"v3\"", 7, BytesOf("changed")});
  EXPECT_EQ(TextOf(first.Find("a")->bytes.span()), "changed");
  first.Keep("large", {"\"v\"", 1, BytesOf(std::string(kBudget / 16 + 1, 'x'))});
  EXPECT_FALSE(first.Find("large"));
}

TEST_F(ObjectCacheTest, WhatIsDamagedIsNotUsedAndGoes) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  ObjectCache cache = Open();
  for (int round = 0; round < 200; ++round) {
    cache.Keep("a", {"\"v1\"", 1000, BytesOf(std::string(1000, 'x'))});
    ASSERT_EQ(Files().size(), 1U);
    const fs::path file = Files()[0];
    const auto size = fs::file_size(file);
    if (random.Chance(0.5)) {
      fs::resize_file(file, random.Integer<std::uintmax_t>(0, size - 1));
    } else {
      std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
      const auto at = std::streamoff(random.Integer<std::uintmax_t>(0, size - 1));
      stream.seekg(at);
      const char changed = char(stream.get() ^ (1 << random.Integer(0, 7)));
      stream.seekp(at);
      stream.put(changed);
    }
    EXPECT_FALSE(cache.Find("a")) << "round " << round;
    EXPECT_TRUE(Files().empty());
  }
}

TEST_F(ObjectCacheTest, WhatWasUsedLongestAgoLeavesWithinTheBudget) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  ObjectCache first = Open(), second = Open();
  first.Keep("kept", {"\"v\"", 3, BytesOf("abc")});
  for (int i = 0; i < 300; ++i) {
    ObjectCache& cache = random.Chance(0.5) ? first : second;
    cache.Keep(fmt::format("object {}", i), {"\"v\"", 1, BytesOf(std::string(random.Integer<std::size_t>(1000, 30000), 'x'))});
    EXPECT_LE(Size(), kBudget);
    EXPECT_TRUE(cache.Find("kept")) << "it is used again and again";
  }
  EXPECT_TRUE(first.Find("object 299"));
  EXPECT_FALSE(first.Find("object 0"));
  EXPECT_GT(Size(), kBudget / 2);
  // One that opens the folder with a smaller budget makes room at once.
  EXPECT_TRUE(ObjectCache::Open(folder_, kBudget / 8).ok());
  EXPECT_LE(Size(), kBudget / 8);
}

// Of sparse volumes: many objects of few bytes. Each takes a block of the disk, and a file.
TEST_F(ObjectCacheTest, SmallObjectsStayWithinTheBudgetOfTheDisk) {
  ObjectCache cache = Open();
  constexpr std::uint64_t kLeastBlock = 4096, kUnit = 512;
  for (int i = 0; i < 2000; ++i) cache.Keep(fmt::format("object {}", i), {"\"v\"", 1, BytesOf(fmt::format("{}", i))});
  std::uint64_t bytes = 0;
  for (const fs::path& file : Files()) {
    struct stat found {};
    ASSERT_EQ(::stat(file.c_str(), &found), 0);
    bytes += std::max(kUnit * std::uint64_t(found.st_blocks), std::uint64_t(found.st_size));
  }
  EXPECT_LE(bytes, kBudget);
  EXPECT_LE(Files().size(), kBudget / kLeastBlock);
  EXPECT_GT(Files().size(), kBudget / kLeastBlock / 2);
  EXPECT_EQ(TextOf(cache.Find("object 1999")->bytes.span()), "1999");
}

TEST_F(ObjectCacheTest, NobodyElseReadsWhatIsKept) {
  Open().Keep("a", {"\"v\"", 1, BytesOf("voxels")});
  fs::permissions(folder_, fs::perms::owner_all | fs::perms::group_all);
  Open();
  for (const auto& each : fs::recursive_directory_iterator(temporary_.path())) {
    EXPECT_EQ(each.status().permissions() & (fs::perms::group_all | fs::perms::others_all), fs::perms::none) << each.path();
  }
  EXPECT_EQ(Files().size(), 1U);
}

TEST_F(ObjectCacheTest, AFolderThatCannotBeWrittenIsNamed) {
  std::ofstream(temporary_ / "file") << "no folder";
  const Status status = ObjectCache::Open(temporary_ / "file" + "/objects", kBudget).status();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), testing::HasSubstr((temporary_ / "file").c_str()));
}

// ---------------------------------------------------------------- with a server

// Reads by transfers and a store of their own, as another process would.
std::string Read(const ScriptedServer& server, ObjectCache& cache, WebTraffic& counts, const ByteRange& range = {}) {
  HttpTransfers transfers({});
  const std::shared_ptr<Store> store = HttpStore(server.url(), transfers, &cache).value();
  std::promise<Result<Bytes>> answer;
  store->Read("object", range, 1000, [&](Result<Bytes> bytes) { answer.set_value(std::move(bytes)); });
  const Bytes bytes = answer.get_future().get().value();
  counts = transfers.traffic().front();
  return TextOf(bytes.span());
}

TEST_F(ObjectCacheTest, OnlyWhatTheServerHasChangedIsSentAgain) {
  std::atomic<int> version = 1;
  const ScriptedServer server([&](const ServerRequest& request) {
    const std::string tag = fmt::format("\"v{}\"", version.load());
    if (request.header("if-none-match") == tag) return std::string("HTTP/1.1 304 Not Modified\r\nContent-Length: 0\r\n\r\n");
    return AnswerText("200 OK", fmt::format("version {}", version.load()), "ETag: " + tag + "\r\n");
  });
  ObjectCache cache = Open();
  // It is written beside the answer, so it may take a few answers until it is there.
  const auto read_until_kept = [&](const std::string& expected) {
    WebTraffic counts;
    do {
      EXPECT_EQ(Read(server, cache, counts), expected);
      std::this_thread::yield();
    } while (counts.unchanged == 0);
    EXPECT_EQ(counts.bytes, 0U);
    EXPECT_EQ(counts.answered(), 0U);
  };
  read_until_kept("version 1");
  version = 2;
  WebTraffic counts;
  EXPECT_EQ(Read(server, cache, counts), "version 2");
  EXPECT_EQ(counts.unchanged, 0U);
  read_until_kept("version 2");
}

TEST_F(ObjectCacheTest, WithoutAStrongETagNothingIsKept) {
  for (const char* const header : {"", "ETag: W/\"weak\"\r\n", "Last-Modified: Thu, 26 Nov 2026 10:00:00 GMT\r\n"}) {
    const ScriptedServer server([&](const ServerRequest&) { return AnswerText("200 OK", "bytes", header); });
    ObjectCache cache = Open();
    WebTraffic counts;
    for (int i = 0; i < 3; ++i) EXPECT_EQ(Read(server, cache, counts), "bytes");
    for (const ServerRequest& request : server.requests()) EXPECT_EQ(request.header("if-none-match"), "");
    EXPECT_TRUE(Files().empty());
  }
}

TEST_F(ObjectCacheTest, WhatTheServerHasJustSaidIsNotAskedAgain) {
  std::atomic<int> asked = 0;
  ScriptedServer server([&](const ServerRequest& request) {
    ++asked;
    if (request.header("if-none-match") == "\"v1\"") return AnswerText("304 Not Modified", "", "ETag: \"v1\"\r\n");
    return AnswerText("200 OK", "served", "ETag: \"v1\"\r\n");
  });
  ObjectCache cache = Open();
  HttpTransfers transfers({});
  const std::shared_ptr<Store> store = HttpStore(server.url(), transfers, &cache).value();
  EXPECT_EQ(TextOf(ReadNow(*store, "object")->span()), "served");
  while (!cache.Find(server.url() + "/object")) std::this_thread::yield();
  const int before = asked;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(TextOf(ReadNow(*store, "object")->span()), "served");
  EXPECT_EQ(asked, before);
  const std::shared_ptr<Store> later = HttpStore(server.url(), transfers, &cache).value();
  EXPECT_EQ(TextOf(ReadNow(*later, "object")->span()), "served");
  EXPECT_EQ(asked, before + 1) << "another process does not know what the server said";
}

}  // namespace
}  // namespace slabstream
