// Voxels that a worker reads itself: where it finds the files, and once it does.
#include "worker/stored_voxels.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <thread>

#include "data/open/open_source.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

class StoredVoxelsTest : public testing::Test {
 protected:
  static constexpr Index3 kSize = {8, 6, 4};
  StoredVoxelsTest() {
    std::ofstream(path_, std::ios::binary) << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 6 4\nencoding: raw\n\n"
                                           << std::string(CountIn(kSize), char(7));
    const auto source = OpenSource(path_, {}, std::make_shared<ReadContext>(ReadContext::Limits{})).value();
    stored_ = {path_, 0, source->info().version, {{0, 0, 0}, source->info().levels.front().block}};
  }
  // Once it reads there. Looks end on another thread.
  MessageReceived Read(Time now) {
    std::promise<MessageReceived> read;
    std::future<MessageReceived> message = read.get_future();
    reads_ = std::move(read);
    while (!voxels_.Read(request_, stored_, now)) std::this_thread::yield();
    return message.get();
  }

  const TemporaryDirectory directory_;
  const std::string path_ = directory_ / "v.nrrd", elsewhere_ = directory_ / "elsewhere";
  const ChunkRequest request_{.epoch = 1, .worker = 2, .dataset = 3, .box = {{0, 0, 0}, kSize}};
  StoredAt stored_;
  std::promise<MessageReceived> reads_;
  StoredVoxels voxels_{[this](MessageReceived message) { reads_.set_value(std::move(message)); }};
};

TEST_F(StoredVoxelsTest, AreReadOnceTheFilesAreSeen) {
  fs::rename(path_, elsewhere_);
  const Time now = Time{} + std::chrono::hours(1);
  EXPECT_FALSE(voxels_.Read(request_, stored_, now));
  fs::rename(elsewhere_, path_);
  const MessageReceived message = Read(now + StoredVoxels::kLookAgain);
  ASSERT_TRUE(std::holds_alternative<Chunk>(message.message));
  EXPECT_EQ(message.payload.size(), CountIn(kSize));
}

TEST_F(StoredVoxelsTest, WhatCannotBeReadAnyMoreIsLeftToTheCoordinatorUntilItIsSeenAgain) {
  const Time now = Time{} + std::chrono::hours(1);
  EXPECT_TRUE(std::holds_alternative<Chunk>(Read(now).message));
  fs::rename(path_, elsewhere_);
  EXPECT_TRUE(std::holds_alternative<ChunkRefused>(Read(now).message));
  EXPECT_FALSE(voxels_.Read(request_, stored_, now));
  fs::rename(elsewhere_, path_);
  EXPECT_TRUE(std::holds_alternative<Chunk>(Read(now + StoredVoxels::kLookAgain).message));
}

}  // namespace
}  // namespace slabstream
