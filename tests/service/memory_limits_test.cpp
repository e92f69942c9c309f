// Limits of memory, on real processes: what does not fit is refused, and what fits stays under the limit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>

#include "common/planning/frame_plan.h"
#include "common/planning/worker_memory.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/volume_writer.h"
#include "tests/service/child_process.h"
#include "tests/service/pictures.h"
#include "tests/support/renderers.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

// The most that a process has held in memory so far, bytes.
std::uint64_t PeakResidentBytes(pid_t pid) {
  const std::string text = ReadFile("/proc/" + std::to_string(pid) + "/status");
  const std::size_t at = text.find("VmHWM:");
  CHECK(at != std::string::npos) << pid;
  return std::stoull(text.substr(at + 6)) * 1024;
}

// No brick of it has one value.
std::shared_ptr<const Volume> Noise(int side) {
  auto noise = std::make_shared<Volume>();
  noise->description.geometry.size = {side, side, side};
  noise->block = MakeVoxelBlock(noise->description.geometry.bounds(), ScalarType::kUint8);
  for (std::size_t i = 0; i < noise->block.bytes.size(); ++i) noise->block.bytes[i] = std::byte(i * 2654435761U >> 13);
  return noise;
}

class MemoryLimitsTest : public testing::Test {
 protected:
  void Start(const std::string& worker_memory, int workers = 1, const std::string& coordinator_memory = "1GiB") {
    std::vector<std::string> command = {
        SLABSTREAM_COORDINATOR_PROGRAM, "--listen", "tcp://127.0.0.1:*", "--memory", coordinator_memory, "--log-level", "error"};
    for (const std::string& name : datasets_) command.insert(command.end(), {"--data", name + "=" + PathOf(name)});
    coordinator_.emplace(command);
    const std::string ready = coordinator_->ReadLine();
    const auto value_of = [&](const std::string& key) {
      const std::size_t begin = ready.find(key + "=") + key.size() + 1;
      return ready.substr(begin, ready.find(' ', begin) - begin);
    };
    ASSERT_THAT(ready, HasSubstr("slabstream-coordinator ready"));
    for (int i = 0; i < workers; ++i) {
      workers_.emplace_back(std::vector<std::string>{SLABSTREAM_WORKER_PROGRAM, "--coordinator", value_of("workers"), "--memory",
                                                     worker_memory, "--log-level", "error"});
    }
    client_.emplace(Client::Connect(context_, value_of("client"), seconds(30)).value());
    const Time limit = MonotonicNow() + seconds(60);
    while (client_->QueryStatus(seconds(30)).value().workers.size() < std::size_t(workers)) ASSERT_LT(MonotonicNow(), limit);
  }
  std::string PathOf(const std::string& name) const { return temporary_.path() + "/" + name + ".nrrd"; }
  void Write(const std::string& name, const std::shared_ptr<const Volume>& volume) {
    const Status written = WriteVolume(*volume, PathOf(name));
    ASSERT_TRUE(written.ok()) << written.message();
    datasets_.push_back(name);
  }
  static FrameRequest Large(const std::string& dataset, int side) {
    FrameRequest request = TestRequest(FindRenderer("raycast"), 30, 1);
    request.dataset = dataset;
    request.size = {side, side};
    request.view.zoom = 6;  // the volume fills the picture
    return request;
  }

  TemporaryDirectory temporary_;
  std::vector<std::string> datasets_;
  Context context_;
  std::optional<ChildProcess> coordinator_;
  std::vector<ChildProcess> workers_;
  std::optional<Client> client_;
};

TEST_F(MemoryLimitsTest, WhatIsTooLargeIsRefusedAtOnceAndEndsNobody) {
  Write("ball", TestSphere(64));
  Start("512MiB", 2);
  const Result<Picture> picture = client_->Render(Large("ball", 8192));
  ASSERT_FALSE(picture.ok());
  EXPECT_EQ(picture.status().code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(picture.status().message(), HasSubstr("size 8192x8192 needs"));
  EXPECT_THAT(picture.status().message(), HasSubstr("limit 512 MiB"));
  const StatusReply status = client_->QueryStatus().value();
  EXPECT_EQ(status.workers_lost, 0U);
  EXPECT_EQ(status.memory_bytes, std::uint64_t{1} << 30);
  ASSERT_EQ(status.workers.size(), 2U);
  EXPECT_EQ(status.workers[1].memory_bytes, std::uint64_t{512} << 20);
  EXPECT_TRUE(client_->Render(Large("ball", 256)).ok());
}

// The formula against what a worker takes.
TEST_F(MemoryLimitsTest, FramesThatFitStayUnderTheLimitAndUseWhatTheyAreSaidToNeed) {
  const std::shared_ptr<const Volume> volume = TestSphere(64);
  Write("ball", volume);
  constexpr int kSide = 2048;
  const VolumeSummary summary = Summarize(*volume);
  const FramePlan plan = PlanFrame(Large("ball", kSide), 1, summary, {{1}}).value();
  const std::uint64_t images = GroupImageBytes(plan.setup, plan.groups[0].placements) + PictureBytes(plan.setup);
  const std::uint64_t limit = std::uint64_t{512} << 20;
  ASSERT_EQ(*FramesThatFit(plan, summary, std::vector<WorkerLimit>{{1, limit}}), 1);
  Start("512MiB");
  constexpr int kFrames = 3;
  for (int i = 0; i < kFrames; ++i) client_->Submit(Large("ball", kSide));
  for (int done = 0; done < kFrames;) {
    const std::optional<ClientEvent> event = client_->Next(seconds(120));
    ASSERT_TRUE(event.has_value());
    ASSERT_FALSE(std::holds_alternative<Status>(event->what)) << std::get<Status>(event->what).message();
    if (std::holds_alternative<Picture>(event->what)) ++done;
  }
  const std::uint64_t peak = PeakResidentBytes(workers_[0].pid());
  EXPECT_LE(peak, limit);
  EXPECT_GE(peak, images / 3) << "far less than it is said to need";
  RecordProperty("peak_mib", int(peak >> 20));
}

// Each axis and number of groups divides the volume in another way, and each renderer keeps data of its own.
TEST_F(MemoryLimitsTest, CachesOfManyLayoutsStayUnderTheLimit) {
  Write("noise", Noise(320));
  Start("320MiB");
  for (const AxisChoice axis : {AxisChoice::kX, AxisChoice::kY, AxisChoice::kZ}) {
    for (const int groups : {2, 3, 5}) {
      for (const char* renderer : {"splat", "raycast"}) {
        FrameRequest request = TestRequest(FindRenderer(renderer), 30, groups);
        request.dataset = "noise";
        request.policy.axis = axis;
        const Result<Picture> picture = client_->Render(request);
        ASSERT_TRUE(picture.ok()) << groups << " groups: " << picture.status().message();
      }
    }
  }
  EXPECT_LE(PeakResidentBytes(workers_[0].pid()), std::uint64_t{320} << 20);
  RecordProperty("peak_mib", int(PeakResidentBytes(workers_[0].pid()) >> 20));
}

TEST_F(MemoryLimitsTest, ACoordinatorThatVisitsManyDatasetsStaysUnderItsLimit) {
  const std::shared_ptr<const Volume> volume = Noise(400);  // 61 MiB
  for (const char* name : {"a", "b", "c", "d", "e", "f"}) Write(name, volume);
  Start("512MiB", 1, "256MiB");
  for (const std::string name : {"a", "b", "c", "d", "e", "f", "a"}) {
    FrameRequest request = TestRequest(FindRenderer("mip"), 0, 4);
    request.dataset = name;
    const Result<Picture> picture = client_->Render(request);
    ASSERT_TRUE(picture.ok()) << name << ": " << picture.status().message();
  }
  EXPECT_LE(PeakResidentBytes(coordinator_->pid()), std::uint64_t{256} << 20);
  EXPECT_LE(PeakResidentBytes(workers_[0].pid()), std::uint64_t{512} << 20);
}

}  // namespace
}  // namespace slabstream
