// Files that change under whoever reads them: an error, or the voxels of one file, never of two.
#include "data/open/unchanged_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "data/open/open_source.h"
#include "tests/data/sources/memory_source.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using testing::Each;

constexpr Index3 kSize = {8, 6, 4};

class UnchangedSourceTest : public testing::Test {
 protected:
  // Raw samples of one value. The time of a file that is written twice within a tick of the clock would not tell.
  void Write(std::uint8_t value) {
    std::ofstream(path_, std::ios::binary) << "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 6 4\nencoding: raw\n\n"
                                           << std::string(CountIn(kSize), char(value));
    fs::last_write_time(path_, fs::file_time_type::clock::now() - std::chrono::hours(10 - ++written_));
  }
  Result<std::shared_ptr<VolumeSource>> Open() { return OpenSource(path_, {}, context_); }
  static Status ReadAll(VolumeSource& source, std::vector<std::uint8_t>& samples) {
    samples.assign(CountIn(kSize), 0);
    return source.ReadNow(0, {{0, 0, 0}, kSize}, std::as_writable_bytes(std::span(samples)));
  }

  TemporaryDirectory directory_;
  const std::string path_ = directory_ / "v.nrrd";
  int written_ = 0;
  const SourceContext context_ = TestReadContext();
};

TEST_F(UnchangedSourceTest, VoxelsOfAFileThatHasChangedAreNotRead) {
  Write(1);
  const std::shared_ptr<VolumeSource> source = Opened(Open());
  std::vector<std::uint8_t> samples;
  ASSERT_TRUE(ReadAll(*source, samples).ok());
  EXPECT_THAT(samples, Each(1));
  Write(2);
  EXPECT_EQ(ReadAll(*source, samples), Status::Unavailable(path_ + ": has changed since it was opened"));
  const std::shared_ptr<VolumeSource> again = Opened(Open());
  EXPECT_NE(again->info().version, source->info().version);
  ASSERT_TRUE(ReadAll(*again, samples).ok());
  EXPECT_THAT(samples, Each(2));
  // Whatever else is wrong with it then.
  fs::resize_file(path_, 70);
  EXPECT_EQ(ReadAll(*again, samples), Status::Unavailable(path_ + ": has changed since it was opened"));
  fs::remove(path_);
  EXPECT_EQ(ReadAll(*again, samples), Status::Unavailable(path_ + ": has changed since it was opened"));
}

TEST_F(UnchangedSourceTest, AFileThatIsReplacedWhileItIsOpenedIsOpenedAgain) {
  Write(1);
  int opened = 0;
  const auto source = Opened(OpenUnchanged(path_, [&] {
    auto first = Open();
    if (++opened == 1) Write(2);
    return first;
  }));
  EXPECT_GT(opened, 1);
  std::vector<std::uint8_t> samples;
  ASSERT_TRUE(ReadAll(*source, samples).ok());
  EXPECT_THAT(samples, Each(2));
  EXPECT_EQ(source->info().version, Opened(Open())->info().version);
}

TEST_F(UnchangedSourceTest, AFileThatChangesAllTheTimeIsNotRead) {
  Write(1);
  const auto source = OpenUnchanged(path_, [&] {
    auto open = Open();
    Write(std::uint8_t(1 + written_ % 5));
    return open;
  });
  std::vector<std::uint8_t> samples;
  if (source.ok()) {
    EXPECT_EQ(ReadAll(**source, samples), Status::Unavailable(path_ + ": has changed since it was opened"));
  }
}

TEST_F(UnchangedSourceTest, TheVersionIsThatOfSizesAndTimes) {
  Write(1);
  const std::uint64_t version = VersionOf({path_}).value();
  EXPECT_EQ(Opened(Open())->info().version, version);
  fs::last_write_time(path_, fs::last_write_time(path_) + std::chrono::seconds(1));
  EXPECT_NE(VersionOf({path_}).value(), version);
  EXPECT_EQ(VersionOf({path_ + "x"}).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace slabstream
