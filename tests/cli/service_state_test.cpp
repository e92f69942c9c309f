#include "client/cli/service_state.h"
#include "tests/support/temporary_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace slabstream {
namespace {

class ServiceStateTest : public testing::Test {
 protected:
  ServiceStateTest() {
    ::setenv("XDG_RUNTIME_DIR", directory_.c_str(), 1);
    ::unsetenv("SLABSTREAM_ENDPOINT");
  }
  ~ServiceStateTest() override {
    ::unsetenv("XDG_RUNTIME_DIR");
    ::unsetenv("SLABSTREAM_ENDPOINT");
  }

  TemporaryDirectory temporary_;
  const std::string directory_ = temporary_.path();
};

TEST_F(ServiceStateTest, TheDirectoryIsOursAlone) {
  const Result<std::string> directory = StateDirectory();
  ASSERT_TRUE(directory.ok()) << directory.status().message();
  struct stat info {};
  ASSERT_EQ(::stat(directory->c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0700U);

  ASSERT_EQ(::chmod(directory->c_str(), 0755), 0);
  EXPECT_EQ(StateDirectory().status().code(), StatusCode::kUnavailable);
  EXPECT_THAT(StateDirectory().status().message(), testing::HasSubstr("XDG_RUNTIME_DIR"));
}

TEST_F(ServiceStateTest, ARuntimeDirectoryThatIsMissingOrForeignIsPassedOver) {
  const std::string fallback = "/tmp/slabstream-" + std::to_string(::getuid());
  const bool was_there = std::filesystem::exists(fallback);
  std::string foreign = "/";
  if (::getuid() == 0) {
    foreign = directory_ + "/foreign";
    std::filesystem::create_directory(foreign);
    ASSERT_EQ(::chown(foreign.c_str(), 65534, 65534), 0);
  }
  for (const std::string& path : {std::string("/nowhere/at/all"), foreign}) {
    ::setenv("XDG_RUNTIME_DIR", path.c_str(), 1);
    const Result<std::string> directory = StateDirectory();
    EXPECT_EQ(directory.ok() ? *directory : directory.status().message(), fallback) << path;
  }
  std::error_code in_use;  // by a service of this user
  if (!was_there) std::filesystem::remove(fallback, in_use);
}

TEST_F(ServiceStateTest, ALinkInItsPlaceIsRefused) {
  std::filesystem::create_directory(directory_ + "/elsewhere");
  ::chmod((directory_ + "/elsewhere").c_str(), 0700);
  std::filesystem::create_symlink(directory_ + "/elsewhere", directory_ + "/slabstream");
  EXPECT_EQ(StateDirectory().status().code(), StatusCode::kUnavailable);
}

TEST_F(ServiceStateTest, AServiceWhoseCoordinatorIsGoneIsForgotten) {
  ServiceState state{"tcp://127.0.0.1:5000", 100, ::getpid(), {1, 2}, ""};  // this process runs, but is no coordinator
  ASSERT_EQ(SaveState(state), Status::Ok());
  EXPECT_EQ(FindState(""), std::nullopt);
  EXPECT_TRUE(std::filesystem::is_empty(*StateDirectory()));
  EXPECT_EQ(*DefaultEndpoint(), kDefaultEndpoint);
}

TEST_F(ServiceStateTest, DamagedFilesAreNoServices) {
  for (const char* text : {"", "{", "[]", "{\"endpoint\": 3}", "null"}) {
    std::ofstream(*StateDirectory() + "/x.json") << text;
    EXPECT_EQ(FindState(""), std::nullopt) << text;
  }
}

TEST_F(ServiceStateTest, TheEnvironmentNamesTheEndpoint) {
  ::setenv("SLABSTREAM_ENDPOINT", "tcp://127.0.0.1:5001", 1);
  EXPECT_EQ(*DefaultEndpoint(), "tcp://127.0.0.1:5001");
  ::setenv("SLABSTREAM_ENDPOINT", "nonsense", 1);
  EXPECT_EQ(DefaultEndpoint().status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(DefaultEndpoint().status().message(), testing::HasSubstr("$SLABSTREAM_ENDPOINT"));
}

TEST_F(ServiceStateTest, RunningMeansAliveAndOfThatName) {
  std::ifstream comm("/proc/self/comm");
  std::string name;
  std::getline(comm, name);
  EXPECT_TRUE(IsRunning(::getpid(), name));
  EXPECT_FALSE(IsRunning(::getpid(), kWorkerProgram));
  EXPECT_FALSE(IsRunning(0, name));
  EXPECT_FALSE(IsRunning(-1, name));
}

}  // namespace
}  // namespace slabstream
