// What is kept of files that others may not read: others may not read it either.
#include "common/files/cache_folder.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/files/files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

unsigned RightsOf(const std::string& path) {
  struct stat found {};
  EXPECT_EQ(::stat(path.c_str(), &found), 0) << path;
  return found.st_mode & ALLPERMS;
}

class CacheFolderTest : public testing::Test {
 protected:
  CacheFolderTest() { ::setenv("XDG_CACHE_HOME", directory_.path().c_str(), 1); }
  ~CacheFolderTest() override { ::unsetenv("XDG_CACHE_HOME"); }

  const TemporaryDirectory directory_;
  const std::string cache_ = directory_ / "slabstream", index_ = cache_ + "/index";
};

TEST_F(CacheFolderTest, IsMadeForItsUserAlone) {
  EXPECT_EQ(CacheFolder().value(), cache_);
  ASSERT_TRUE(MakeOwnFolder(index_).ok());
  EXPECT_EQ(RightsOf(cache_), 0700U);
  EXPECT_EQ(RightsOf(index_), 0700U);
  EXPECT_TRUE(MakeOwnFolder(index_).ok());
}

TEST_F(CacheFolderTest, OthersLoseTheirRightsToOneThatIsThere) {
  const std::string outside = directory_ / "outside", file = index_ + "/a", link = index_ + "/link";
  ASSERT_EQ(::mkdir(cache_.c_str(), 0700), 0);
  ASSERT_EQ(::mkdir(index_.c_str(), 0700), 0);
  for (const std::string& each : {outside, file}) {
    ASSERT_TRUE(WriteTextFile(each, "voxels").ok());
    ASSERT_EQ(::chmod(each.c_str(), 0644), 0);
  }
  ASSERT_EQ(::symlink(outside.c_str(), link.c_str()), 0);
  for (const std::string& each : {cache_, index_}) ASSERT_EQ(::chmod(each.c_str(), 0775), 0);
  ASSERT_TRUE(MakeOwnFolder(index_).ok());
  EXPECT_EQ(RightsOf(cache_), 0700U);
  EXPECT_EQ(RightsOf(index_), 0700U);
  EXPECT_EQ(RightsOf(file), 0600U);
  EXPECT_EQ(RightsOf(outside), 0644U) << "a link is not followed";
}

TEST_F(CacheFolderTest, OneOfOthersIsRefusedInALineThatNamesIt) {
  ASSERT_TRUE(MakeOwnFolder(index_).ok());
  ASSERT_EQ(::chmod(cache_.c_str(), 0777), 0);
  const Status open = MakeOwnFolder(index_);
  EXPECT_EQ(open.code(), StatusCode::kUnavailable);
  EXPECT_THAT(open.message(), HasSubstr("the folder '" + cache_ + "' can be written by all users"));
  ASSERT_EQ(::chmod(cache_.c_str(), 0700), 0);
  ASSERT_TRUE(WriteTextFile(index_ + "/file", "").ok());
  EXPECT_THAT(MakeOwnFolder(index_ + "/file/folder").message(),
              HasSubstr("cannot make the folder '" + index_ + "/file/folder': Not a dir"));
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives a folder to another user";
  ASSERT_EQ(::chown(index_.c_str(), 65534, 65534), 0);
  EXPECT_THAT(MakeOwnFolder(index_).message(), HasSubstr("the folder '" + index_ + "' belongs to another user"));
}

}  // namespace
}  // namespace slabstream
