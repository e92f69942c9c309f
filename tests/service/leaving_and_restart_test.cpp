// Real processes: workers that leave with notice, and coordinators that are killed and started again at the same endpoint.
#include <algorithm>
#include <set>

#include "tests/service/multi_process_fixture.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

class LeavingAndRestartTest : public MultiProcessTest {
 protected:
  // Boxes that the frame consists of.
  static std::size_t BoxesOf(const Picture& picture) {
    std::set<std::uint32_t> boxes;
    for (const RankReport& report : picture.statistics.reports) boxes.insert(report.box);
    return boxes.size();
  }
  // What a worker said at its end.
  std::size_t RenderedBy(std::size_t worker) const {
    const std::string log = WorkerLog(worker), words = "ends after rendering ";
    const std::size_t at = log.find(words);
    EXPECT_NE(at, std::string::npos) << "worker " << worker << " says: " << log;
    return at == std::string::npos ? 0 : std::stoul(log.substr(at + words.size()));
  }
  static std::uint64_t FetchedFor(const Picture& picture) {
    std::uint64_t bytes = 0;
    for (const RankReport& report : picture.statistics.reports) bytes += report.voxel_bytes;
    return bytes;
  }
  static std::uint64_t FetchedBytes(const StatusReply& status) {
    std::uint64_t bytes = 0;
    for (const WorkerStatus& worker : status.workers) bytes += worker.fetched_bytes;
    return bytes;
  }
  void RestartCoordinator() {
    coordinator_->Kill(SIGKILL);
    coordinator_->Wait();
    StartCoordinator(client_endpoint_, worker_endpoint_);
  }
  // Until a frame of this client runs.
  static void AwaitRunning(Client& client) {
    while (const std::optional<ClientEvent> event = client.Next(seconds(60))) {
      const auto* progress = std::get_if<FrameProgress>(&event->what);
      if (progress != nullptr && progress->phase == FramePhase::kRunning) return;
    }
    FAIL() << "no frame runs";
  }
};

TEST_F(LeavingAndRestartTest, HalfOfTheWorkersLeaveAndNothingIsRenderedTwice) {
  StartCoordinator();
  for (int i = 0; i < 4; ++i) StartLoggingWorker();
  Client client = Connect();
  AwaitWorkers(client, 4);
  FrameRequest request = TestRequest(Splatting(), 33, 8);
  request.size = {512, 512};
  request.termination = 0;
  const LocalImage expected = RenderDirectly(request, *volume_);
  std::set<RequestId> open;
  for (int i = 0; i < 6; ++i) open.insert(client.Submit(request, seconds(100)));
  std::size_t boxes = 0, handed_over = 0;
  bool told = false;
  while (!open.empty()) {
    const std::optional<ClientEvent> event = client.Next(seconds(60));
    ASSERT_TRUE(event.has_value());
    ASSERT_FALSE(std::holds_alternative<Status>(event->what)) << std::get<Status>(event->what).message();
    const auto* progress = std::get_if<FrameProgress>(&event->what);
    if (progress != nullptr && progress->groups_done > 0 && !told) {
      for (const std::size_t worker : {1, 2}) workers_[worker].Kill(SIGTERM);
      told = true;
    }
    const auto* picture = std::get_if<Picture>(&event->what);
    if (picture == nullptr) continue;
    EXPECT_LE(LargestDifference(picture->image, expected, request.size), AllowedDifference(request));
    boxes += BoxesOf(*picture);
    if (picture->statistics.attempts > 1) ++handed_over;
    open.erase(event->request);
  }
  EXPECT_TRUE(told);
  for (const std::size_t worker : {1, 2}) EXPECT_EQ(workers_[worker].Wait(), 0);
  EXPECT_EQ(client.QueryStatus().value().workers_lost, 0U);
  for (const std::size_t worker : {0, 3}) {
    workers_[worker].Kill(SIGTERM);
    EXPECT_EQ(workers_[worker].Wait(), 0);
  }
  std::size_t rendered = 0;
  for (std::size_t worker = 0; worker < 4; ++worker) rendered += RenderedBy(worker);
  EXPECT_EQ(rendered, boxes) << "boxes rendered by the workers, and boxes of the pictures";
  std::cout << boxes << " boxes, " << handed_over << " frames handed over\n";
}

// Another worker that is stopped keeps the frame from ending.
TEST_F(LeavingAndRestartTest, ASecondSignalOrTheEndOfItsTimeEndsALeavingWorker) {
  StartCoordinator();
  StartWorker({"--drain", "1h"});
  StartWorker();
  StartWorker({"--drain", "300ms"});
  Client client = Connect();
  AwaitWorkers(client, 3);
  workers_[1].Stop();
  client.Submit(TestRequest(Splatting(), 33, 2), seconds(100));
  AwaitRunning(client);
  workers_[2].Kill(SIGTERM);
  EXPECT_EQ(workers_[2].Wait(), 0) << "300 ms were over";
  workers_[0].Kill(SIGINT);
  const auto is_leaving = [](const WorkerStatus& worker) { return worker.leaving; };
  AwaitStatus(client, [&](const StatusReply& status) { return std::ranges::any_of(status.workers, is_leaving); });
  workers_[0].Kill(SIGTERM);
  EXPECT_EQ(workers_[0].Wait(), 0);
}

TEST_F(LeavingAndRestartTest, ALeavingWorkerWithoutACoordinatorEnds) {
  StartCoordinator();
  StartWorker({"--drain", "1h"});
  StartWorker();
  Client client = Connect({.silence = seconds(60)});
  AwaitWorkers(client, 2);
  workers_[1].Stop();
  client.Submit(TestRequest(Splatting(), 33, 2), seconds(100));
  AwaitRunning(client);
  workers_[0].Kill(SIGTERM);
  coordinator_->Kill(SIGKILL);
  coordinator_->Wait();
  EXPECT_EQ(workers_[0].Wait(), 0) << "the coordinator was silent for too long";
}

// In the middle of the frame: one worker is stopped, so that it cannot end before the coordinator does. Twice.
TEST_F(LeavingAndRestartTest, AFrameOutlivesItsCoordinatorAndNoVoxelsTravelAgain) {
  StartCoordinator();
  for (int i = 0; i < 3; ++i) StartWorker();
  Client client = Connect({.silence = seconds(60)});
  AwaitWorkers(client, 3);
  FrameRequest request = TestRequest(ZBuffer(), 120, 3);
  request.policy.decomposition = "slab";
  request.policy.axis = AxisChoice::kZ;
  const Result<Picture> undisturbed = client.Render(request, seconds(60));
  ASSERT_TRUE(undisturbed.ok()) << undisturbed.status().message();
  const std::uint64_t fetched = FetchedFor(*undisturbed);
  ASSERT_GT(fetched, 0U);

  workers_[1].Stop();
  const RequestId id = client.Submit(request, seconds(100));
  AwaitRunning(client);
  coordinator_->Kill(SIGKILL);
  workers_[1].Kill(SIGCONT);
  RestartCoordinator();
  RestartCoordinator();
  const Result<Picture> picture = Await(client, id, [] {});
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_EQ(LargestDifference(picture->image, undisturbed->image, request.size), 0);
  const std::optional<ClientEvent> more = client.Next(std::chrono::milliseconds(100));
  EXPECT_FALSE(more.has_value()) << "it is answered once";
  AwaitWorkers(client, 3);
  EXPECT_EQ(client.QueryStatus().value().frames_done, 1U);
  EXPECT_EQ(FetchedFor(*picture), 0U);
  AwaitStatus(client, [&](const StatusReply& status) { return FetchedBytes(status) >= fetched; });
  EXPECT_EQ(FetchedBytes(client.QueryStatus().value()), fetched) << "by the workers' own count";
}

}  // namespace
}  // namespace slabstream
