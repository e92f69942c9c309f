// Files that clients send, on the coordinator's disk.
#include "data/catalogue/client_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <utime.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class ClientFileTest : public testing::Test {
 protected:
  ClientFileTest() { ::setenv("TMPDIR", folder_.path().c_str(), 1); }
  ~ClientFileTest() override { ::unsetenv("TMPDIR"); }

  static std::shared_ptr<const ClientFile> Write(const std::string& name = "a.nii") {
    const std::string text = "voxels";
    Result<std::shared_ptr<const ClientFile>> file = ClientFile::Write(name, std::as_bytes(std::span(text)));
    EXPECT_TRUE(file.ok()) << file.status().message();
    return *file;
  }
  std::size_t count() const { return std::size_t(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator())); }

  TemporaryDirectory folder_;
};

TEST_F(ClientFileTest, ItIsPrivateAndGoesWithItsObject) {
  auto file = Write();
  EXPECT_EQ(ReadFile(file->path()), "voxels");
  const auto others = fs::perms::group_all | fs::perms::others_all;
  EXPECT_EQ(fs::status(file->path()).permissions() & others, fs::perms::none);
  EXPECT_EQ(fs::status(fs::path(file->path()).parent_path()).permissions() & others, fs::perms::none);
  EXPECT_EQ(count(), 1U);
  file.reset();
  EXPECT_EQ(count(), 0U);
}

TEST_F(ClientFileTest, ItHoldsAllOfItsData) {
  const auto file = Write("a.nhdr");
  const std::string folder = fs::path(file->path()).parent_path().string();
  EXPECT_TRUE(file->CheckAlone({file->path(), folder}).ok());
  for (const std::string& other : {std::string("/etc/passwd"), folder + "/../x.raw", folder + "x/a", std::string("x.raw")}) {
    const Status refused = file->CheckAlone({file->path(), other});
    EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument) << other;
    EXPECT_THAT(refused.message(), HasSubstr("a.nhdr: its data is in another file"));
  }
}

TEST_F(ClientFileTest, MessagesForClientsNameNoFolder) {
  const auto file = Write();
  const Status told = file->ForClient(Status::DataLoss(file->path() + ": truncated; see " + file->path()));
  EXPECT_EQ(told, Status::DataLoss("a.nii: truncated; see a.nii"));
}

TEST_F(ClientFileTest, WhatKilledProcessesHaveLeftIsRemoved) {
  const fs::path left = folder_ / "slabstream-file-abcdef", young = folder_ / "slabstream-file-ghijkl", other = folder_ / "other";
  for (const fs::path& each : {left, young, other}) {
    fs::create_directory(each);
    std::ofstream(each / "a.nii") << "voxels";
  }
  const utimbuf past{1, 1};
  ::utime(left.c_str(), &past);
  ::utime(other.c_str(), &past);
  const auto used = Write();
  ::utime(fs::path(used->path()).parent_path().c_str(), &past);
  const auto next = Write();
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(young)) << "it may not be locked yet";
  EXPECT_TRUE(fs::exists(other));
  EXPECT_TRUE(fs::exists(used->path())) << "it is in use";
}

}  // namespace
}  // namespace slabstream
