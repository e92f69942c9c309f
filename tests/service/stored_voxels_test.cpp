// Voxels that a worker reads itself: where it finds the files, and once it does.
#include "worker/service/stored_voxels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <thread>

#include "data/open/open_source.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/data/zarr/zarr_files.h"
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
  WorkerEvent Read(Time now) {
    std::promise<WorkerEvent> read;
    std::future<WorkerEvent> event = read.get_future();
    reads_ = std::move(read);
    while (!Begin(now)) std::this_thread::yield();
    return event.get();
  }
  bool Begin(Time now) {
    SendChunkRequest wanted{kPadded, request_, std::make_shared<const StoredAt>(stored_)};
    return voxels_.Read(wanted, box_, now);
  }
  static bool Refused(const WorkerEvent& event) {
    const auto* message = std::get_if<MessageReceived>(&event);
    return message != nullptr && std::holds_alternative<ChunkRefused>(message->message);
  }

  const TemporaryDirectory directory_;
  const std::string path_ = directory_ / "v.nrrd", elsewhere_ = directory_ / "elsewhere";
  static inline const BoxKey kPadded{.dataset = 3, .box = {{0, 0, 0}, kSize}, .types = ScalarType::kUint8, .generation = 1};
  const std::shared_ptr<StoredBox> box_ = std::make_shared<StoredBox>(kPadded, std::vector<StoredBox::Copy>(), true);
  const ChunkRequest request_{.epoch = 1, .worker = 2, .dataset = 3, .box = {{0, 0, 0}, kSize}};
  StoredAt stored_;
  std::promise<WorkerEvent> reads_;
  StoredVoxels voxels_{[this](WorkerEvent event) { reads_.set_value(std::move(event)); }};
};

TEST_F(StoredVoxelsTest, AreReadOnceTheFilesAreSeen) {
  fs::rename(path_, elsewhere_);
  const Time now = Time{} + std::chrono::hours(1);
  EXPECT_FALSE(Begin(now));
  fs::rename(elsewhere_, path_);
  const WorkerEvent event = Read(now + StoredVoxels::kLookAgain);
  ASSERT_TRUE(std::holds_alternative<ChunkStored>(event));
  EXPECT_EQ(*box_->RoomFor(kPadded.box)->first, std::byte{7});
}

TEST_F(StoredVoxelsTest, WhatCannotBeReadAnyMoreIsLeftToTheCoordinatorUntilItIsSeenAgain) {
  const Time now = Time{} + std::chrono::hours(1);
  EXPECT_TRUE(std::holds_alternative<ChunkStored>(Read(now)));
  fs::rename(path_, elsewhere_);
  EXPECT_TRUE(Refused(Read(now)));
  EXPECT_FALSE(Begin(now));
  fs::rename(elsewhere_, path_);
  EXPECT_TRUE(std::holds_alternative<ChunkStored>(Read(now + StoredVoxels::kLookAgain)));
}

TEST_F(StoredVoxelsTest, OtherTimesBehindAnAddressAreReadAtOnce) {
  const ZarrSpec spec{.shape = {20, 4, 6, 8}, .chunk = {1, 4, 6, 8}, .type = SampleType::kUint8};
  WriteZarrArray(directory_ / "a.zarr", spec, [](std::span<const std::uint64_t> at) { return double(10 + at[0]); });
  const ScriptedServer server(ServesFolder(directory_.path()));
  const std::string url = server.url() + "/a.zarr";
  const auto source = OpenSource(url, {.describe = true}, std::make_shared<ReadContext>(ReadContext::Limits{})).value();
  const auto show = [&](int time) {
    stored_ = {AtTime(url, time), 0, source->info().version, {{0, 0, 0}, source->info().levels.front().block}};
  };
  Time now = Time{} + std::chrono::hours(1);
  show(0);
  EXPECT_TRUE(std::holds_alternative<ChunkStored>(Read(now)));
  const auto chunks = [&] {
    return std::ranges::count_if(server.requests(), [](const ServerRequest& each) { return NamesChunk(each.target); });
  };
  EXPECT_EQ(chunks(), 1);
  const auto opened = server.requests().size();
  for (const int time : {7, 19, 3}) {
    show(time);
    now += std::chrono::seconds(1);
    std::promise<WorkerEvent> read;
    std::future<WorkerEvent> event = read.get_future();
    reads_ = std::move(read);
    EXPECT_TRUE(Begin(now)) << "the coordinator is not asked";
    ASSERT_TRUE(std::holds_alternative<ChunkStored>(event.get()));
    EXPECT_EQ(*box_->RoomFor(kPadded.box)->first, std::byte(10 + time));
  }
  EXPECT_EQ(chunks(), 1 + 3) << "a chunk each";
  // Of those that were on their way, no more than an opening makes.
  EXPECT_LT(server.requests().size(), 2 * opened);
}

}  // namespace
}  // namespace slabstream
