#include "common/files/file_stamp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

class FileStampTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return directory_ + "/" + name; }
  void Write(const std::string& name, const std::string& text) const { std::ofstream(Path(name), std::ios::binary) << text; }
  static bool Changed(const FileStamp& stamp) { return HaveChanged(stamp).value(); }

  TemporaryDirectory temporary_;
  const std::string directory_ = temporary_.path();
};

TEST_F(FileStampTest, AFileThatIsLeftAloneHasNotChanged) {
  Write("a", "abc");
  const FileStamp stamp = StampFiles({Path("a")}).value();
  std::ifstream(Path("a")).get();
  Write("b", "beside it");
  EXPECT_FALSE(Changed(stamp));
}

TEST_F(FileStampTest, SeesEveryKindOfReplacement) {
  const auto replaced = [&](const auto& replace) {
    Write("a", "abc");
    const FileStamp stamp = StampFiles({Path("a")}).value();
    replace();
    return Changed(stamp);
  };
  EXPECT_TRUE(replaced([&] { Write("a", "longer"); }));
  EXPECT_TRUE(replaced([&] { std::ofstream(Path("a"), std::ios::app) << "more"; }));
  EXPECT_TRUE(replaced([&] {  // another file of the same size and time, put in its place
    Write("b", "xyz");
    fs::last_write_time(Path("b"), fs::last_write_time(Path("a")));
    fs::rename(Path("b"), Path("a"));
  }));
  EXPECT_TRUE(replaced([&] { fs::last_write_time(Path("a"), fs::last_write_time(Path("a")) + std::chrono::nanoseconds(1000)); }));
}

TEST_F(FileStampTest, AFolderIsWhatLiesInIt) {
  fs::create_directories(Path("scan/part"));
  Write("scan/1.tif", "a");
  Write("scan/part/2.tif", "b");
  fs::create_symlink(Path("nowhere"), Path("scan/link"));  // no reason to fail
  fs::create_directory_symlink(Path("scan"), Path("scan/loop"));
  const auto changed = [&](const auto& change) {
    const FileStamp stamp = StampFiles({Path("scan")}).value();
    EXPECT_FALSE(Changed(stamp));
    change();
    return Changed(stamp);
  };
  EXPECT_TRUE(changed([&] { Write("scan/3.tif", "c"); }));
  EXPECT_TRUE(changed([&] { Write("scan/part/2.tif", "longer"); }));
  EXPECT_TRUE(changed([&] { fs::rename(Path("scan/1.tif"), Path("scan/9.tif")); }));
  EXPECT_TRUE(changed([&] { fs::remove(Path("scan/3.tif")); }));
  EXPECT_FALSE(changed([&] {  // the folder's own times alone
    Write("scan/t", "");
    fs::remove(Path("scan/t"));
  }));
}

TEST_F(FileStampTest, WhatIsNotThereIsNamed) {
  Write("a", "abc");
  const Status missing = StampFiles({Path("a"), Path("b")}).status();
  EXPECT_EQ(missing.code(), StatusCode::kNotFound);
  EXPECT_EQ(missing.message(), Path("b") + ": No such file or directory");
  const FileStamp stamp = StampFiles({Path("a")}).value();
  fs::remove(Path("a"));
  EXPECT_EQ(HaveChanged(stamp).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace slabstream
