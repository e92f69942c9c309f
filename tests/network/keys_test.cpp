// A service on several hosts: a coordinator, workers and a client, each in a network namespace of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/end_to_end/picture_file.h"
#include "tests/end_to_end/program.h"
#include "tests/network/hosts.h"

namespace slabstream {
namespace {

constexpr char kSecretName[] = "a-name-that-nobody-else-has";
constexpr int kCoordinator = 0, kClient = 1, kFirstWorker = 2, kWorkers = 3;

class KeysOnHostsTest : public EndToEndTest {
 protected:
  void SetUp() override {
    Result<Hosts> hosts = Hosts::Make(kFirstWorker + kWorkers);
    if (!hosts.ok()) GTEST_SKIP() << hosts.status().message();
    hosts_.emplace(*std::move(hosts));
  }

  std::unique_ptr<RunningProgram> Start(int host, std::vector<std::string> command) const {
    return std::make_unique<RunningProgram>(hosts_->On(host, std::move(command)), directory_);
  }
  ProgramResult Run(int host, std::vector<std::string> command) const { return Start(host, std::move(command))->Wait(); }
  ProgramResult AsClient(std::vector<std::string> arguments) const { return Run(kClient, Command(std::move(arguments))); }

  void StartService() {
    const std::string ball = MakeSphere("ball.nrrd", 2, 48);
    coordinator_ = Start(kCoordinator, {SLABSTREAM_COORDINATOR_PROGRAM, "--listen", "tcp://" + hosts_->AddressOf(kCoordinator) + ":*",
                                        "--keys", Path("keys"), "--data", kSecretName + ("=" + ball)});
    ASSERT_TRUE(coordinator_->WaitForOutput("slabstream-coordinator ready"));
    for (int i = 0; i < kWorkers; ++i)
      workers_.push_back(Start(kFirstWorker + i, {SLABSTREAM_WORKER_PROGRAM, "--no-shared-memory", "--service", Path("keys/worker.json")}));
  }

  std::optional<Hosts> hosts_;
  std::unique_ptr<RunningProgram> coordinator_;
  std::vector<std::unique_ptr<RunningProgram>> workers_;
};

TEST_F(KeysOnHostsTest, ThePictureIsThatOfOneProcessAndNothingPassesInTheClear) {
  StartService();
  Hosts::Capture capture(*hosts_);
  const std::vector<std::string> render = {"render", kSecretName, "-o",        "service.exr",
                                           "--size", "96",        "--service", Path("keys/client.json")};
  ProgramResult rendered;
  do {  // the first request may come before all workers
    rendered = AsClient(render);
    ASSERT_EQ(rendered.exit_status, 0) << rendered.err;
  } while (AsClient({"status", "--service", Path("keys/client.json")}).out.find("workers      3") == std::string::npos);
  rendered = AsClient(render);
  ASSERT_EQ(rendered.exit_status, 0) << rendered.err;
  MustRun({"render", Path("ball.nrrd"), "--local=1", "-o", "local.exr", "--size", "96"});
  EXPECT_LE(LargestDifference(ReadPicture(Path("service.exr")), ReadPicture(Path("local.exr"))), 2e-5 + 1.0 / 1024);
  const std::string passed = capture.TakeAll();
  EXPECT_GT(passed.size(), 100000U) << "the voxels and the images";
  EXPECT_NE(passed.find("CURVE"), std::string::npos) << "nothing was captured";
  EXPECT_EQ(passed.find(kSecretName), std::string::npos) << "a request passed in the clear";
}

TEST_F(KeysOnHostsTest, KeysAreNeededAndRevokedOnesEnd) {
  StartService();
  const std::string endpoint = "tcp://" + hosts_->AddressOf(kCoordinator) + ":7420";
  const ProgramResult without = AsClient({"status", "--endpoint", endpoint});
  EXPECT_EQ(without.exit_status, 2);
  EXPECT_THAT(without.err, HasSubstr("without keys the service stays on this machine"));
  EXPECT_EQ(AsClient({"status", "--service", Path("keys/worker.json")}).exit_status, 2);
  const std::vector<std::string> status = {"status", "--service", Path("keys/client.json")};
  ASSERT_EQ(AsClient(status).exit_status, 0);
  const ProgramResult refused = AsClient({"down", "--service", Path("keys/client.json")});
  EXPECT_EQ(refused.exit_status, 2);
  EXPECT_THAT(refused.err, HasSubstr("needs the service file of role admin, not client"));

  const ProgramResult keys = AsClient({"keys", "list", "--service", Path("keys/admin.json")});
  ASSERT_EQ(keys.exit_status, 0) << keys.err;
  const std::string key = keys.out.substr(keys.out.find("client") - 10, 8);
  ASSERT_EQ(AsClient({"keys", "revoke", key, "--service", Path("keys/admin.json")}).exit_status, 0);
  const ProgramResult revoked = AsClient(status);
  EXPECT_EQ(revoked.exit_status, 1);
  EXPECT_THAT(revoked.err, HasSubstr("refuses the key"));
  EXPECT_EQ(AsClient({"down", "--service", Path("keys/admin.json")}).exit_status, 0);
  EXPECT_EQ(coordinator_->Wait().exit_status, 0);
  for (const auto& worker : workers_) EXPECT_EQ(worker->Wait().exit_status, 0);
}

// The system would look up the name for minutes.
TEST_F(KeysOnHostsTest, ANameServerThatDoesNotAnswerHoldsUpNobodysEnd) {
  StartService();
  ASSERT_TRUE(hosts_->DropTo(kFirstWorker).ok());
  const std::string command =
      "umask 077 && sed 's#//" + hosts_->AddressOf(kCoordinator) +
      ":#//coordinator.example:#' keys/client.json > lost.json && printf 'nameserver " + hosts_->AddressOf(kFirstWorker) +
      "\\noptions timeout:30 attempts:5\\n' > resolv.conf && mount --bind resolv.conf /etc/resolv.conf && exec timeout 60 '" +
      Command({"status"}).front() + "' status --service lost.json";
  const ProgramResult lost = Run(kClient, {"unshare", "--mount", "sh", "-c", command});
  EXPECT_EQ(lost.exit_status, 1) << lost.err;
  EXPECT_THAT(lost.err, HasSubstr("no service answers at tcp://coordinator.example"));
}

}  // namespace
}  // namespace slabstream
