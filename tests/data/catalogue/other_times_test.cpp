// Range and histogram of sources with several times are those of all times.
#include "data/catalogue/other_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "data/catalogue/catalogue.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::SizeIs;

// Time t holds t everywhere, but for one voxel of 100 + t.
FileBytes Times(int count, const Index3& size) {
  FileBytes samples;
  for (int time = 0; time < count; ++time) {
    samples += FileBytes(CountIn(size) - 1, char(time)) + FileBytes(1, char(100 + time));
  }
  return samples;
}

class OtherTimesTest : public testing::Test {
 protected:
  std::string Write(const std::string& name, int times) const {
    const Index3 size = {6, 5, 4};
    WriteFile(directory_ / name,
              NiftiHeader({.type = SampleType::kUint8, .dimensions = {6, 5, 4, std::int16_t(times)}}) + Times(times, size));
    return directory_ / name;
  }
  VolumeSummary SummaryAt(const std::string& source) const {
    const Result<ReadableSource> read = ReadSource(DataSource(source, ""), 1U << 30);
    EXPECT_TRUE(read.ok()) << read.status().message();
    const LoadedSource& loaded = std::get<LoadedSource>(*read);
    return OverTimes(Summarize(*loaded.volume), loaded.other_times);
  }
  const TemporaryDirectory directory_;
};

TEST_F(OtherTimesTest, AVolumeThatShowsOneTimeHasTheRangeOfAll) {
  for (const int times : {2, 3, 7, 9}) {
    const VolumeSummary summary = SummaryAt(Write("v.nii", times));
    EXPECT_EQ(summary.range, (ValueRange{0, float(99 + times)})) << times;
    EXPECT_EQ(summary.times, times);
  }
}

TEST_F(OtherTimesTest, OfManyTimesSomeAreRead) {
  const VolumeSummary summary = SummaryAt(Write("v.nii", 50));
  EXPECT_EQ(summary.times, 1 + kMostOtherTimes);
  EXPECT_EQ(summary.range, (ValueRange{0, 149})) << "the first one and the last one among them";
}

TEST_F(OtherTimesTest, ATimeThatIsNamedStandsForItself) {
  const VolumeSummary summary = SummaryAt(Write("v.nii", 7) + "?time=3");
  EXPECT_EQ(summary.range, (ValueRange{3, 103}));
  EXPECT_EQ(summary.times, 1);
}

TEST_F(OtherTimesTest, WhereStatisticsAreKnownNothingElseIsRead) {
  DataSource source(Write("v.nii", 7) + "?time=3", "");
  source.statistics = std::make_shared<const VolumeSummary>(SummaryAt(Write("w.nii", 7)));
  const Result<ReadableSource> read = ReadSource(source, 1U << 30);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_THAT(std::get<LoadedSource>(*read).other_times, SizeIs(0));
}

}  // namespace
}  // namespace slabstream
