// Stores to which times come.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "data/catalogue/catalogue.h"
#include "data/stores/watched_object.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kSide = 4;

class GrowingStoreTest : public testing::Test {
 protected:
  void Write(int version, std::uint64_t times, bool consolidated = false) const {
    const Json scale = {{"type", "scale"}, {"scale", {1, 1, 1, 1}}};
    Json image = {{"axes", Json::array()},
                  {"datasets", Json::array({{{"path", "0"}, {"coordinateTransformations", Json::array({scale})}}})}};
    for (const char* const axis : {"t", "z", "y", "x"})
      image["axes"].push_back({{"name", axis}, {"type", *axis == 't' ? "time" : "space"}});
    Json attributes = {{"multiscales", Json::array({image})}, {"version", version == 2 ? "0.4" : "0.5"}};
    if (version == 3) attributes = {{"ome", attributes}};
    WriteZarrGroup(folder_ / "a.zarr", version, attributes);
    const ZarrSpec spec{.version = version, .shape = {times, kSide, kSide, kSide}, .chunk = {1, kSide, kSide, kSide}, .separator = '/'};
    WriteZarrArray(folder_ / "a.zarr/0", spec, [](std::span<const std::uint64_t> at) { return double(10 + at[0]); });
    if (!consolidated) return;
    WriteJson(folder_ / "a.zarr/.zmetadata",
              {{"zarr_consolidated_format", 1},
               {"metadata", {{".zattrs", attributes}, {".zgroup", {{"zarr_format", 2}}}, {"0/.zarray", MetadataOf(spec)}}}});
  }
  // N5 counts x first, and blocks are big endian.
  void WriteN5(std::uint64_t times) const {
    WriteJson(folder_ / "a.n5/attributes.json", {{"n5", "2.5.1"}});
    WriteJson(folder_ / "a.n5/s0/attributes.json", {{"dimensions", {kSide, kSide, kSide, times}},
                                                    {"blockSize", {kSide, kSide, kSide, 1}},
                                                    {"dataType", "uint16"},
                                                    {"compression", {{"type", "raw"}}},
                                                    {"axes", {"x", "y", "z", "t"}}});
    for (std::uint64_t time = 0; time < times; ++time) {
      std::string block = {0, 0, 0, 4};
      for (const std::uint64_t along : {kSide, kSide, kSide, std::uint64_t{1}}) block += {0, 0, 0, char(along)};
      for (std::uint64_t voxel = 0; voxel < kSide * kSide * kSide; ++voxel) block += {0, char(10 + time)};
      WriteFile(folder_ / ("a.n5/s0/0/0/0/" + std::to_string(time)), block);
    }
  }
  static LoadedSource Read(const std::string& source) {
    const Result<ReadableSource> read = ReadSource(DataSource(source, ""), 1U << 30);
    EXPECT_TRUE(read.ok()) << read.status().message();
    return std::get<LoadedSource>(*read);
  }
  // Requests that ask whether an object is still the one that is known.
  static std::vector<ServerRequest> LooksAt(const ScriptedServer& server) {
    std::vector<ServerRequest> looks = server.requests();
    std::erase_if(looks, [](const ServerRequest& request) { return request.header("if-none-match").empty(); });
    return looks;
  }
  const TemporaryDirectory folder_;
};

TEST_F(GrowingStoreTest, TimesThatComeToAFolderAreSeen) {
  for (const int version : {2, 3}) {
    Write(version, 2);
    const LoadedSource two = Read(folder_ / "a.zarr");
    EXPECT_EQ(two.file.times.count, 2);
    EXPECT_EQ(HaveChanged(*two.stamp).value(), false);
    Write(version, 3);
    EXPECT_EQ(HaveChanged(*two.stamp).value(), true);
    EXPECT_EQ(Read(folder_ / "a.zarr").file.times.count, 3);
    std::filesystem::remove_all(folder_ / "a.zarr");
  }
}

TEST_F(GrowingStoreTest, BehindAnAddressItIsLookedAtFromTimeToTime) {
  struct Case {
    std::string store, object;  // whose change tells of growth
    std::function<void(std::uint64_t times)> write;
  };
  const auto zarr = [this](int version, bool consolidated) {
    return [=, this](std::uint64_t times) { Write(version, times, consolidated); };
  };
  const Case cases[] = {{"/a.zarr", "/0/.zarray", zarr(2, false)},
                        {"/a.zarr", "/.zmetadata", zarr(2, true)},
                        {"/a.zarr", "/0/zarr.json", zarr(3, false)},
                        {"/a.n5", "/s0/attributes.json", [this](std::uint64_t times) { WriteN5(times); }}};
  const ScriptedServer server(ServesFolder(folder_.path()));
  for (const auto& [store, object, write] : cases) {
    SCOPED_TRACE(store + object);
    write(2);
    const LoadedSource two = Read(server.url() + store);
    EXPECT_EQ(two.file.times.count, 2);
    const Time opened = MonotonicNow();
    std::size_t looks = LooksAt(server).size();
    EXPECT_EQ(HaveChanged(*two.stamp, opened).value(), false);
    EXPECT_EQ(LooksAt(server).size(), looks) << "it was read just now";
    EXPECT_EQ(HaveChanged(*two.stamp, opened + kLookAgain).value(), false);
    ASSERT_EQ(LooksAt(server).size(), ++looks);
    EXPECT_EQ(LooksAt(server).back().target, store + object);
    write(3);
    EXPECT_EQ(HaveChanged(*two.stamp, opened + kLookAgain).value(), false);
    EXPECT_EQ(LooksAt(server).size(), looks) << "it was looked at just now";
    EXPECT_EQ(HaveChanged(*two.stamp, opened + 2 * kLookAgain).value(), true);
    const LoadedSource three = Read(server.url() + store);
    EXPECT_EQ(three.file.times.count, 3);
    EXPECT_NE(three.file.version, two.file.version) << "a chunk that was not there may be there now";
    std::filesystem::remove_all(folder_.path() + store);
  }
}

TEST_F(GrowingStoreTest, AServerThatFailsSaysNothingOfAChange) {
  bool fails = false;
  const ScriptedServer::Script serves = ServesFolder(folder_.path());
  const ScriptedServer server([&](const ServerRequest& request) { return fails ? AnswerText("400 Bad Request", "") : serves(request); });
  Write(2, 2);
  const LoadedSource two = Read(server.url() + "/a.zarr");
  fails = true;
  EXPECT_EQ(HaveChanged(*two.stamp, MonotonicNow() + kLookAgain).value(), false);
  fails = false;
  std::filesystem::remove_all(folder_ / "a.zarr");
  EXPECT_EQ(HaveChanged(*two.stamp, MonotonicNow() + 3 * kLookAgain).value(), true) << "it is gone";
}

TEST_F(GrowingStoreTest, ATimeThatIsNamedIsNotFollowed) {
  const ScriptedServer server(ServesFolder(folder_.path()));
  Write(3, 2);
  const LoadedSource second = Read(server.url() + "/a.zarr?time=1");
  EXPECT_EQ(HaveChanged(*second.stamp, MonotonicNow() + kLookAgain).value(), false);
  EXPECT_TRUE(LooksAt(server).empty());
}

// Other times are surveyed and read by what is open.
TEST_F(GrowingStoreTest, OtherTimesAreReadByWhatIsOpen) {
  const ScriptedServer server(ServesFolder(folder_.path()));
  Write(2, 5);
  const LoadedSource first = Read(server.url() + "/a.zarr");
  EXPECT_EQ(first.other_times.size(), 2U);
  ASSERT_NE(first.source, nullptr);
  const auto chunks = [&] {
    return std::ranges::count_if(server.requests(), [](const ServerRequest& each) { return NamesChunk(each.target); });
  };
  const auto before = chunks();
  DataSource fourth(server.url() + "/a.zarr?time=3", "");
  fourth.beside = first.source;
  fourth.statistics = std::make_shared<const VolumeSummary>(Summarize(*first.volume));
  const Result<ReadableSource> read = ReadSource(fourth, 1U << 30);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(std::get<LoadedSource>(*read).volume->block.samples<std::uint16_t>()[0], 13);
  EXPECT_EQ(chunks(), before + 1) << "its chunk";
  EXPECT_EQ(std::ranges::count(server.requests(), "/a.zarr/0/.zarray", &ServerRequest::target), 1) << "it is not opened again";
}

}  // namespace
}  // namespace slabstream
