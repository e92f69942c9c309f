// Owners that make their boxes when somebody asks for them: pictures are those of the same array, whatever the budget; only boxes that can
// show are made; a failure to make ends in one line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "client/client.h"
#include "client/owner/volume_owner.h"
#include "common/volume/box_assembly.h"
#include "common/wire/any_message.h"
#include "coordinator/service/service.h"
#include "tests/service/pictures.h"
#include "tests/support/random_volume.h"
#include "tests/support/renderers.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

constexpr Index3 kSize = {64, 64, 64};
constexpr std::uint32_t kOwners = 3;
constexpr Duration kPatience = seconds(60);

FrameRequest Request(double azimuth = 30) {
  FrameRequest request = TestRequest(FindRenderer("raycast"), azimuth, 0);
  request.termination = 0;
  return request;
}

class OwnersOnDemandTest : public testing::Test {
 protected:
  OwnersOnDemandTest()
      : volume_(MakeTestVolume(kSize, ScalarType::kUint8, [](const Index3& v) {
          return std::max(0.0, 250 - 6 * Length(ToVec3(v) - Vec3{30, 28, 34}));
        })) {}
  ~OwnersOnDemandTest() override {
    owners_.clear();
    workers_.clear();
  }

  void Start(std::uint64_t budget_chunks, bool share_memory = true) {
    CoordinatorOptions options;
    options.client_endpoint = "inproc://clients";
    options.worker_endpoint = "inproc://workers";
    options.voxels_endpoint = "inproc://voxels";
    coordinator_ = CoordinatorService::Start(context_, std::move(options)).value();
    for (int i = 0; i < 2; ++i) {
      WorkerOptions worker;
      worker.coordinator_endpoint = coordinator_->worker_endpoint();
      worker.machine.threads = 1;
      workers_.push_back(WorkerService::Start(context_, worker).value());
    }
    for (const auto& worker : workers_) worker->WaitUntilRegistered();
    client_.emplace(Client::Connect(context_, coordinator_->client_endpoint(), kPatience).value());
    const std::vector<Box> boxes = CutAtBlocks({{0, 0, 0}, kSize}, Uniform(chunk_));
    for (std::uint32_t owner = 0; owner < kOwners; ++owner) {
      VolumeOwnerOptions of{.endpoint = coordinator_->worker_endpoint(), .dataset = "ball", .owner = owner, .owners = kOwners};
      of.description.geometry.size = kSize;
      of.share_memory = share_memory;
      of.layout.samples = SampleType::kUint8;
      const std::size_t begin = boxes.size() * owner / kOwners, end = boxes.size() * (owner + 1) / kOwners;
      for (std::size_t i = begin; i < end; ++i) of.layout.boxes.push_back({.box = boxes[i], .held = boxes[i]});
      of.layout.PlaceDense();
      of.made_bytes = budget_chunks * CountIn(Uniform(chunk_));
      of.make = [this, held = of.layout.boxes](std::size_t box, std::uint64_t time) { return Make(held[box].box, time); };
      owners_.push_back(VolumeOwner::Start(context_, of).value());
      ASSERT_TRUE(owners_.back()->Begin(kPatience).ok());
      ASSERT_TRUE(owners_.back()->Commit(1, 1).ok());
    }
  }
  // Opens the dataset: its survey makes what it reads.
  void Open() {
    for (const Time end = MonotonicNow() + kPatience; MonotonicNow() < end;) {
      if (client_->Summarize(SummaryOf(Request())).ok()) break;
    }
    const std::lock_guard lock(mutex_);
    made_.clear();
  }

  Result<MadeBox> Make(const Box& box, std::uint64_t time) {
    EXPECT_EQ(time, 1U);
    {
      const std::lock_guard lock(mutex_);
      ++made_[box];
      if (fails_) return Status::InvalidArgument("the sea is rough");
    }
    const std::size_t count = CountIn(box.size());
    const auto samples = std::shared_ptr<std::byte[]>(new std::byte[count], [count](std::byte* gone) {
      std::fill_n(gone, count, std::byte{0xEE});  // whoever reads it now sees it
      delete[] gone;
    });
    std::byte* to = samples.get();
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        to = std::copy_n(volume_.block.bytes.begin() + volume_.block.Offset({box.begin.x, y, z}), box.size().x, to);
      }
    }
    return MadeBox(samples, samples.get());
  }

  std::map<Box, int> Made() {
    const std::lock_guard lock(mutex_);
    return made_;
  }
  void ExpectRight(const FrameRequest& request) {
    const Result<Picture> picture = client_->Render(request, kPatience);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, volume_), request.size), AllowedRounding(request));
    sent_ = 0;
    for (const RankReport& report : picture->statistics.reports) sent_ += report.stored_bytes;
  }

  Volume volume_;
  std::int32_t chunk_ = 16;
  Context context_;
  std::unique_ptr<CoordinatorService> coordinator_;
  std::vector<std::unique_ptr<WorkerService>> workers_;
  std::vector<std::unique_ptr<VolumeOwner>> owners_;
  std::optional<Client> client_;
  std::uint64_t sent_ = 0;
  std::mutex mutex_;
  std::map<Box, int> made_;
  bool fails_ = false;
};

TEST_F(OwnersOnDemandTest, PicturesAreThoseOfOneArrayWithinABudgetOfTwoBoxes) {
  for (const bool share_memory : {true, false}) {
    SCOPED_TRACE(share_memory);
    owners_.clear();
    workers_.clear();
    client_.reset();
    coordinator_.reset();
    ASSERT_NO_FATAL_FAILURE(Start(2, share_memory));
    Open();
    for (const double azimuth : {30.0, 200.0}) ExpectRight(Request(azimuth));
  }
}

TEST_F(OwnersOnDemandTest, InPlaceNothingTravelsAndEachBoxIsMadeOnce) {
  ASSERT_NO_FATAL_FAILURE(Start(64));
  Open();
  ExpectRight(Request());
  EXPECT_EQ(sent_, 0U);
  EXPECT_TRUE(Made().empty()) << "the survey of a small volume has made all";
}

TEST_F(OwnersOnDemandTest, ASliceMakesTheBoxesThatItCuts) {
  ASSERT_NO_FATAL_FAILURE(Start(1));
  Open();
  FrameRequest request = Request();
  request.clipping.slab = ClipSlab{.normal = {0, 0, 1}, .index = 24};
  ExpectRight(request);
  const std::map<Box, int> made = Made();
  EXPECT_FALSE(made.empty());
  for (const auto& [box, times] : made) EXPECT_EQ(box.begin.z, 16);
}

TEST_F(OwnersOnDemandTest, ACropMakesTheBoxThatItShows) {
  ASSERT_NO_FATAL_FAILURE(Start(1));
  Open();
  FrameRequest request = Request();
  request.clipping.box = ClipBox{.low = {20, 20, 36}, .high = {28, 28, 44}, .unit = ClipUnit::kVoxels};
  ExpectRight(request);
  const std::map<Box, int> made = Made();
  ASSERT_LE(made.size(), 1U) << "the owner may still keep it";
  if (!made.empty()) {
    EXPECT_EQ(made.begin()->first, (Box{{16, 16, 32}, {32, 32, 48}}));
  }
}

// Solid matter fills the picture: the nearest layer of boxes shows, and the halo is in the next one. Those behind are hidden, but for what
// a worker draws before the columns beside it are opaque.
TEST_F(OwnersOnDemandTest, BoxesThatOpaqueOnesHideAreNotMade) {
  volume_ = MakeTestVolume(kSize, ScalarType::kUint8, [](const Index3&) { return 250.0; });
  chunk_ = 8;
  ASSERT_NO_FATAL_FAILURE(Start(1));
  Open();
  FrameRequest request = TestRequest(FindRenderer("raycast"), 0, 0);
  request.view.elevation_degrees = 0;
  request.view.zoom = 3;
  request.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 1, 0.5, 0}}, .opacity_distance = 1};
  request.termination = 0.01;
  ASSERT_TRUE(client_->Render(request, kPatience).ok());
  std::array<int, 8> layers = {};
  for (const auto& [box, times] : Made()) ++layers.at(std::size_t(box.begin.y / chunk_));
  EXPECT_EQ(layers[0], 64);
  EXPECT_LT(layers[2] + layers[3], 64) << "of 128";
  for (const std::size_t hidden : {4, 5, 6, 7}) EXPECT_EQ(layers.at(hidden), 0) << hidden;
}

TEST_F(OwnersOnDemandTest, AFailureToMakeIsTheEndOfThePictureInOneLine) {
  ASSERT_NO_FATAL_FAILURE(Start(1));
  Open();
  {
    const std::lock_guard lock(mutex_);
    fails_ = true;
  }
  const Result<Picture> picture = client_->Render(Request(), kPatience);
  EXPECT_EQ(picture.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(picture.status().message(), HasSubstr("of 3: the sea is rough"));
  EXPECT_EQ(picture.status().message().find('\n'), std::string::npos);
}

}  // namespace
}  // namespace slabstream
