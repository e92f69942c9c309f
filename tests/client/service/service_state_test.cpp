#include "client/service/service_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/service/service_file.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

class ServiceStateTest : public testing::Test {
 protected:
  ServiceStateTest() {
    ::setenv("XDG_RUNTIME_DIR", directory_.c_str(), 1);
    ::unsetenv("SLABSTREAM_ENDPOINT");
    ::unsetenv("SLABSTREAM_SERVICE");
  }
  ~ServiceStateTest() override {
    ::unsetenv("XDG_RUNTIME_DIR");
    ::unsetenv("SLABSTREAM_ENDPOINT");
    ::unsetenv("SLABSTREAM_SERVICE");
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

TEST_F(ServiceStateTest, OfTwoWithinASecondTheLaterOneIsMeantAndNeverAnUnlistedOne) {
  const ServiceState first{"tcp://127.0.0.1:5000", 100.25, ::getpid(), {}, "", ""},
      second{"tcp://127.0.0.1:4000", 100.5, ::getpid(), {}, "", ""};
  ServiceState unlisted{"tcp://127.0.0.1:6000", 200, ::getpid(), {}, "", ""};
  unlisted.unlisted = true;
  for (const ServiceState& state : {second, unlisted, first}) ASSERT_EQ(SaveState(state), Status::Ok());
  EXPECT_EQ(FindRemains(""), second);
  EXPECT_EQ(FindRemains(unlisted.endpoint), unlisted);
}

TEST_F(ServiceStateTest, AServiceWhoseCoordinatorIsGoneLeavesRemains) {
  const ServiceState state{"tcp://127.0.0.1:5000", 100, ::getpid(), {1, 2}, "", ""};  // this process runs, but is no coordinator
  ASSERT_EQ(SaveState(state), Status::Ok());
  EXPECT_EQ(FindState(""), std::nullopt);
  EXPECT_EQ(ResolveService({}).status().code(), StatusCode::kUnavailable) << "whoever listens at the usual port is not meant";
  for (const char* endpoint : {"", "tcp://127.0.0.1:5000"}) EXPECT_EQ(FindRemains(endpoint), state);
  EXPECT_EQ(FindRemains("tcp://127.0.0.1:5001"), std::nullopt);
  ForgetState(state);
  EXPECT_EQ(FindRemains(""), std::nullopt);
}

TEST_F(ServiceStateTest, WhoEndsLateForgetsNoOtherServiceAtItsEndpoint) {
  const ServiceState ended{"tcp://127.0.0.1:5000", 100, ::getpid() + 1, {1, 2}, "", ""};
  const ServiceState next{"tcp://127.0.0.1:5000", 101, ::getpid(), {3}, "", ""};
  ASSERT_EQ(SaveState(ended), Status::Ok());
  ASSERT_EQ(SaveState(next), Status::Ok());
  ForgetState(ended);
  EXPECT_EQ(FindRemains(""), next);
}

TEST_F(ServiceStateTest, DamagedFilesAreNoServices) {
  for (const char* text : {"", "{", "[]", "{\"endpoint\": 3}", "null"}) {
    std::ofstream(*StateDirectory() + "/x.json") << text;
    EXPECT_EQ(FindState(""), std::nullopt) << text;
  }
}

TEST_F(ServiceStateTest, TheEnvironmentNamesTheEndpoint) {
  ::setenv("SLABSTREAM_ENDPOINT", "tcp://127.0.0.1:5001", 1);
  EXPECT_EQ(ResolveService({})->endpoint, "tcp://127.0.0.1:5001");
  ::setenv("SLABSTREAM_ENDPOINT", "nonsense", 1);
  EXPECT_EQ(ResolveService({}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(ResolveService({}).status().message(), testing::HasSubstr("$SLABSTREAM_ENDPOINT"));
}

TEST_F(ServiceStateTest, AServiceFileComesBeforeTheEndpoint) {
  const std::string path = directory_ + "/client.json";
  const ServiceFile file = {Role::kClient, "tcp://10.0.0.1:7420", MakeKeyPair().public_key, MakeKeyPair(), 1, 1, ""};
  ASSERT_TRUE(WriteServiceFile(path, file).ok());
  ::setenv("SLABSTREAM_ENDPOINT", "tcp://127.0.0.1:5001", 1);
  EXPECT_EQ(ResolveService({.endpoint = "", .file = path})->endpoint, file.endpoint);
  EXPECT_EQ(ResolveService({.endpoint = "", .file = path})->keys->own, file.own);
  ::setenv("SLABSTREAM_SERVICE", path.c_str(), 1);
  EXPECT_EQ(ResolveService({})->endpoint, file.endpoint);
  EXPECT_EQ(ResolveService({.endpoint = "tcp://127.0.0.1:5002", .file = ""})->endpoint, "tcp://127.0.0.1:5002");
  const Result<ServiceAddress> tunnel = ResolveService({.endpoint = "tcp://127.0.0.1:5002", .file = path});
  EXPECT_EQ(tunnel->endpoint, "tcp://127.0.0.1:5002") << "the near end of a tunnel";
  EXPECT_EQ(tunnel->keys->own, file.own);
  ServiceFile worker = file;
  worker.role = Role::kWorker;
  ASSERT_TRUE(WriteServiceFile(path, worker).ok());
  EXPECT_THAT(ResolveService({}).status().message(), testing::HasSubstr("is of role worker"));
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

TEST_F(ServiceStateTest, AnOwnerFindsTheServiceThatItNames) {
  const auto found = [](const std::string& text) {
    const ServiceChoice choice = ResolveOwnerService(text).value();
    return choice.endpoint + "|" + choice.file;
  };
  ::unsetenv("SLABSTREAM_OWNER_SERVICE");
  EXPECT_EQ(found(""), "tcp://127.0.0.1:7421|");
  std::array<char, 16> own_name = {};
  ASSERT_EQ(::prctl(PR_GET_NAME, own_name.data()), 0);
  ASSERT_EQ(::prctl(PR_SET_NAME, kCoordinatorProgram), 0);  // this process is a coordinator that runs
  ServiceState state{.endpoint = "tcp://127.0.0.1:40000", .coordinator = ::getpid(), .worker_endpoint = "tcp://127.0.0.1:40007"};
  ASSERT_TRUE(SaveState(state).ok());
  EXPECT_EQ(found(""), "tcp://127.0.0.1:40007|");
  state.keys_folder = "/keys";
  ASSERT_TRUE(SaveState(state).ok());
  EXPECT_EQ(found(""), "|/keys/owner.json");
  ::setenv("SLABSTREAM_OWNER_SERVICE", "/other/owner.json", 1);
  EXPECT_EQ(found(""), "|/other/owner.json");
  EXPECT_EQ(found("ipc:///there"), "ipc:///there|");
  EXPECT_THAT(ResolveOwnerService("tcp://here").status().message(), testing::HasSubstr("tcp://here"));
  ::unsetenv("SLABSTREAM_OWNER_SERVICE");
  ASSERT_EQ(::prctl(PR_SET_NAME, own_name.data()), 0);
}

}  // namespace
}  // namespace slabstream
