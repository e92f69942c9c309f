// Stores: what they read, and what they refuse to.
#include "data/stores/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cstring>
#include <filesystem>
#include <future>
#include <set>
#include <thread>

#include "common/files/files.h"
#include "tests/data/stores/zip_files.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string Text(const Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.span().data()), bytes.size()}; }

Result<std::string> ReadPart(Store& store, const std::string& key, const ByteRange& range = {}, std::uint64_t most = 1000) {
  std::promise<Result<Bytes>> answer;
  store.Read(key, range, most, [&](Result<Bytes> bytes) { answer.set_value(std::move(bytes)); });
  const Result<Bytes> bytes = answer.get_future().get();
  if (!bytes.ok()) return bytes.status();
  return Text(*bytes);
}

StatusCode CodeOf(Store& store, const std::string& key, const ByteRange& range = {}, std::uint64_t most = 1000) {
  return ReadPart(store, key, range, most).status().code();
}

constexpr char kTen[] = "0123456789";

// A folder and archives with the objects a/ten, a/b/c and d.
class EveryStore : public testing::TestWithParam<std::string> {
 protected:
  EveryStore() {
    WriteFile(folder_ / "folder/a/ten", kTen);
    WriteFile(folder_ / "folder/a/b/c", "c");
    WriteFile(folder_ / "folder/d", "");
    for (const bool deflated : {false, true}) {
      WriteZip(folder_ / (deflated ? "deflated.zip" : "stored.ozx"),
               {{"a/ten", kTen, deflated}, {"a/b/c", "c", deflated}, {"d", "", deflated}});
    }
    Result<std::shared_ptr<Store>> store = OpenStore(folder_ / GetParam());
    CHECK(store.ok()) << store.status().message();
    store_ = *std::move(store);
  }

  TemporaryDirectory folder_;
  std::shared_ptr<Store> store_;
};

INSTANTIATE_TEST_SUITE_P(Stores, EveryStore, testing::Values("folder", "stored.ozx", "deflated.zip"),
                         [](const auto& which) { return which.param.substr(0, which.param.find('.')); });

TEST_P(EveryStore, ReadsObjectsAndPartsOfThem) {
  EXPECT_EQ(*ReadPart(*store_, "a/ten"), kTen);
  EXPECT_EQ(*ReadPart(*store_, "a/b/c"), "c");
  EXPECT_EQ(*ReadPart(*store_, "d"), "");
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.begin = 3, .bytes = 4}), "3456");
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.begin = 8}), "89");
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.bytes = 3, .from_end = true}), "789");
  EXPECT_EQ(Text(*ReadNow(*store_, "a/ten")), kTen);
}

TEST_P(EveryStore, GivesFewerBytesOfAnObjectThatEndsBeforeTheRange) {
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.begin = 8, .bytes = 5}), "89");
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.begin = 10, .bytes = 5}), "");
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.begin = ~std::uint64_t{0} - 1, .bytes = 5}), "");
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.bytes = 11, .from_end = true}), kTen);
}

TEST_P(EveryStore, ReadsNoMoreThanItMay) {
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {}, 10), kTen);
  EXPECT_EQ(CodeOf(*store_, "a/ten", {}, 9), StatusCode::kResourceExhausted);
  EXPECT_EQ(*ReadPart(*store_, "a/ten", {.begin = 1}, 9), "123456789");
  EXPECT_THAT(ReadPart(*store_, "a/ten", {}, 9).status().message(), HasSubstr("a/ten: has 10 bytes, at most 9 are read"));
}

TEST_P(EveryStore, RefusesKeysThatNameNoObject) {
  for (const std::string key : {"", "/", "/d", "a/", "a//ten", "..", "../folder/d", "a/../d", "a/./ten", "."}) {
    EXPECT_EQ(CodeOf(*store_, key), StatusCode::kInvalidArgument) << key;
    if (key.empty()) continue;
    EXPECT_EQ(store_->List(key).status().code(), StatusCode::kInvalidArgument) << key;
  }
  EXPECT_EQ(CodeOf(*store_, std::string("a\0b", 3)), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(*store_, std::string(5000, 'a')), StatusCode::kInvalidArgument);
  for (const char* const key : {"e", "a/b", "a", "a/ten/x", "a/b/c/d"}) EXPECT_EQ(CodeOf(*store_, key), StatusCode::kNotFound) << key;
}

TEST_P(EveryStore, ListsFolders) {
  EXPECT_THAT(*store_->List(""), ElementsAre("a/", "d"));
  EXPECT_THAT(*store_->List("a"), ElementsAre("b/", "ten"));
  EXPECT_EQ(store_->List("e").status().code(), StatusCode::kNotFound);
}

TEST_P(EveryStore, AnswersManyAtATimeWithFewThreads) {
  constexpr int kReads = 500;
  std::atomic<int> right = 0, left = kReads;
  std::mutex mutex;
  std::set<std::thread::id> threads;
  std::promise<void> all;
  for (int i = 0; i < kReads; ++i) {
    store_->Read("a/ten", {.begin = std::uint64_t(i % 10), .bytes = 1}, 1, [&, i](Result<Bytes> bytes) {
      if (bytes.ok() && Text(*bytes) == std::string(1, kTen[i % 10])) ++right;
      {
        const std::lock_guard lock(mutex);
        threads.insert(std::this_thread::get_id());
      }
      if (--left == 0) all.set_value();
    });
  }
  all.get_future().wait();
  EXPECT_EQ(right, kReads);
  EXPECT_LE(threads.size(), 8U);
}

TEST(FileStoreTest, HasOneObject) {
  const TemporaryDirectory folder;
  WriteFile(folder / "file.bin", kTen);
  const Result<std::shared_ptr<Store>> store = OpenStore(folder / "file.bin");
  EXPECT_EQ(*ReadPart(**store, "file", {.begin = 2, .bytes = 2}), "23");
  EXPECT_EQ(CodeOf(**store, "other"), StatusCode::kInvalidArgument);
  EXPECT_THAT(*(*store)->List(""), ElementsAre("file"));
  std::filesystem::remove(folder / "file.bin");
  EXPECT_EQ(CodeOf(**store, "file"), StatusCode::kNotFound);
  EXPECT_EQ(OpenStore(folder / "file.bin").status().code(), StatusCode::kNotFound);
}

TEST(FolderStoreTest, FollowsLinksInsideOnly) {
  const TemporaryDirectory folder;
  WriteFile(folder / "store/a/inside", "in");
  WriteFile(folder / "secret/file", "out");
  std::filesystem::create_symlink("a/inside", folder / "store/link");
  std::filesystem::create_symlink("../secret/file", folder / "store/up");
  std::filesystem::create_symlink(folder / "secret/file", folder / "store/absolute");
  std::filesystem::create_directory_symlink("../secret", folder / "store/folder");
  std::filesystem::create_symlink("round", folder / "store/round");
  const auto store = FolderStore(folder / "store");
  EXPECT_EQ(*ReadPart(*store, "link"), "in");
  for (const char* const key : {"up", "absolute", "folder/file", "round"}) {
    const Status status = ReadPart(*store, key).status();
    EXPECT_EQ(status.code(), StatusCode::kUnavailable) << key;
    EXPECT_THAT(status.message(), HasSubstr("is not followed")) << key;
  }
  EXPECT_EQ(store->List("folder").status().code(), StatusCode::kUnavailable);
  const auto following = FolderStore(folder / "store", Links::kMayLeadOut);
  for (const char* const key : {"up", "absolute", "folder/file"}) EXPECT_EQ(*ReadPart(*following, key), "out") << key;
  EXPECT_THAT(*following->List("folder"), ElementsAre("file"));
  EXPECT_EQ(CodeOf(*following, "../secret/file"), StatusCode::kInvalidArgument);
  // Chunks that are not there have the fill value; those that were not fetched must not.
  std::filesystem::create_symlink("../annex/key", folder / "store/unfetched");
  EXPECT_THAT(ReadPart(*following, "unfetched").status().message(), HasSubstr("is a link to a file that is not there"));
  EXPECT_EQ(CodeOf(*following, "nothing"), StatusCode::kNotFound);
  // The store itself may be behind a link: its name is the operator's.
  std::filesystem::create_directory_symlink("store", folder / "alias");
  EXPECT_EQ(*ReadPart(*FolderStore(folder / "alias"), "a/inside"), "in");
}

TEST(FolderStoreTest, ReadsRegularFilesOnly) {
  const TemporaryDirectory folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  const auto store = FolderStore(folder.path());
  const Status status = ReadPart(*store, "pipe").status();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr("pipe: is no regular file"));
  EXPECT_EQ(CodeOf(*FileStore("/dev/zero"), "file"), StatusCode::kUnavailable);
}

TEST(ZipStoreTest, RefusesWhatIsNoArchive) {
  const TemporaryDirectory folder;
  WriteFile(folder / "text.zip", "not an archive at all");
  EXPECT_EQ(ZipStore(folder / "text.zip").status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(ZipStore(folder / "none.zip").status().code(), StatusCode::kNotFound);
}

TEST(ZipStoreTest, ABombTakesNoMoreThanItMay) {
  const TemporaryDirectory folder;
  WriteZip(folder / "bomb.zip", {{"zeros", std::string(std::size_t{64} << 20, '\0'), true}});
  ASSERT_LT(std::filesystem::file_size(folder / "bomb.zip"), 100'000U);
  const auto store = *ZipStore(folder / "bomb.zip");
  EXPECT_EQ(CodeOf(*store, "zeros", {}, 1 << 20), StatusCode::kResourceExhausted);
  EXPECT_EQ(ReadPart(*store, "zeros", {.begin = 1 << 25, .bytes = 3})->size(), 3U);
}

// All places where a size stands in an archive of one member say something else.
TEST(ZipStoreTest, AMemberOfAnotherSizeIsDamaged) {
  const TemporaryDirectory folder;
  for (const bool deflated : {false, true}) {
    constexpr std::uint32_t kBytes = 1000;
    for (const std::uint32_t lie : {kBytes - 1, kBytes + 1}) {
      const std::string path = folder / (std::to_string(lie) + (deflated ? "d.zip" : "s.zip"));
      WriteZip(path, {{"member", std::string(kBytes, 'x'), deflated}});
      std::string archive = ReadFile(path);
      std::string number(4, '\0'), other(4, '\0');
      std::memcpy(number.data(), &kBytes, 4);
      std::memcpy(other.data(), &lie, 4);
      int changed = 0;
      for (std::size_t at = 0; (at = archive.find(number, at)) != std::string::npos; at += 4, ++changed) archive.replace(at, 4, other);
      ASSERT_GE(changed, 2);
      WriteFile(path, archive);
      const Result<std::shared_ptr<Store>> store = ZipStore(path);
      if (!store.ok()) continue;  // libzip has seen it
      const Status status = ReadPart(**store, "member", {}, 1 << 20).status();
      EXPECT_EQ(status.code(), StatusCode::kDataLoss) << path;
      EXPECT_THAT(status.message(), HasSubstr("member: damaged"));
    }
  }
}

TEST(ZipStoreTest, ComparesChecksums) {
  const TemporaryDirectory folder;
  WriteZip(folder / "a.zip", {{"member", "the bytes of a member"}});
  std::string archive = ReadFile(folder / "a.zip");
  archive[archive.find("bytes")] = 'B';
  WriteFile(folder / "a.zip", archive);
  EXPECT_EQ(CodeOf(**ZipStore(folder / "a.zip"), "member"), StatusCode::kDataLoss);
}

TEST(ZipStoreTest, ADirectoryThatLiesAboutItsEntriesIsRefused) {
  const TemporaryDirectory folder;
  WriteZip(folder / "a.zip", {{"member", "bytes"}});
  std::string archive = ReadFile(folder / "a.zip");
  const std::size_t end = archive.rfind("PK\5\6");
  ASSERT_NE(end, std::string::npos);
  archive[end + 8] = archive[end + 10] = char(0xff);
  archive[end + 9] = archive[end + 11] = char(0xfe);
  WriteFile(folder / "a.zip", archive);
  EXPECT_FALSE(ZipStore(folder / "a.zip").ok());
}

}  // namespace
}  // namespace slabstream
