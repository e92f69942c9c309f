// Whatever fails in a service fails only what it was part of, at once and with the reason; and what takes long delays nothing else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/service/service.h"
#include "tests/service/pictures.h"
#include "tests/support/renderers.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;
using Plans = Result<std::shared_ptr<const PlannedFrame>>;

// A coordinator and workers, each with its own hook, as threads of this process.
class FailuresTest : public testing::Test {
 protected:
  void Start(const std::vector<TaskHook>& workers, RendererFactory make_renderer = MakeRenderer) {
    const auto volume = TestSphere(48);
    coordinator_options.catalogue["ball"] = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
    coordinator_options.client_endpoint = "inproc://service";
    coordinator_ = CoordinatorService::Start(context_, std::move(coordinator_options)).value();
    for (const TaskHook& hook : workers) {
      WorkerOptions options;
      options.coordinator_endpoint = coordinator_->worker_endpoint();
      options.task_hook = hook;
      options.make_renderer = make_renderer;
      options.share_memory = share_memory;
      workers_.push_back(WorkerService::Start(context_, std::move(options)).value());
      workers_.back()->WaitUntilRegistered();
    }
    client_.emplace(Client::Connect(context_, coordinator_->client_endpoint()).value());
  }
  void StartOne() { Start({TaskHook()}); }

  // Its deadline is far beyond what the test may take: what ends sooner was told.
  Result<Picture> Render(const std::string& dataset = "ball", const std::string& decomposition = "slab") {
    FrameRequest request = TestRequest(Splatting(), 30);
    request.dataset = dataset;
    request.policy.decomposition = decomposition;
    if (decomposition == "kd-tree") request.policy.balance_by = "occupied";  // which waits for a count
    return client_->Render(request);
  }
  void ExpectFailure(const Result<Picture>& picture, StatusCode code, const std::string& reason) {
    ASSERT_FALSE(picture.ok());
    EXPECT_EQ(picture.status().code(), code) << picture.status().message();
    EXPECT_THAT(picture.status().message(), HasSubstr(reason));
  }

  Context context_;
  CoordinatorOptions coordinator_options;
  bool share_memory = true;
  std::unique_ptr<CoordinatorService> coordinator_;
  std::vector<std::unique_ptr<WorkerService>> workers_;
  std::optional<Client> client_;
};

// ---------------------------------------------------------------- workers

class TaskFailuresTest : public FailuresTest, public testing::WithParamInterface<const char*> {
 protected:
  static TaskHook NoMemoryFor(std::string task) {
    return [task = std::move(task)](std::string_view begun) {
      if (begun == task) throw std::bad_alloc();
    };
  }
};

TEST_P(TaskFailuresTest, OfOneWorkerCostsNoFrame) {
  share_memory = false;  // images are encoded, sent and decoded
  Start({NoMemoryFor(GetParam()), {}, {}});
  std::uint32_t attempts = 0;
  for (int frame = 0; frame < 4; ++frame) {
    const Result<Picture> picture = Render();
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    attempts += picture->statistics.attempts;
  }
  EXPECT_GT(attempts, 4U) << "nothing failed";
}

TEST_P(TaskFailuresTest, OfAllWorkersAreToldAtOnceAndTheServiceLivesOn) {
  share_memory = false;
  const auto broken = std::make_shared<std::atomic<bool>>(true);
  const TaskHook hook = [broken, no_memory = NoMemoryFor(GetParam())](std::string_view task) {
    if (*broken) no_memory(task);
  };
  Start({hook, hook});
  if (GetParam() == std::string("encode")) {
    EXPECT_TRUE(Render().ok()) << "a worker that is left alone sends no partial images";
  } else {
    ExpectFailure(Render(), StatusCode::kResourceExhausted, GetParam() + std::string(": not enough memory"));
  }
  *broken = false;
  EXPECT_TRUE(Render().ok());
  EXPECT_EQ(client_->QueryStatus().value().workers_lost, 0U);
}

INSTANTIATE_TEST_SUITE_P(Tasks, TaskFailuresTest, testing::Values("box", "render", "encode", "combine", "picture", "send"),
                         [](const auto& test) { return std::string(test.param); });

TEST_F(FailuresTest, WhoComesToTheOthersEndpointIsTold) {
  StartOne();
  WorkerOptions options;
  options.coordinator_endpoint = coordinator_->client_endpoint();
  const auto worker = WorkerService::Start(context_, std::move(options)).value();
  worker->WaitUntilRegistered();  // or stopped
  EXPECT_EQ(worker->ended().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(worker->ended().message(), HasSubstr("endpoint for clients; workers connect to " + coordinator_->worker_endpoint()));
  const Status client = Client::Connect(context_, coordinator_->worker_endpoint(), seconds(60)).status();
  EXPECT_EQ(client.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(client.message(), HasSubstr("endpoint for workers; clients connect to " + coordinator_->client_endpoint()));
  EXPECT_TRUE(Render().ok());
}

TEST_F(FailuresTest, ARendererThatThrowsIsReportedWithWhatItSaid) {
  Start({TaskHook(), TaskHook()}, [](const RendererKind&) -> std::unique_ptr<Renderer> { throw std::runtime_error("no such shader"); });
  ExpectFailure(Render(), StatusCode::kInternal, "render: no such shader");
}

// ---------------------------------------------------------------- the coordinator

TEST_F(FailuresTest, PlanningWithoutMemoryFailsThatFrameOnly) {
  std::atomic<bool> first = true;
  coordinator_options.make_plan = [&first](Planner& planner, const PlanRequest& request) -> Plans {
    if (first.exchange(false)) throw std::bad_alloc();
    return planner.Plan(request);
  };
  StartOne();
  ExpectFailure(Render(), StatusCode::kResourceExhausted, "planning: not enough memory");
  EXPECT_TRUE(Render().ok());
}

TEST_F(FailuresTest, CountingWithoutMemoryFailsWhatNeedsItOnly) {
  std::atomic<bool> first = true;
  coordinator_options.count_occupied = [&first](const VoxelBricks& voxels, const ClassificationTable& table, const VolumeSummary* summary) {
    if (first.exchange(false)) throw std::bad_alloc();
    return CountOccupied(voxels, table, summary);
  };
  StartOne();
  ExpectFailure(Render("ball", "kd-tree"), StatusCode::kResourceExhausted, "counting of occupied voxels: not enough memory");
  EXPECT_TRUE(Render().ok());
  EXPECT_TRUE(Render("ball", "kd-tree").ok());
}

TEST_F(FailuresTest, LoadersThatThrowFailTheirDatasetOnly) {
  coordinator_options.catalogue["large"] = []() -> Result<std::shared_ptr<const Volume>> { throw std::bad_alloc(); };
  coordinator_options.catalogue["damaged"] = []() -> Result<std::shared_ptr<const Volume>> { throw std::runtime_error("bad magic"); };
  StartOne();
  ExpectFailure(Render("large"), StatusCode::kResourceExhausted, "\"large\" could not be loaded: not enough memory");
  ExpectFailure(Render("damaged"), StatusCode::kInternal, "\"damaged\" could not be loaded: bad magic");
  EXPECT_TRUE(Render().ok());
}

TEST_F(FailuresTest, HeartbeatsAreAnsweredWhileAPlanIsMade) {
  std::latch go_on(1);
  coordinator_options.make_plan = [&](Planner& planner, const PlanRequest& request) {
    go_on.wait();
    return planner.Plan(request);
  };
  coordinator_options.machine.heartbeat = std::chrono::milliseconds(20);
  StartOne();
  const RequestId request = client_->Submit(TestRequest(Splatting(), 30));
  // Each time the worker was heard its silence begins anew.
  std::uint32_t silence = 0;
  for (int heard = 0; heard < 5;) {
    const Result<StatusReply> status = client_->QueryStatus();
    ASSERT_TRUE(status.ok()) << status.status().message();
    ASSERT_EQ(status->workers.size(), 1U);
    EXPECT_EQ(status->queued, 1U);
    if (status->workers[0].silent_ms < silence) ++heard;
    silence = status->workers[0].silent_ms;
  }
  go_on.count_down();
  while (true) {
    const std::optional<ClientEvent> event = client_->Next(seconds(10));
    ASSERT_TRUE(event.has_value());
    ASSERT_EQ(event->request, request);
    ASSERT_FALSE(std::holds_alternative<Status>(event->what));
    if (std::holds_alternative<Picture>(event->what)) break;
  }
  EXPECT_EQ(client_->QueryStatus().value().workers_lost, 0U);
}

// Loads that wait until the test lets them go on. They share what they use, since a service that ends leaves them alone.
struct SlowLoads {
  std::latch go_on{1};

  static VolumeLoader Of(const std::shared_ptr<SlowLoads>& loads) {
    return [loads]() -> Result<std::shared_ptr<const Volume>> {
      loads->go_on.wait();
      return TestSphere(16);
    };
  }
};

TEST_F(FailuresTest, LoadsDelayNeitherCountsNorOtherDatasets) {
  const auto slow = std::make_shared<SlowLoads>();
  for (const char* name : {"a", "b", "c"}) coordinator_options.catalogue[name] = SlowLoads::Of(slow);
  coordinator_options.catalogue["quick"] = []() -> Result<std::shared_ptr<const Volume>> { return TestSphere(32); };
  StartOne();
  ASSERT_TRUE(Render().ok());
  std::vector<RequestId> waiting;
  for (const char* name : {"a", "b", "c"}) {
    FrameRequest request = TestRequest(Splatting(), 0);
    request.dataset = name;
    waiting.push_back(client_->Submit(request));
  }
  const Result<Picture> counted = Render("ball", "kd-tree");
  EXPECT_TRUE(counted.ok()) << counted.status().message();
  const Result<Picture> loaded = Render("quick", "kd-tree");
  EXPECT_TRUE(loaded.ok()) << loaded.status().message();
  slow->go_on.count_down();
  for (std::size_t pictures = 0; pictures < waiting.size();) {
    const std::optional<ClientEvent> event = client_->Next(seconds(10));
    ASSERT_TRUE(event.has_value());
    ASSERT_FALSE(std::holds_alternative<Status>(event->what));
    if (std::holds_alternative<Picture>(event->what)) ++pictures;
  }
}

TEST_F(FailuresTest, AServiceThatLoadsEndsAtOnce) {
  const auto slow = std::make_shared<SlowLoads>();
  coordinator_options.catalogue["slow"] = SlowLoads::Of(slow);
  StartOne();
  FrameRequest request = TestRequest(Splatting(), 0);
  request.dataset = "slow";
  client_->Submit(request);
  const std::optional<ClientEvent> progress = client_->Next(seconds(10));
  ASSERT_TRUE(progress.has_value());
  EXPECT_TRUE(client_->ShutDownService().ok());
  workers_.clear();
  coordinator_.reset();  // would wait for ever
  slow->go_on.count_down();
}

// ---------------------------------------------------------------- clients

TEST_F(FailuresTest, AClientThatNeverReadsWaitsAndTheOthersGoOn) {
  coordinator_options.machine.client_timeout = seconds(600);
  StartOne();
  Socket deaf = Socket::Dealer(context_).value();
  ASSERT_TRUE(deaf.Connect(coordinator_->client_endpoint()).ok());
  SubmitFrame submit;
  submit.frame = TestRequest(Splatting(), 0, 1);
  submit.frame.size = {1024, 1024};
  submit.frame.view.zoom = 6;  // the ball fills the picture
  constexpr int kAsked = 40;
  for (int i = 1; i <= kAsked; ++i) {
    submit.request = RequestId(i);
    ASSERT_TRUE(deaf.Send({}, Encode(submit)).ok());
  }
  std::uint64_t done = 0;
  const Time limit = MonotonicNow() + seconds(120);
  while (MonotonicNow() < limit) {
    const StatusReply status = client_->QueryStatus().value();
    done = status.frames_done;
    if (status.running == 0 && status.queued > 0 && done > 0) break;
  }
  EXPECT_LT(done, std::uint64_t{kAsked} / 2) << "of pictures of 16 MB";
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(Render().ok());
  EXPECT_EQ(client_->QueryStatus()->frames_done, done + 3);

  // It reads at last, says so, and gets the rest.
  std::uint64_t received = 0;
  int pictures = 0;
  while (pictures < kAsked && MonotonicNow() < limit) {
    const std::array<Socket*, 1> sockets = {&deaf};
    Wait(sockets, nullptr, std::chrono::milliseconds(100));
    while (const std::optional<Incoming> incoming = deaf.TryReceive()) {
      if (incoming->parts.size() < 2) continue;
      received += incoming->parts[1].size();
      ++pictures;
      (void)deaf.Send({}, Encode(ClientPing{.nonce = 1, .open = {}, .received_bytes = received}));
    }
  }
  EXPECT_EQ(pictures, kAsked);
}

}  // namespace
}  // namespace slabstream
