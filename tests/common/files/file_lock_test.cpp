#include "common/files/file_lock.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <optional>
#include <thread>

#include "common/files/files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;
constexpr auto kAnyTime = std::chrono::hours(1);

class FileLockTest : public testing::Test {
 protected:
  const TemporaryDirectory directory_;
  const std::string path_ = directory_ / "v.lock";
};

TEST_F(FileLockTest, IsSharedOrHeldAlone) {
  {
    const Result<FileDescriptor> one = LockFile(path_, LockMode::kShared), other = TryLockFile(path_, LockMode::kShared);
    ASSERT_TRUE(one.ok() && other.ok());
    EXPECT_EQ(TryLockFile(path_, LockMode::kAlone).status().code(), StatusCode::kUnavailable);
  }
  const Result<FileDescriptor> alone = TryLockFile(path_, LockMode::kAlone);
  ASSERT_TRUE(alone.ok());
  EXPECT_EQ(TryLockFile(path_, LockMode::kShared).status().code(), StatusCode::kUnavailable);
  struct stat found {};
  ASSERT_EQ(::stat(path_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & ALLPERMS, 0600U);
}

TEST_F(FileLockTest, NobodyWaitsForAHolderThatDoesNothing) {
  const Result<FileDescriptor> held = LockFile(path_, LockMode::kAlone);
  const Status left = LockFile(path_, LockMode::kShared, std::chrono::milliseconds(50)).status();
  EXPECT_EQ(left.code(), StatusCode::kUnavailable);
  EXPECT_THAT(left.message(), HasSubstr("another process holds the lock '" + path_ + "'"));
}

TEST_F(FileLockTest, WaitsForAHolderThatWorksAndForTheNextFile) {
  std::optional<Result<FileDescriptor>> held = LockFile(path_, LockMode::kAlone);
  constexpr auto kPatience = std::chrono::seconds(2);
  std::atomic<bool> taken = false;
  std::jthread waits([&] {
    const Result<FileDescriptor> lock = LockFile(path_, LockMode::kAlone, kPatience);
    EXPECT_TRUE(lock.ok()) << lock.status().message();
    taken = true;
  });
  for (const Time until = MonotonicNow() + kPatience * 5 / 4; MonotonicNow() < until; std::this_thread::yield()) TouchLock(**held);
  EXPECT_FALSE(taken);
  std::filesystem::remove(path_);  // as whoever removes what it locks
  held.reset();
  waits.join();
  EXPECT_TRUE(std::filesystem::exists(path_)) << "it was made anew";
}

TEST_F(FileLockTest, StopsWaitingWhenItIsTold) {
  const Result<FileDescriptor> held = LockFile(path_, LockMode::kAlone);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(LockFile(path_, LockMode::kAlone, kAnyTime, stop.get_token()).status().code(), StatusCode::kCancelled);
}

TEST_F(FileLockTest, AFileThatCannotBeMadeIsNamed) {
  EXPECT_THAT(LockFile(directory_ / "none/v.lock", LockMode::kAlone).status().message(),
              HasSubstr("cannot lock '" + (directory_ / "none/v.lock'")));
  ASSERT_TRUE(WriteTextFile(directory_ / "target", "").ok());
  std::filesystem::create_symlink(directory_ / "target", path_);
  EXPECT_EQ(LockFile(path_, LockMode::kAlone).status().code(), StatusCode::kUnavailable) << "a link is none of ours";
}

}  // namespace
}  // namespace slabstream
