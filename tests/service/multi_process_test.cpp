// Real processes over tcp: a coordinator and workers that are killed at seeded moments. No frame is lost and no picture changes.
//
// SLABSTREAM_SEED=N repeats a run's choices.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>

#include "common/image/run_image.h"
#include "data/open/read_volume.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/data/volume_io/vtu_files.h"
#include "tests/service/multi_process_fixture.h"
#include "tests/service/pictures.h"
#include "tests/support/random.h"
#include "tests/support/random_combining.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

// Writes a grid that fills the volume. The volume that readers make of the file.
std::shared_ptr<const Volume> WriteGrid(const Volume& volume, const std::string& path) {
  const Mesh mesh = GridOf(volume, 6);
  std::vector<Vec3> points;
  for (PointNumber point = 0; point < mesh.points.size(); ++point) points.push_back(PlaceOfPoint(mesh, point));
  std::vector<std::vector<int>> connectivity;
  for (const Tetrahedron& t : mesh.tetrahedra) connectivity.emplace_back(t.begin(), t.end());
  VtuSpec spec = GridSpec(points, std::vector<int>(connectivity.size(), 10), connectivity);
  spec.arrays[0].values.assign(mesh.values.begin(), mesh.values.end());
  const FileBytes bytes = VtuFile(spec);
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  return ReadVolume(path).value().volume;
}

// Stopped for longer than the coordinator waits for it, and continued: it is a new worker, and nothing else happens.
TEST_F(MultiProcessTest, StoppedWorkerComesBackAndCostsOneAttemptAtMost) {
  StartCoordinator();
  for (int i = 0; i < 3; ++i) StartWorker();
  Client client = Connect();
  AwaitWorkers(client, 3);
  ASSERT_TRUE(client.Render(TestRequest(Splatting(), 0)).ok());
  workers_[1].Stop();
  const RequestId request = client.Submit(TestRequest(Splatting(), 30));
  const Result<Picture> picture = Await(client, request, [] {});
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_EQ(picture->statistics.attempts, 2U) << "it was lost";
  workers_[1].Kill(SIGCONT);
  AwaitWorkers(client, 3);
  for (int i = 0; i < 20; ++i) {
    const Result<Picture> next = client.Render(TestRequest(Splatting(), 10 * i));
    ASSERT_TRUE(next.ok()) << next.status().message();
    EXPECT_EQ(next->statistics.attempts, 1U);
  }
  EXPECT_EQ(client.QueryStatus().value().workers_lost, 1U);
}

TEST_F(MultiProcessTest, KilledWorkersCostNoFrameAndChangeNoPicture) {
  StartCoordinator();
  for (int i = 0; i < 3; ++i) StartWorker();
  Client client = Connect();
  AwaitWorkers(client, 3);
  for (int round = 0; round < 8; ++round) {
    FrameRequest request = TestRequest(round % 2 == 0 ? Splatting() : ZBuffer(), random_.Integer(0, 359), random_.Integer(1, 4));
    request.size = {320, 300};
    request.previews = true;
    request.policy.combine = RandomCombining(random_);
    const LocalImage expected = RenderDirectly(request, *volume_);
    const auto victim = std::size_t(random_.Integer(0, int(workers_.size()) - 1));
    int events_left = random_.Integer(0, 4);
    SCOPED_TRACE(testing::Message() << "round " << round << ": worker " << victim << " of " << workers_.size() << " killed after "
                                    << events_left << " events");
    const RequestId id = client.Submit(request, seconds(100));
    bool killed = false;
    const auto maybe_kill = [&] {
      if (killed || events_left-- > 0) return;
      KillWorker(victim);
      killed = true;
    };
    maybe_kill();
    const Result<Picture> picture = Await(client, id, maybe_kill);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_LE(LargestDifference(picture->image, expected, request.size), AllowedDifference(request));
    if (killed && random_.Integer(0, 2) > 0) StartWorker();  // it joins while later frames run
    while (workers_.size() < 2) StartWorker();
  }
}

// Images between workers stay in their memory: it is used again and again, and nothing of it is left anywhere.
TEST_F(MultiProcessTest, ManyFramesTakeNoMoreMemoryAndFilesThanAFew) {
  const auto entries = [](const std::filesystem::path& path) {
    return std::distance(std::filesystem::directory_iterator(path), std::filesystem::directory_iterator());
  };
  const auto segments = entries("/dev/shm");
  StartCoordinator();
  for (int i = 0; i < 4; ++i) StartWorker();
  Client client = Connect();
  AwaitWorkers(client, 4);
  struct Use {
    std::ptrdiff_t files = 0, kib = 0;
  };
  const auto used = [&] {
    Use use;
    for (const ChildProcess& worker : workers_) {
      const std::filesystem::path process = "/proc/" + std::to_string(worker.pid());
      use.files += entries(process / "fd");
      std::ifstream status(process / "status");
      for (std::string line; std::getline(status, line);) {
        if (line.starts_with("VmRSS:")) use.kib += std::stol(line.substr(6));
      }
    }
    return use;
  };
  Use early;
  for (int i = 0; i < 200; ++i) {
    FrameRequest request = TestRequest(Splatting(), 3 * i, 2);
    request.size = {320, 300};
    request.policy.combine = RandomCombining(random_);
    const Result<Picture> picture = client.Render(request, seconds(60));
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    if (i == 60) early = used();
  }
  const Use late = used();
  EXPECT_LE(late.files, early.files + 4);
#ifndef __SANITIZE_ADDRESS__  // which keeps what is freed for a while, and more of it from frame to frame
  EXPECT_LE(late.kib, early.kib + early.kib / 2) << "KiB of four workers";
#endif
  workers_.clear();  // killed
  EXPECT_EQ(entries("/dev/shm"), segments);
}

TEST_F(MultiProcessTest, WorkersThatShareNoMemoryGiveTheSamePicture) {
  const std::string file = (directory_ / "grid.vtu").string();
  const std::shared_ptr<const Volume> grid = WriteGrid(*volume_, file);
  StartCoordinator("tcp://127.0.0.1:*", "tcp://127.0.0.1:*", {"--data", "grid=" + file});
  StartWorker();
  StartWorker({"--no-shared-memory"});
  StartWorker();
  Client client = Connect();
  AwaitWorkers(client, 3);
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (const RendererKind* renderer : Renderers()) {
      FrameRequest request = TestRequest(renderer, 50, 1);
      request.size = {320, 300};
      if (renderer->Can(Ability::kCells)) request.dataset = "grid";
      request.policy.combine = scheme.name;
      const Result<Picture> picture = client.Render(request, seconds(60));
      ASSERT_TRUE(picture.ok()) << picture.status().message();
      const LocalImage expected = RenderDirectly(request, renderer->Can(Ability::kCells) ? *grid : *volume_);
      EXPECT_GT(HighestAlpha(expected), ExpectedAlpha(request));
      EXPECT_LE(LargestDifference(picture->image, expected, request.size), AllowedDifference(request)) << scheme.name;

      request.policy.pixel_error = 1.0 / 1024;
      const Result<Picture> coded = client.Render(request, seconds(60));
      ASSERT_TRUE(coded.ok()) << coded.status().message();
      const double allowed = renderer->format() == PixelFormat::kRgba ? request.policy.pixel_error : 0;
      EXPECT_LE(LargestDifference(coded->image, expected, request.size), AllowedDifference(request) + allowed) << scheme.name;

      if (renderer != ZBuffer()) continue;
      request.straight8 = true;  // images have colours of 8 bits, and the picture has the same codes
      const Result<Picture> straight = client.Render(request, seconds(60));
      ASSERT_TRUE(straight.ok()) << straight.status().message();
      ASSERT_NE(straight->image.codes(), nullptr);
      const StraightImage& codes = *straight->image.codes();
      const RunImage runs = EncodePicture(expected, ColorCoding::kStraight8);
      StraightImage direct = MakeStraightImage(Union(codes.bounds, runs.header.bounds));
      ASSERT_EQ(codes.bounds, direct.bounds);
      ASSERT_EQ(ReadCodesInto(runs.header, runs.payload, {0, 0, request.size.width, request.size.height}, direct), Status::Ok());
      EXPECT_TRUE(std::ranges::equal(codes.codes, direct.codes)) << scheme.name;
    }
  }
}

TEST_F(MultiProcessTest, OneWorkerThatComesBackSavesTheFrame) {
  StartCoordinator();
  StartWorker();
  StartWorker();
  Client client = Connect();
  AwaitWorkers(client, 2);
  FrameRequest request = TestRequest(Splatting(), 33, 4);
  request.size = {512, 512};
  const RequestId id = client.Submit(request, seconds(100));
  bool killed = false;
  const Result<Picture> picture = Await(client, id, [&] {
    if (killed) return;
    KillWorker(0);
    KillWorker(0);
    StartWorker();
    killed = true;
  });
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
}

TEST_F(MultiProcessTest, WithoutWorkersAFrameEndsInAnErrorThatSaysSo) {
  StartCoordinator();
  Client client = Connect();
  const Result<Picture> picture = client.Render(TestRequest(Splatting(), 0), seconds(60));
  EXPECT_EQ(picture.status().code(), StatusCode::kUnavailable) << picture.status().message();
  EXPECT_THAT(picture.status().message(), HasSubstr("worker"));
  StartWorker();
  const Result<Picture> later = client.Render(TestRequest(Splatting(), 0), seconds(60));
  EXPECT_TRUE(later.ok()) << later.status().message();
}

TEST_F(MultiProcessTest, KilledCoordinatorEndsClientsAndWorkersComeBackToTheNextOne) {
  StartCoordinator();
  StartWorker();
  StartWorker();
  const FrameRequest request = TestRequest(ZBuffer(), 120, 3);
  const LocalImage expected = RenderDirectly(request, *volume_);
  {
    Client client = Connect();
    AwaitWorkers(client, 2);
    const Result<Picture> picture = client.Render(request, seconds(60));
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    coordinator_->Kill(SIGKILL);
    coordinator_->Wait();
    const Result<Picture> lost = client.Render(request, seconds(60));
    EXPECT_EQ(lost.status().code(), StatusCode::kUnavailable);
    EXPECT_THAT(lost.status().message(), HasSubstr(client_endpoint_));
  }
  StartCoordinator(client_endpoint_, worker_endpoint_);
  Client client = Connect();
  AwaitWorkers(client, 2);
  const Result<Picture> picture = client.Render(request, seconds(60));
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_EQ(LargestDifference(picture->image, expected, request.size), 0);
}

// Stopped and continued: who waits long enough gets the picture, the others are told.
TEST_F(MultiProcessTest, AStoppedCoordinatorGoesOnWhereItWas) {
  StartCoordinator();
  StartWorker();
  StartWorker();
  const FrameRequest request = TestRequest(ZBuffer(), 120, 3);
  const LocalImage expected = RenderDirectly(request, *volume_);
  Client patient = Connect({.silence = std::chrono::minutes(10)});
  Client hasty = Connect({.ping = std::chrono::milliseconds(20), .silence = std::chrono::milliseconds(200)});
  AwaitWorkers(patient, 2);
  coordinator_->Stop();
  const RequestId id = patient.Submit(request);
  const Status lost = hasty.Render(request, seconds(60)).status();
  EXPECT_EQ(lost.code(), StatusCode::kUnavailable);
  EXPECT_THAT(lost.message(), HasSubstr("has not answered for"));
  coordinator_->Kill(SIGCONT);
  for (const Result<Picture>& picture : {Await(patient, id, [] {}), hasty.Render(request, seconds(60))}) {
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_EQ(LargestDifference(picture->image, expected, request.size), 0);
  }
  EXPECT_EQ(patient.QueryStatus().value().workers_lost, 0U);
}

TEST_F(MultiProcessTest, SigtermEndsEachInOrderAndShutDownEndsAll) {
  StartCoordinator();
  StartWorker();
  StartWorker();
  {
    Client client = Connect();
    AwaitWorkers(client, 2);
    workers_[0].Kill(SIGTERM);
    EXPECT_EQ(workers_[0].Wait(), 0);
    coordinator_->Kill(SIGTERM);
    EXPECT_EQ(coordinator_->Wait(), 0);
  }
  // The other worker waits for a coordinator to come back.
  StartCoordinator(client_endpoint_, worker_endpoint_);
  Client client = Connect();
  AwaitWorkers(client, 1);
  const Status down = client.ShutDownService();
  EXPECT_TRUE(down.ok()) << down.message();
  EXPECT_EQ(coordinator_->Wait(), 0);
  EXPECT_EQ(workers_[1].Wait(), 0);
}

TEST_F(MultiProcessTest, BadArgumentsAreRefusedWithExitStatusTwo) {
  const auto run = [](std::vector<std::string> command) { return ChildProcess(command).Wait(); };
  EXPECT_EQ(run({SLABSTREAM_COORDINATOR_PROGRAM, "--listen", "tcp://0.0.0.0:*"}), 2);
  EXPECT_EQ(run({SLABSTREAM_COORDINATOR_PROGRAM, "--listen", "tcp://127.0.0.1:*", "--data", "ball=/missing.nrrd"}), 2);
  EXPECT_EQ(run({SLABSTREAM_WORKER_PROGRAM, "--coordinator", "elsewhere"}), 2);
  EXPECT_EQ(run({SLABSTREAM_WORKER_PROGRAM, "--coordinator", "tcp://127.0.0.1:1", "--threads", "0"}), 2);
  EXPECT_EQ(run({SLABSTREAM_WORKER_PROGRAM, "--coordinator", "tcp://127.0.0.1:1", "--threads", "1025"}), 2);
  EXPECT_EQ(run({SLABSTREAM_WORKER_PROGRAM}), 2);
  EXPECT_EQ(run({SLABSTREAM_COORDINATOR_PROGRAM, "--log-level", "loud"}), 2);
}

}  // namespace
}  // namespace slabstream
