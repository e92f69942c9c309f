// Stores that misbehave: a frame ends as the right picture or as one error that names object and cause, other datasets go on, and after a
// repair the next request works.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>

#include "client/embedded/embedded_service.h"
#include "tests/data/sources/memory_source.h"
#include "tests/service/pictures.h"
#include "tests/service/small_shards.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using testing::AllOf;
using testing::HasSubstr;

// A source whose reads fail or wait as a test says.
class FaultySource : public VolumeSource {
 public:
  explicit FaultySource(const std::shared_ptr<const Volume>& volume)
      : source_(MakeMemorySource(volume, {.format = "test", .file_type = "uint8"})) {}

  const SourceInfo& info() const override { return source_->info(); }
  Counts counts() const override { return {}; }
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    std::unique_lock lock(mutex_);
    if (failing_ > 0) {
      --failing_;
      lock.unlock();
      return done(Status::Unavailable("/store/volume/c/1: cannot be read: Input/output error"));
    }
    const auto read = [source = source_, level, box, out, stop, done] { source->Read(level, box, out, stop, done); };
    if (!holds_) {
      lock.unlock();
      return read();
    }
    waiting_.emplace_back(read);
    more_wait_.notify_all();
  }

  void FailReads(int count) {
    const std::lock_guard lock(mutex_);
    failing_ = count;
  }
  void Hold() {
    const std::lock_guard lock(mutex_);
    holds_ = true;
  }
  void AwaitHeld(std::size_t reads) {
    std::unique_lock lock(mutex_);
    more_wait_.wait(lock, [&] { return waiting_.size() >= reads; });
  }
  void Release() {
    std::vector<std::function<void()>> waiting;
    {
      const std::lock_guard lock(mutex_);
      holds_ = false;
      waiting.swap(waiting_);
    }
    for (const auto& read : waiting) read();
  }

 private:
  const std::shared_ptr<VolumeSource> source_;
  std::mutex mutex_;  // guards what follows
  int failing_ = 0;
  bool holds_ = false;
  std::vector<std::function<void()>> waiting_;
  std::condition_variable more_wait_;
};

class BadStoresTest : public testing::Test {
 protected:
  // No worker finds the store, so the coordinator reads.
  static DataSource InParts(const std::shared_ptr<FaultySource>& source, const std::shared_ptr<const Volume>& volume) {
    DataSource data;
    data.at_level = std::make_shared<const SourceAtLevel>(
        SourceAtLevel{.source = source,
                      .surveyed = std::make_shared<const VolumeSummary>(Summarize(*volume)),
                      .stored = {"/store/volume", 0, 1, {{0, 0, 0}, source->info().levels.front().block}},
                      .stamp = nullptr});
    return data;
  }
  void Start(Catalogue catalogue, int workers = 1) {
    EmbeddedOptions options;
    options.workers = workers;
    options.coordinator.catalogue = std::move(catalogue);
    options.coordinator.machine.memory_bytes = std::uint64_t{512} << 10;  // it holds no volume of these tests
    options.worker.credit_bytes = std::uint64_t{64} << 20;
    auto started = EmbeddedService::Start(context_, std::move(options));
    ASSERT_TRUE(started.ok()) << started.status().message();
    service_ = std::move(*started);
    client_.emplace(service_->Connect().value());
  }
  std::string Zarr() const {
    const std::string path = directory_ / "ball.ome.zarr";
    WriteSmallShards(ball_, path);
    return path;
  }
  static FrameRequest Request(const std::string& dataset = "ball") {
    FrameRequest request = TestRequest(Splatting(), 30);
    request.dataset = dataset;
    request.level = "0";
    return request;
  }
  Result<Picture> Render(const FrameRequest& request, Duration deadline = seconds(60)) { return client_->Render(request, deadline); }
  static void ExpectPictureOf(const Volume& volume, const FrameRequest& request, const Result<Picture>& picture) {
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    EXPECT_GT(HighestAlpha(picture->image), 0.1);
    EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, volume), request.size), AllowedDifference(request));
  }
  void ExpectPictureOf(const Volume& volume, const FrameRequest& request = Request()) { ExpectPictureOf(volume, request, Render(request)); }
  static void ExpectOneLine(const Status& status, const auto& says) {
    EXPECT_FALSE(status.ok());
    EXPECT_THAT(status.message(), says);
    EXPECT_EQ(std::ranges::count(status.message(), '\n'), 0);
  }

  const TemporaryDirectory directory_;
  const std::shared_ptr<const Volume> ball_ = TestSphere(100);
  const std::shared_ptr<FaultySource> source_ = std::make_shared<FaultySource>(ball_);
  Context context_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

TEST_F(BadStoresTest, AReadThatFailsOnceCostsNoPicture) {
  Start({{"ball", InParts(source_, ball_)}}, 2);
  source_->FailReads(1);
  ExpectPictureOf(*ball_);
}

TEST_F(BadStoresTest, ReadsThatFailEndTheFrameAndTheNextOneWorksAfterARepair) {
  Start({{"ball", InParts(source_, ball_)}}, 2);
  source_->FailReads(std::numeric_limits<int>::max());
  ExpectOneLine(Render(Request()).status(), AllOf(HasSubstr("/store/volume/c/1"), HasSubstr("Input/output error")));
  source_->FailReads(0);
  ExpectPictureOf(*ball_);
}

// As many reads are held as the coordinator has under way at a time.
TEST_F(BadStoresTest, AStoreThatDoesNotAnswerHoldsUpItsOwnDatasetAlone) {
  const std::shared_ptr<const Volume> large = TestSphere(300);  // some 30 chunks for each worker
  const auto silent = std::make_shared<FaultySource>(large);
  Start({{"ball", InParts(source_, ball_)}, {"silent", InParts(silent, large)}}, 2);
  silent->Hold();
  FrameRequest request = Request("silent");
  request.policy.groups = 1;
  const RequestId waits = client_->Submit(request, seconds(120));
  silent->AwaitHeld(32);
  Client other = service_->Connect().value();
  ExpectPictureOf(*ball_, Request(), other.Render(Request(), seconds(60)));
  silent->Release();
  while (const auto event = client_->Next(seconds(60))) {
    if (event->request != waits || std::holds_alternative<FrameProgress>(event->what)) continue;
    const auto* const picture = std::get_if<Picture>(&event->what);
    ASSERT_NE(picture, nullptr) << std::get<Status>(event->what).message();
    return ExpectPictureOf(*large, request, *picture);
  }
  ADD_FAILURE() << "no picture";
}

TEST_F(BadStoresTest, ReadsThatNeverEndEndTheFrameAtItsDeadline) {
  Start({{"ball", InParts(source_, ball_)}});
  source_->Hold();
  EXPECT_EQ(Render(Request(), seconds(1)).status().code(), StatusCode::kDeadlineExceeded);
  source_->Release();
  ExpectPictureOf(*ball_);
}

// ---------------------------------------------------------------- files, which workers read themselves

TEST_F(BadStoresTest, DamagedObjectsAreNamedAndReadAgainAfterARepair) {
  const std::string path = Zarr(), object = path + "/0/c/1/1/1", kept = directory_ / "kept";
  fs::copy_file(object, kept);
  const std::uintmax_t size = fs::file_size(object);
  const std::vector<std::pair<std::string, std::function<void()>>> damages = {
      {"short", [&] { fs::resize_file(object, size / 2); }},
      {"empty", [&] { fs::resize_file(object, 0); }},
      {"long", [&] { std::ofstream(object, std::ios::binary | std::ios::app) << "more"; }},
      {"other bytes",
       [&] {
         std::fstream file(object, std::ios::binary | std::ios::in | std::ios::out);
         for (std::uintmax_t at = 3; at < size; at += 5) file.seekp(std::streamoff(at)).put('x');
       }},
      {"a pipe",
       [&] {
         fs::remove(object);
         ASSERT_EQ(::mkfifo(object.c_str(), 0600), 0);
       }},
      {"a link out of the folder",
       [&] {
         fs::remove(object);
         fs::create_symlink(kept, object);
       }},
  };
  int errors = 0;
  for (const auto& [kind, damage] : damages) {
    SCOPED_TRACE(kind);
    Start({{"ball", DataSource(path, "")}}, 2);
    ASSERT_TRUE(client_->Summarize({.dataset = "ball"}).ok()) << "it is open, and nothing is wrong so far";
    damage();
    const Result<Picture> picture = Render(Request());
    if (picture.ok()) {  // what was read before
      ExpectPictureOf(*ball_, Request(), picture);
    } else {
      ExpectOneLine(picture.status(), HasSubstr("ball.ome.zarr/0/c/1/1/1"));
      ++errors;
    }
    // At once: a worker may still be reading for the frame that failed, and a missing object has the fill value.
    fs::copy_file(kept, directory_ / "whole");
    fs::rename(directory_ / "whole", object);
    ExpectPictureOf(*ball_);
  }
  EXPECT_GT(errors, 0);
}

TEST_F(BadStoresTest, AMissingObjectHasTheFillValue) {
  const std::string path = Zarr();
  fs::remove(path + "/0/c/1/1/1");
  auto altered = std::make_shared<Volume>();
  altered->description = ball_->description;
  altered->block = MakeVoxelBlock(ball_->block.box, ball_->block.type);
  altered->block.bytes = ball_->block.bytes;
  for (std::int32_t z = 32; z < 64; ++z) {
    for (std::int32_t y = 32; y < 64; ++y) {
      for (std::int32_t x = 32; x < 64; ++x) altered->block.samples<std::uint8_t>()[altered->block.Offset({x, y, z})] = 0;
    }
  }
  Start({{"ball", DataSource(path, "")}}, 2);
  ExpectPictureOf(*altered);
}

// Metadata that come last tell of a store that is written anew; a folder that is not there any more is no volume of fill values.
TEST_F(BadStoresTest, AStoreThatIsReplacedOrGoneIsAnErrorOrTheNewPicture) {
  const std::string path = Zarr();
  Start({{"ball", DataSource(path, "")}}, 2);
  ASSERT_TRUE(client_->Summarize({.dataset = "ball"}).ok());
  fs::rename(path, directory_ / "elsewhere");
  ExpectOneLine(Render(Request()).status(), HasSubstr("ball.ome.zarr"));
  fs::rename(directory_ / "elsewhere", path);
  ExpectPictureOf(*ball_);
}

}  // namespace
}  // namespace slabstream
