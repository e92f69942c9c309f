// The whole service in this process, over inproc: its pictures are those of one renderer that holds the whole volume, whoever comes and
// goes meanwhile.
#include "client/embedded/embedded_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "common/image/sample_codes.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/service/next_picture.h"
#include "tests/service/pictures.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

using std::chrono::seconds;

EmbeddedOptions OptionsFor(std::shared_ptr<const Volume> volume, int workers, int threads = 1) {
  EmbeddedOptions options;
  options.workers = workers;
  options.worker.threads = std::uint32_t(threads);
  options.coordinator.catalogue["ball"] = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  options.coordinator.catalogue["broken"] = []() -> Result<std::shared_ptr<const Volume>> { return Status::DataLoss("file ends early"); };
  return options;
}

std::vector<std::uint8_t> StraightCodesOf(const LocalImage& image, const Premultiplied& behind = {}) {
  std::vector<std::uint8_t> codes(image.rgba.size());
  StraightCodes(image.rgba.data(), codes.size() / 4, codes.data(), behind);
  return codes;
}

class EmbeddedServiceTest : public testing::Test {
 protected:
  void Start(int workers, int threads = 1) {
    auto started = EmbeddedService::Start(context_, OptionsFor(volume_, workers, threads));
    ASSERT_TRUE(started.ok()) << started.status().message();
    service_ = std::move(*started);
  }
  Client Connect() {
    Result<Client> client = service_->Connect();
    CHECK(client.ok()) << client.status().message();
    return std::move(*client);
  }
  // A frame that takes long.
  static FrameRequest LargeRequest() {
    FrameRequest request = TestRequest(Splatting(), 10, 8);
    request.size = {2048, 2048};
    return request;
  }
  static void ExpectIdle(Client& client) {
    const Result<StatusReply> status = client.QueryStatus();
    ASSERT_TRUE(status.ok()) << status.status().message();
    EXPECT_EQ(status->running + status->queued, 0U);
  }
  // Asks for the picture and compares it with the direct one.
  FrameStatistics ExpectRightPicture(Client& client, const FrameRequest& request) {
    const Result<Picture> picture = client.Render(request, seconds(60));
    EXPECT_TRUE(picture.ok()) << picture.status().message();
    if (!picture.ok()) return {};
    EXPECT_EQ(picture->size, request.size);
    EXPECT_GT(HighestAlpha(picture->image), ExpectedAlpha(request));
    EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
    return picture->statistics;
  }

  Context context_;
  std::shared_ptr<const Volume> volume_ = std::make_shared<const Volume>(AsGrid(*TestSphere(40)));
  std::unique_ptr<EmbeddedService> service_;
};

// A picture in the codes of a PNG of 8 bits makes the same PNG as the picture itself, and has no depths.
TEST_F(EmbeddedServiceTest, PicturesComeInTheCodesOfAFileIfThatIsEnough) {
  Start(1);
  Client client = Connect();
  for (const RendererKind* renderer : Renderers()) {
    SCOPED_TRACE(renderer->name());
    FrameRequest request = TestRequest(renderer, 30, 2);
    const Result<Picture> floats = client.Render(request);
    request.straight8 = true;
    const Result<Picture> codes = client.Render(request);
    ASSERT_TRUE(floats.ok() && codes.ok()) << floats.status().message() << codes.status().message();
    ASSERT_TRUE(codes->image.codes() != nullptr) << "it came as floats";
    EXPECT_EQ(codes->image.bounds(), floats->image.bounds());
    const PooledVector<std::uint8_t>& found = codes->image.codes()->codes;
    EXPECT_TRUE(std::ranges::equal(found, StraightCodesOf(*floats->image.floats())));
    request.straight8_over = {0.25F, 1, 0.5F};
    const Result<Picture> over = client.Render(request);
    ASSERT_TRUE(over.ok() && over->image.codes() != nullptr) << over.status().message();
    EXPECT_EQ(over->image.bounds(), floats->image.bounds());
    EXPECT_TRUE(std::ranges::equal(over->image.codes()->codes, StraightCodesOf(*floats->image.floats(), {0.25F, 1, 0.5F, 1})));
  }
}

TEST_F(EmbeddedServiceTest, PictureIsThatOfOneRendererForAnyWorkersAndGroups) {
  for (const int workers : {1, 3}) {
    Start(workers);
    Client client = Connect();
    for (const RendererKind* renderer : Renderers()) {
      for (const int groups : {1, 2, 5}) {
        SCOPED_TRACE(testing::Message() << workers << " workers, " << groups << " groups, renderer " << renderer->name());
        const FrameStatistics statistics = ExpectRightPicture(client, TestRequest(renderer, 30, groups));
        EXPECT_EQ(statistics.groups, std::uint32_t(groups));
        EXPECT_EQ(statistics.attempts, 1U);
      }
    }
  }
}

// What the boxes of groups 2 and later draw if nobody tells them what the groups in front hide.
std::uint64_t DrawnBehindWithoutMasks(const FrameRequest& request, const Volume& volume, std::uint32_t workers) {
  Roster roster;
  for (WorkerId worker = 1; worker <= workers; ++worker) roster.slots.push_back(worker);
  const FramePlan plan = PlanFrame(request, 1, Summarize(volume), roster).value();
  VoxelBlock copy = MakeVoxelBlock(volume.block.box, volume.block.type);
  copy.bytes = volume.block.bytes;
  BoxData data(std::move(copy));
  RenderControl control;
  RankReport report;
  for (std::size_t group = 2; group < plan.groups.size(); ++group) {
    for (const Placement& placement : plan.groups[group].placements) {
      EXPECT_TRUE(MakeRenderer(*plan.setup.renderer)->Render(data, placement.box, plan.setup, {}, control, report).ok());
    }
  }
  return report.drawn_voxels;
}

// The first two groups are handed out together; each later one is told what those in front of it hide, but the one right before it.
TEST_F(EmbeddedServiceTest, GroupsLeaveOutWhatThoseInFrontHide) {
  auto block = std::make_shared<Volume>(*TestSphere(64));
  std::ranges::fill(block->block.bytes, std::byte{255});
  volume_ = block;
  FrameRequest request = TestRequest(Splatting(), 30, 6);
  request.view.elevation_degrees = 70;  // slabs are behind each other
  request.size = {200, 200};
  std::get<TransferFunction>(request.transfer.choice).opacities = {{0, 0.9, 0.5, 0}};
  for (const int workers : {1, 2, 3}) {
    for (const bool close : {false, true}) {
      SCOPED_TRACE(testing::Message() << workers << " workers, close " << close);
      Start(workers);
      Client client = Connect();
      request.view.zoom = close ? 4 : 1;
      const FrameStatistics statistics = ExpectRightPicture(client, request);
      std::uint64_t drawn = 0, fetched = 0;
      for (const RankReport& report : statistics.reports) {
        drawn += report.group >= 2 ? report.drawn_voxels : 0;
        fetched += report.group >= 2 ? report.voxel_bytes : 0;
      }
      if (close) {  // the block's front fills the picture
        EXPECT_EQ(drawn, 0U);
        EXPECT_EQ(fetched, 0U);
      } else {
        EXPECT_LT(drawn, DrawnBehindWithoutMasks(request, *volume_, std::uint32_t(workers)) * 2 / 3);
      }
    }
  }
}

TEST_F(EmbeddedServiceTest, ThreadsAndWorkersGiveTheSamePicture) {
  for (const RendererKind* renderer : Renderers()) {
    const FrameRequest request = TestRequest(renderer, 200, 1);
    std::optional<Picture> first;
    const auto difference = [&](int workers, int threads) {
      Start(workers, threads);
      Client client = Connect();
      Picture picture = client.Render(request, seconds(60)).value();
      if (!first) first = picture;
      return LargestDifference(first->image, picture.image, request.size);
    };
    SCOPED_TRACE(testing::Message() << "renderer " << renderer->name());
    for (const int threads : {1, 2, 3}) EXPECT_EQ(difference(1, threads), 0) << threads << " threads";
    EXPECT_LE(difference(2, 1), AllowedDifference(request));
    EXPECT_LE(difference(2, 3), AllowedDifference(request));
  }
}

TEST_F(EmbeddedServiceTest, StatusTellsTheThreadsOfWorkers) {
  Start(2, 3);
  const StatusReply status = Connect().QueryStatus().value();
  ASSERT_EQ(status.workers.size(), 2U);
  for (const WorkerStatus& worker : status.workers) EXPECT_EQ(worker.threads, 3U);
}

TEST_F(EmbeddedServiceTest, SecondFrameMovesNoVoxels) {
  Start(2);
  Client client = Connect();
  EXPECT_GT(VoxelBytes(ExpectRightPicture(client, TestRequest(Splatting(), 0))), 0U);
  EXPECT_EQ(VoxelBytes(ExpectRightPicture(client, TestRequest(Splatting(), 137))), 0U);
  EXPECT_EQ(VoxelBytes(ExpectRightPicture(client, TestRequest(ZBuffer(), 251))), 0U);
}

// Every other frame workers swap the volume's front and back. Each then holds both.
TEST_F(EmbeddedServiceTest, AlternatingFramesAreRightAndMoveNoVoxelsFromTheThirdOn) {
  Start(4);
  Client client = Connect();
  FrameRequest request = TestRequest(&DefaultRenderer(), 30, 1);
  request.policy.assignment = "alternating";
  EXPECT_GT(VoxelBytes(ExpectRightPicture(client, request)), 0U);
  EXPECT_GT(VoxelBytes(ExpectRightPicture(client, request)), 0U);
  EXPECT_EQ(VoxelBytes(ExpectRightPicture(client, request)), 0U);
  EXPECT_EQ(VoxelBytes(ExpectRightPicture(client, request)), 0U);
}

TEST_F(EmbeddedServiceTest, SeveralClientsAtOnce) {
  Start(2);
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([this, i] {
      Client client = Connect();
      for (int frame = 0; frame < 3; ++frame) {
        ExpectRightPicture(client, TestRequest(i % 2 == 0 ? Splatting() : ZBuffer(), 100 * i + 40 * frame));
      }
    });
  }
}

TEST_F(EmbeddedServiceTest, OneClientKeepsSeveralFramesInFlight) {
  Start(2);
  Client client = Connect();
  std::map<RequestId, FrameRequest> open;
  for (int i = 0; i < 6; ++i) {
    const FrameRequest request = TestRequest(Splatting(), 60 * i);
    open.emplace(client.Submit(request, seconds(60)), request);
  }
  while (!open.empty()) {
    const std::optional<AnsweredRequest> answered = NextPicture(client);
    ASSERT_TRUE(answered.has_value());
    const FrameRequest& request = open.at(answered->request);
    EXPECT_LE(LargestDifference(answered->picture.image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
    open.erase(answered->request);
  }
}

TEST_F(EmbeddedServiceTest, PreviewsComeGroupByGroupAndThenThePicture) {
  Start(2);
  Client client = Connect();
  FrameRequest request = TestRequest(Splatting(), 75, 4);
  request.previews = true;
  const RequestId id = client.Submit(request, seconds(60));
  std::uint32_t groups_done = 0;
  double alpha = 0;
  for (bool final = false; !final;) {
    const std::optional<AnsweredRequest> answered = NextPicture(client);
    ASSERT_TRUE(answered.has_value());
    EXPECT_EQ(answered->request, id);
    const Picture& picture = answered->picture;
    EXPECT_GT(picture.groups_done, groups_done);
    EXPECT_GE(HighestAlpha(picture.image), alpha - 1e-6);  // what lies behind can only add
    groups_done = picture.groups_done;
    alpha = HighestAlpha(picture.image);
    final = picture.final;
    EXPECT_EQ(final, groups_done == picture.group_count);
    if (final) {
      EXPECT_LE(LargestDifference(picture.image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
    }
  }
  EXPECT_EQ(groups_done, 4U);
}

TEST_F(EmbeddedServiceTest, CancelEndsTheRequestAndFreesTheWorkers) {
  volume_ = TestSphere(128);
  Start(2);
  Client client = Connect();
  const FrameRequest large = LargeRequest();
  const RequestId id = client.Submit(large, seconds(60));
  std::optional<ClientEvent> event = client.Next(seconds(60));
  ASSERT_TRUE(event.has_value());  // progress: it has arrived
  client.Cancel(id);
  while (event && !std::holds_alternative<Status>(event->what)) {
    if (const auto* picture = std::get_if<Picture>(&event->what); picture != nullptr && picture->final)
      FAIL() << "rendered before the cancel came";
    event = client.Next(seconds(60));
  }
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(event->request, id);
  EXPECT_EQ(std::get<Status>(event->what).code(), StatusCode::kCancelled);
  ExpectIdle(client);
  ExpectRightPicture(client, TestRequest(ZBuffer(), 10));
}

TEST_F(EmbeddedServiceTest, ClientThatGoesAwayFreesItsWork) {
  volume_ = TestSphere(128);
  Start(1);
  {
    Client client = Connect();
    const FrameRequest large = LargeRequest();
    for (int i = 0; i < 8; ++i) client.Submit(large, std::chrono::minutes(60));
  }
  Client client = Connect();
  ExpectRightPicture(client, TestRequest(ZBuffer(), 10));
  ExpectIdle(client);
}

TEST_F(EmbeddedServiceTest, WorkersLeaveAndJoinWhileFramesRun) {
  Start(3);
  Client client = Connect();
  for (int frame = 0; frame < 4; ++frame) {
    SCOPED_TRACE(testing::Message() << "frame " << frame);
    const FrameRequest request = TestRequest(Splatting(), 45 * frame, 3);
    const RequestId id = client.Submit(request, seconds(60));
    service_->worker(frame).RequestStop();
    ASSERT_TRUE(service_->AddWorker().ok());
    const std::optional<AnsweredRequest> answered = NextPicture(client);
    ASSERT_TRUE(answered.has_value());
    EXPECT_EQ(answered->request, id);
    EXPECT_LE(LargestDifference(answered->picture.image, RenderDirectly(request, *volume_), request.size), AllowedDifference(request));
    service_->worker(frame).WaitUntilStopped();
  }
}

TEST_F(EmbeddedServiceTest, NothingVisibleIsAnEmptyPicture) {
  Start(2);
  Client client = Connect();
  for (const RendererKind* renderer : Renderers()) {
    if (!renderer->Can(Ability::kTransfer)) continue;
    FrameRequest request = TestRequest(renderer, 0);
    std::get<TransferFunction>(request.transfer.choice).opacities = {{0, 0, 0.5, 0}};
    const Result<Picture> picture = client.Render(request, seconds(60));
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_EQ(HighestAlpha(picture->image), 0);
  }
}

TEST_F(EmbeddedServiceTest, FailuresSayWhatWasWrong) {
  Start(1);
  Client client = Connect();
  FrameRequest request = TestRequest(Splatting(), 0);
  request.dataset = "nothing";
  Result<Picture> picture = client.Render(request);
  EXPECT_EQ(picture.status().code(), StatusCode::kNotFound);
  EXPECT_THAT(picture.status().message(), testing::AllOf(testing::HasSubstr("nothing"), testing::HasSubstr("ball")));
  request.dataset = "broken";
  picture = client.Render(request);
  EXPECT_EQ(picture.status().code(), StatusCode::kDataLoss);
  EXPECT_THAT(picture.status().message(), testing::HasSubstr("file ends early"));
  request.dataset = "ball";
  request.view.zoom = -1;
  picture = client.Render(request);
  EXPECT_EQ(picture.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(picture.status().message(), testing::HasSubstr("zoom"));
  ExpectRightPicture(client, TestRequest(Splatting(), 0));
}

TEST_F(EmbeddedServiceTest, ShutDownEndsServiceAndOpenRequests) {
  Start(2);
  const ClientTiming quick = {.ping = std::chrono::milliseconds(50), .silence = std::chrono::milliseconds(500)};
  Client client = Client::Connect(context_, service_->endpoint(), seconds(5), quick).value();
  ExpectRightPicture(client, TestRequest(ZBuffer(), 0));
  const Status status = client.ShutDownService();
  EXPECT_TRUE(status.ok()) << status.message();
  service_->worker(0).WaitUntilStopped();
  service_->worker(1).WaitUntilStopped();
  client.Submit(TestRequest(ZBuffer(), 0));
  const std::optional<ClientEvent> event = client.Next(seconds(60));
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(std::get<Status>(event->what).code(), StatusCode::kUnavailable);
}

TEST(EmbeddedServiceOptions, WorkerCountIsChecked) {
  Context context;
  EmbeddedOptions options;
  options.workers = 0;
  const auto started = EmbeddedService::Start(context, std::move(options));
  EXPECT_EQ(started.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(started.status().message(), testing::HasSubstr("[1, 256]"));
}

TEST(EmbeddedServiceOptions, ThreadCountIsChecked) {
  Context context;
  EmbeddedOptions options;
  for (const std::uint32_t threads : {0U, 1025U}) {
    options.worker.threads = threads;
    const auto started = EmbeddedService::Start(context, options);
    EXPECT_EQ(started.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(started.status().message(), testing::StrEq("threads " + std::to_string(threads) + " is out of range [1, 1024]"));
  }
}

}  // namespace
}  // namespace slabstream
