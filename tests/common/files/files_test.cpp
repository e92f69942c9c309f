#include "common/files/files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "tests/support/full_disk.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr std::size_t kMax = 1 << 20;

class FilesTest : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return directory_ / name; }
  std::size_t FileCount() const { return std::size_t(std::distance(std::filesystem::directory_iterator(directory_.path()), {})); }

  TemporaryDirectory directory_;
};

TEST_F(FilesTest, AFileAppearsWhenItIsFinished) {
  Result<OutputFile> file = OutputFile::Create(Path("a"));
  ASSERT_TRUE(file.ok());
  file->Append("hello world");
  file->WriteAt(0, std::as_bytes(std::span("J", 1)));
  ASSERT_EQ(file->Close(), Status::Ok());
  EXPECT_FALSE(std::filesystem::exists(Path("a")));
  ASSERT_EQ(file->Finish(), Status::Ok());
  EXPECT_EQ(*ReadTextFile(Path("a"), kMax), "Jello world");
  EXPECT_EQ(FileCount(), 1U);
}

TEST_F(FilesTest, AFileThatIsNotFinishedLeavesNothing) {
  { OutputFile::Create(Path("a"))->Append("x"); }
  EXPECT_EQ(FileCount(), 0U);
}

TEST_F(FilesTest, AFullDiskIsToldAndKeepsTheOlderFile) {
  ASSERT_EQ(WriteTextFile(Path("a"), "old"), Status::Ok());
  const Status status = OnFullDisk(1000, [&] { return WriteTextFile(Path("a"), std::string(1001, 'x')); });
  EXPECT_EQ(status, Status::Unavailable("cannot write '" + Path("a") + "': File too large"));
  EXPECT_EQ(*ReadTextFile(Path("a"), kMax), "old");
  EXPECT_EQ(FileCount(), 1U);
  EXPECT_EQ(OnFullDisk(1000, [&] { return WriteTextFile(Path("a"), std::string(1000, 'y')); }), Status::Ok());
}

TEST_F(FilesTest, ADeviceIsWrittenInItsPlace) {
  std::filesystem::create_symlink("/dev/full", Path("full"));
  const Status status = WriteTextFile(Path("full"), "x");
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr("No space left on device"));
  std::filesystem::create_symlink("/dev/null", Path("null"));
  EXPECT_EQ(WriteTextFile(Path("null"), "x"), Status::Ok());
  EXPECT_TRUE(std::filesystem::is_character_file(Path("null")));
}

TEST_F(FilesTest, ALinkGoesOnPointingAtTheFile) {
  ASSERT_EQ(WriteTextFile(Path("a"), "old"), Status::Ok());
  std::filesystem::create_symlink("a", Path("link"));
  ASSERT_EQ(WriteTextFile(Path("link"), "new"), Status::Ok());
  EXPECT_TRUE(std::filesystem::is_symlink(Path("link")));
  EXPECT_EQ(*ReadTextFile(Path("a"), kMax), "new");
}

// In a folder that others may write, such as /tmp, somebody may guess the name of the temporary file.
TEST_F(FilesTest, ALinkInPlaceOfTheTemporaryFileIsNotFollowed) {
  ASSERT_EQ(WriteTextFile(Path("victim"), "old"), Status::Ok());
  constexpr int kNames = 1000;
  for (int i = 0; i < kNames; ++i) std::filesystem::create_symlink("victim", fmt::format("{}.{}-{}.tmp", Path("a"), ::getpid(), i));
  ASSERT_EQ(WriteTextFile(Path("a"), "new"), Status::Ok());
  EXPECT_EQ(*ReadTextFile(Path("a"), kMax), "new");
  EXPECT_FALSE(std::filesystem::is_symlink(Path("a")));
  EXPECT_EQ(*ReadTextFile(Path("victim"), kMax), "old");
}

TEST_F(FilesTest, WhatCannotBeWrittenIsToldBeforehandWithTheReason) {
  EXPECT_EQ(CheckCanWrite("--output", Path("a.png")), Status::Ok());
  EXPECT_EQ(FileCount(), 0U);
  EXPECT_EQ(CheckCanWrite("--output", directory_.path()).code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(CheckCanWrite("--output", Path("no/a.png")).message(), HasSubstr("/no' does not exist"));
  // Nobody makes files there, root neither.
  EXPECT_EQ(CheckCanWrite("--output", "/proc/a.png"),
            Status::InvalidArgument("--output: cannot write '/proc/a.png': No such file or directory"));
}

}  // namespace
}  // namespace slabstream
