// Networks that fail in the middle of a frame. Nothing is timed, but every frame must end before its deadline, which is shorter than a
// frame waits for messages that do not come.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>

#include "tests/network/cluster.h"
#include "tests/network/proxy.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

class LinksTest : public ClusterTest {
 protected:
  void SetUp() override {
    MakeHosts();
    if (IsSkipped()) return;
    StartCoordinator();
    StartWorkers();
    BeginFrames();
  }
  static std::vector<int> WorkerHostsBut(int host) {
    std::vector<int> hosts;
    for (int worker = kFirstWorker; worker < kFirstWorker + kWorkers; ++worker) {
      if (worker != host) hosts.push_back(worker);
    }
    return hosts;
  }
};

// What this kernel cannot do skips the test.
#define NEED(status) \
  if (const Status needed = (status); !needed.ok()) GTEST_SKIP() << needed.message()

TEST_F(LinksTest, LinksOfAWorkerAndOfAClientGoDownAndUp) {
  RenderThrough([&] {
    for (const int host : {kFirstWorker, int(kClient)}) ASSERT_TRUE(hosts_->SetLink(host, false).ok());
    WaitForSilence();
    for (const int host : {kFirstWorker, int(kClient)}) ASSERT_TRUE(hosts_->SetLink(host, true).ok());
  });
  ExpectHealthy(kWorkers);
}

TEST_F(LinksTest, WorkersThatAreCutOffInAnyWayAreReplacedAndComeBack) {
  const int cut = kFirstWorker, not_heard = kFirstWorker + 1, not_hearing = kFirstWorker + 2;
  NEED(hosts_->DropFrom(not_heard));
  NEED(hosts_->StopDropping(not_heard));
  const std::uint32_t attempts = RenderThrough([&] {
    ASSERT_TRUE(hosts_->SetLink(cut, false).ok());
    ASSERT_TRUE(hosts_->DropFrom(not_heard).ok());
    ASSERT_TRUE(hosts_->DropTo(not_hearing).ok());
  });
  EXPECT_GT(attempts, 1U);
  WaitForWorkers(kWorkers - 3);
  ASSERT_TRUE(hosts_->SetLink(cut, true).ok());
  for (const int host : {not_heard, not_hearing}) ASSERT_TRUE(hosts_->StopDropping(host).ok());
  ExpectHealthy(kWorkers);
}

// The coordinator hears it, so it is not lost.
TEST_F(LinksTest, AWorkerWhoseImagesReachNobodyHasNoPartInFrames) {
  const std::vector<int> others = WorkerHostsBut(kFirstWorker);
  NEED(hosts_->DropBetween(kFirstWorker, others.front()));
  NEED(hosts_->StopDropping(others.front()));
  const std::uint32_t attempts = RenderThrough([&] {
    for (const int other : others) ASSERT_TRUE(hosts_->DropBetween(kFirstWorker, other).ok());
  });
  EXPECT_GT(attempts, 1U);
  WaitForWorkers(kWorkers);
  for (const int other : others) ASSERT_TRUE(hosts_->StopDropping(other).ok());
  ExpectHealthy(kWorkers);
}

// Links are so slow, and resets so many, that one of them meets images on their way. They are fewer than the failures in a row that end a
// frame.
TEST_F(LinksTest, ConnectionsBetweenWorkersAreReset) {
  for (int worker = 0; worker < kWorkers; ++worker) NEED(hosts_->LimitRate(kFirstWorker + worker, 20));
  const std::uint32_t attempts = RenderThrough([&] {
    constexpr int kResets = 4;
    for (int round = 0; round < kResets; ++round) {
      for (int worker = 0; worker < kWorkers; ++worker)
        ASSERT_TRUE(hosts_->ResetConnections(kFirstWorker + worker, WorkerHostsBut(kFirstWorker + worker)).ok());
    }
  });
  EXPECT_GT(attempts, 1U);
  ExpectHealthy(kWorkers);
}

TEST_F(LinksTest, AWorkerAndAClientBehindSlowLinks) {
  NEED(hosts_->LimitRate(kFirstWorker, 10));
  NEED(hosts_->LimitRate(kClient, 20));
  RenderThrough([] {});
  ExpectHealthy(kWorkers);
}

TEST_F(LinksTest, HostsVanish) {
  RenderThrough([&] {
    for (const int worker : {0, 1}) ASSERT_TRUE(hosts_->Unplug(kFirstWorker + worker).ok());
    workers_[1]->Signal(SIGKILL);
  });
  ExpectHealthy(kWorkers - 2);
}

TEST_F(LinksTest, AWorkersAndAClientsAddressChange) {
  RenderThrough([&] {
    ASSERT_TRUE(hosts_->ChangeAddress(kFirstWorker).ok());
    ASSERT_TRUE(hosts_->ChangeAddress(kClient).ok());
  });
  ExpectHealthy(kWorkers);
}

// Half of the workers reach the coordinator through a proxy.
class ProxyTest : public ClusterTest {
 protected:
  void SetUp() override {
    MakeHosts();
    if (IsSkipped()) return;
    StartCoordinator();
    Result<ServiceFile> file = ReadServiceFile(KeyFile("worker.json"));
    ASSERT_TRUE(file.ok()) << file.status().message();
    proxy_.emplace(*hosts_, kCoordinator, file->endpoint);
    file->endpoint = proxy_->endpoint();
    ASSERT_TRUE(WriteServiceFile(KeyFile("behind_proxy.json"), *file).ok());
    for (int i = 0; i < kWorkers; ++i) StartWorker(kFirstWorker + i, i % 2 == 0 ? "worker.json" : "behind_proxy.json");
    BeginFrames();
    ASSERT_EQ(proxy_->connections(), std::size_t(kWorkers) / 2);
  }
  std::optional<Proxy> proxy_;
};

TEST_F(ProxyTest, DelaysAndResets) {
  proxy_->SetDelay(milliseconds(50));
  RenderThrough([&] { proxy_->ResetAll(); });
  ExpectHealthy(kWorkers);
  EXPECT_GT(proxy_->connections(), std::size_t(kWorkers) / 2);
}

TEST_F(ProxyTest, StallsUntilWorkersAreLost) {
  RenderThrough([&] { proxy_->SetStalled(true); });
  WaitForWorkers(kWorkers / 2);
  proxy_->SetStalled(false);
  ExpectHealthy(kWorkers);
}

TEST_F(ClusterTest, Ipv6) {
  MakeHosts(Hosts::Family::kIpv6);
  if (IsSkipped()) return;
  StartCoordinator();
  const Result<ServiceFile> file = ReadServiceFile(KeyFile("worker.json"));
  ASSERT_TRUE(file.ok()) << file.status().message();
  EXPECT_TRUE(file->endpoint.starts_with("tcp://[fd00:77::1]:")) << file->endpoint;
  StartWorkers();
  BeginFrames();
  RenderThrough([&] { ASSERT_TRUE(hosts_->ChangeAddress(kFirstWorker).ok()); });
  ExpectHealthy(kWorkers);
}

}  // namespace
}  // namespace slabstream
