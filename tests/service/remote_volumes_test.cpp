// A service of a volume behind a web server: pictures are those of the voxels, and a server that fails holds up nobody else.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <semaphore>
#include <string>

#include "client/embedded/embedded_service.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/service/pictures.h"
#include "tests/service/small_shards.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

class RemoteVolumesTest : public testing::Test {
 protected:
  void SetUp() override {
    WriteSmallShards(ball_, directory_ / "ball.zarr");
    const ScriptedServer::Script serves = ServesFolder(directory_.path());
    server_ = std::make_unique<ScriptedServer>([this, serves](const ServerRequest& request) {
      if (silent_ && request.target.find("/c/") != std::string::npos) {
        held_.release();
        ended_.wait();
      }
      return broken_ ? AnswerText("403 Forbidden", "") : serves(request);
    });
    EmbeddedOptions service;
    service.workers = 2;
    service.coordinator.catalogue["remote"] = DataSource(server_->url() + "/ball.zarr", "");
    for (int i = 0; i < kMore; ++i) service.coordinator.catalogue[fmt::format("remote{}", i)] = {server_->url() + "/ball.zarr", ""};
    service.coordinator.catalogue["local"] = DataSource(directory_ / "ball.zarr", "");
    service.coordinator.catalogue["small"] = [small = small_]() -> Result<std::shared_ptr<const Volume>> { return small; };
    service.coordinator.machine.memory_bytes = std::uint64_t{512} << 10;  // no level of the ball but perhaps the coarsest ones
    auto started = EmbeddedService::Start(context_, std::move(service));
    ASSERT_TRUE(started.ok()) << started.status().message();
    service_ = *std::move(started);
    client_.emplace(service_->Connect().value());
  }
  void TearDown() override {
    if (silent_) end_.set_value();
  }
  Result<Picture> Render(const std::string& dataset) {
    FrameRequest request = request_;
    request.dataset = dataset;
    return client_->Render(request, seconds(60));
  }
  void ExpectPicture(const std::string& dataset, const Volume& volume) {
    const Result<Picture> picture = Render(dataset);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_GT(HighestAlpha(picture->image), 0.1);
    EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request_, volume), request_.size), AllowedDifference(request_));
  }

  const TemporaryDirectory directory_;
  const std::shared_ptr<const Volume> ball_ = TestSphere(100), small_ = TestSphere(20);
  const FrameRequest request_ = [] {
    FrameRequest request = TestRequest(FindRenderer("raycast"), 30, 3);
    request.level = "0";
    return request;
  }();
  static constexpr int kMore = 4;  // datasets of the same server
  std::atomic<bool> broken_ = false, silent_ = false;
  std::counting_semaphore<> held_{0};  // requests that are not answered
  std::promise<void> end_;
  const std::shared_future<void> ended_{end_.get_future()};
  std::unique_ptr<ScriptedServer> server_;
  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

TEST_F(RemoteVolumesTest, PicturesAreThoseOfTheVoxels) { ExpectPicture("remote", *ball_); }

TEST_F(RemoteVolumesTest, AServerThatFailsIsNamedAndIsUsedAgainWhenItIsBack) {
  broken_ = true;
  const Status failed = Render("remote").status();
  EXPECT_EQ(failed.code(), StatusCode::kUnavailable);
  EXPECT_THAT(failed.message(), HasSubstr(server_->url() + "/ball.zarr"));
  EXPECT_THAT(failed.message(), HasSubstr("HTTP 403"));
  ExpectPicture("small", *small_);
  broken_ = false;
  ExpectPicture("remote", *ball_);
}

// All that may wait for voxels does. The file is read all the same, before the server counts as silent.
TEST_F(RemoteVolumesTest, AServerThatDoesNotAnswerHoldsUpNoFile) {
  silent_ = true;
  Client other = service_->Connect().value();
  FrameRequest request = request_;
  for (int i = 0; i < kMore; ++i) {
    request.dataset = fmt::format("remote{}", i);
    other.Submit(request, seconds(120));
  }
  for (std::size_t i = 0; i < kMore; ++i) held_.acquire();
  ExpectPicture("local", *ball_);
  while (const auto event = other.Next(seconds(0))) {
    EXPECT_TRUE(std::holds_alternative<FrameProgress>(event->what)) << "the server was silent for too long, or the file waited for it";
  }
}

}  // namespace
}  // namespace slabstream
