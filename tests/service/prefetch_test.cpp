// What a client says that it may show soon is on this host's disk when it asks for the picture.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <thread>

#include "client/embedded/embedded_service.h"
#include "data/stores/object_cache.h"
#include "data/zarr_writer/ome_zarr_writer.h"
#include "tests/data/sources/memory_source.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/service/pictures.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

class PrefetchTest : public testing::Test {
 protected:
  static constexpr std::int32_t kSide = 300, kChunk = 32;  // so large that opening it does not read level 0

  // Of the process, like the cache.
  static const TemporaryDirectory& CacheFolder() {
    static const TemporaryDirectory folder;
    return folder;
  }
  static void SetUpTestSuite() {
    ASSERT_EQ(setenv("XDG_CACHE_HOME", CacheFolder().path().c_str(), 1), 0);  // NOLINT(concurrency-mt-unsafe): no thread yet
    ASSERT_EQ(KeepObjects(std::uint64_t{64} << 20), Status::Ok());
  }

  void SetUp() override {
    OmeZarrOptions options;
    options.version = OmeZarrVersion::k04;  // a file is a chunk
    options.chunk_side = kChunk;
    options.shard_side = 2 * kChunk;
    const Status written =
        WriteOmeZarr(*MakeMemorySource(ball_, {.format = "NRRD", .file_type = "uint8"}), directory_ / "ball.zarr", options);
    ASSERT_TRUE(written.ok()) << written.message();
    EmbeddedOptions service;
    service.workers = 2;
    service.coordinator.catalogue["remote"] = DataSource(server_.url() + "/ball.zarr", "");
    service.coordinator.catalogue["held"] = [small = TestSphere(20)]() -> Result<std::shared_ptr<const Volume>> { return small; };
    service.coordinator.machine.memory_bytes = std::uint64_t{512} << 10;
    auto started = EmbeddedService::Start(context_, std::move(service));
    ASSERT_TRUE(started.ok()) << started.status().message();
    service_ = *std::move(started);
    client_.emplace(service_->Connect().value());
  }

  bool Prefetch(const FrameRequest& frame) {
    const RequestId asked = client_->Submit(Question(PrefetchQuery{.frame = frame}), seconds(60));
    while (true) {
      const std::optional<ClientEvent> event = client_->Next(seconds(60));
      if (!event || event->request != asked) ADD_FAILURE() << "no answer";
      if (const auto* failed = event ? std::get_if<Status>(&event->what) : nullptr) ADD_FAILURE() << failed->message();
      if (const auto* reply = event ? std::get_if<QuestionReply>(&event->what) : nullptr) return std::get<PrefetchReply>(*reply).fetches;
      if (HasFailure()) return false;
    }
  }

  // The chunks of level 0 that surely show something in the picture: x, y and z of the chunk.
  std::set<std::string> ShownChunks(const FrameRequest& frame) const {
    const Camera camera = MakeCamera(frame.view, frame.size, ball_->description.geometry);
    std::set<std::string> shown;
    for (std::int32_t z = 0; z < kSide; ++z) {
      for (std::int32_t y = 0; y < kSide; ++y) {
        for (std::int32_t x = 0; x < kSide; ++x) {
          const Camera::ImagePoint at = camera.Project({double(x), double(y), double(z)});
          if (at.x < 1 || at.y < 1 || at.x > camera.width - 1 || at.y > camera.height - 1) continue;
          shown.insert("/ball.zarr/0/" + std::to_string(z / kChunk) + "/" + std::to_string(y / kChunk) + "/" + std::to_string(x / kChunk));
        }
      }
    }
    return shown;
  }

  // By object: how often the server sent it.
  std::map<std::string, int> Sent() {
    const std::lock_guard lock(mutex_);
    return sent_;
  }
  // The disk gets what has come a little later, on another thread.
  void AwaitKept(std::size_t objects) const {
    const auto kept = [&] {
      std::size_t count = 0;
      std::error_code error;
      for (auto entry = fs::recursive_directory_iterator(CacheFolder().path(), error);
           !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
        count += entry->is_regular_file(error) ? 1 : 0;
      }
      return count;
    };
    for (const Time until = MonotonicNow() + seconds(60); kept() < objects;) {
      ASSERT_LT(MonotonicNow(), until) << kept() << " of " << objects << " objects are kept";
      std::this_thread::yield();
    }
  }

  const TemporaryDirectory directory_;
  const std::shared_ptr<const Volume> ball_ = TestSphere(kSide);
  std::mutex mutex_;  // guards the next one
  std::map<std::string, int> sent_;
  ScriptedServer server_{[this, serves = ServesFolder(directory_.path())](const ServerRequest& request) {
    std::string answer = serves(request);
    const std::string known = request.header("if-none-match");
    if (!known.empty() && answer.find(known) != std::string::npos) return AnswerText("304 Not Modified", "", "ETag: " + known + "\r\n");
    const std::lock_guard lock(mutex_);
    if (answer.starts_with("HTTP/1.1 2")) ++sent_[request.target];
    return answer;
  }};
  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

TEST_F(PrefetchTest, FetchesWhatAPictureWillShowOnce) {
  FrameRequest request = TestRequest(FindRenderer("raycast"), 30, 3);
  request.dataset = "remote";
  request.level = "0";
  request.view.zoom = 10;
  ASSERT_TRUE(Prefetch(request));
  const std::set<std::string> shown = ShownChunks(request);
  ASSERT_GT(shown.size(), 10U);
  for (const Time until = MonotonicNow() + seconds(60);;) {
    const std::map<std::string, int> sent = Sent();
    if (std::ranges::all_of(shown,
                            [&](const std::string& chunk) { return sent.contains(chunk) || !fs::exists(directory_.path() + chunk); }))
      break;
    ASSERT_LT(MonotonicNow(), until);
    ASSERT_TRUE(Prefetch(request)) << "a wish lasts for a second, so a slow machine needs several";
  }
  AwaitKept(std::size_t(std::ranges::count_if(shown, [&](const std::string& chunk) { return fs::exists(directory_.path() + chunk); })));
  const auto of_level = std::ranges::count_if(Sent(), [](const auto& sent) { return sent.first.starts_with("/ball.zarr/0/"); });
  EXPECT_LT(of_level, 500) << "of 1000 chunks";
  EXPECT_TRUE(Prefetch(request)) << "again, which fetches nothing";
  const Result<Picture> picture = client_->Render(request, seconds(60));
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *ball_), request.size), AllowedDifference(request));
  for (const auto& [object, times] : Sent()) {
    EXPECT_TRUE(times == 1 || !shown.contains(object)) << object << " was sent " << times << " times";
  }
}

TEST_F(PrefetchTest, VolumesInMemoryNeedNone) {
  FrameRequest request = TestRequest(FindRenderer("raycast"), 30);
  request.dataset = "held";
  EXPECT_FALSE(Prefetch(request));
}

TEST_F(PrefetchTest, WrongRequestsAreRefused) {
  FrameRequest request = TestRequest(FindRenderer("raycast"), 30);
  request.dataset = "nonesuch";
  const RequestId asked = client_->Submit(Question(PrefetchQuery{.frame = request}), seconds(60));
  const std::optional<ClientEvent> event = client_->Next(seconds(60));
  ASSERT_TRUE(event && event->request == asked);
  EXPECT_EQ(std::get<Status>(event->what).code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace slabstream
