#include "data/survey/survey.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <numeric>

#include "tests/data/sources/memory_source.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::shared_ptr<const Volume> SomeVolume(Random& random, const Index3& size, ScalarType type) {
  auto volume = std::make_shared<Volume>(RandomVolume(random, size, type));
  volume->description.mapping = {0.5, -7};
  return volume;
}

TEST(SurveyTest, OfWhatIsNotLargeIsThatOfAllItsVoxels) {
  Random random(41);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    for (const Index3& size : {Index3{1, 1, 1}, Index3{150, 70, 33}, Index3{17, 400, 65}}) {
      const std::shared_ptr<const Volume> volume = SomeVolume(random, size, type);
      std::vector<int> percents;
      ReadProgress progress([&](const ReadShare& read) { percents.push_back(read.percent); });
      const Result<Survey> survey = SurveySource(*MakeMemorySource(volume, {}), {}, &progress);
      ASSERT_TRUE(survey.ok()) << survey.status().message();
      EXPECT_EQ(survey->level, 0);
      EXPECT_EQ(*survey->summary, Summarize(*volume));
      EXPECT_TRUE(std::ranges::is_sorted(percents));
      EXPECT_EQ(percents.back(), 100);
    }
  }
}

// Levels of any size whose samples are computed: x of the voxel, in units of the finest level. Counts what is read.
class ComputedSource : public VolumeSource {
 public:
  ComputedSource(const std::vector<Index3>& sizes, const Index3& block) {
    for (const Index3& size : sizes) {
      const double spacing = double(sizes[0].x) / size.x;
      info_.levels.push_back({{.geometry = {size, {spacing, spacing, spacing}}, .type = ScalarType::kUint16}, Min(block, size)});
    }
    read_.resize(sizes.size());
  }
  const SourceInfo& info() const override { return info_; }
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token, ReadDone done) override {
    const std::lock_guard lock(mutex_);
    read_[std::size_t(level)] += box.voxel_count();
    for (const Axis axis : kAxes) starts_at_blocks_ &= box.begin[axis] % info_.levels[std::size_t(level)].block[axis] == 0;
    if (fails_) return done(Status::DataLoss("1/0: damaged"));
    const int step = info_.levels[0].description.geometry.size.x / info_.levels[std::size_t(level)].description.geometry.size.x;
    auto* const samples = reinterpret_cast<std::uint16_t*>(out.first);
    const std::int32_t row = box.size().x;
    for (std::int64_t i = 0; i < box.voxel_count(); ++i) samples[i] = std::uint16_t((box.begin.x + std::int32_t(i % row)) * step);
    done(Status::Ok());
  }
  Counts counts() const override { return {}; }

  const std::vector<std::int64_t>& voxels_read() const { return read_; }
  bool starts_at_blocks() const { return starts_at_blocks_; }
  void Fail() { fails_ = true; }

 private:
  SourceInfo info_;
  std::mutex mutex_;  // guards what follows
  std::vector<std::int64_t> read_;
  bool starts_at_blocks_ = true, fails_ = false;
};

TEST(SurveyTest, OfALargeVolumeIsThatOfACoarseLevel) {
  ComputedSource source({{2048, 2048, 2048}, {1024, 1024, 1024}, {256, 256, 256}, {64, 64, 64}}, {128, 128, 128});
  const Result<Survey> survey = SurveySource(source);
  ASSERT_TRUE(survey.ok()) << survey.status().message();
  EXPECT_EQ(survey->level, 2) << "the finest one that is not large";
  EXPECT_THAT(source.voxels_read(), ElementsAre(0, 0, 256 * 256 * 256, 0));
  EXPECT_EQ(survey->summary->description, source.info().levels[2].description);
  EXPECT_EQ(survey->summary->range, (ValueRange{0, 255 * 8}));
  EXPECT_EQ(survey->summary->bricks[3], (ValueRange{3 * 16 * 8, (4 * 16 - 1) * 8}));
}

TEST(SurveyTest, OfALargeVolumeWithoutLevelsIsThatOfASample) {
  ComputedSource source({{1024, 1024, 1024}}, {128, 128, 16});
  const Result<Survey> survey = SurveySource(source);
  ASSERT_TRUE(survey.ok()) << survey.status().message();
  const std::int64_t bytes = 2 * source.voxels_read()[0];
  EXPECT_GT(bytes, kSurveyBytes / 2);
  EXPECT_LE(bytes, kSurveyBytes);
  EXPECT_TRUE(source.starts_at_blocks()) << "no block is read twice";
  EXPECT_EQ(std::accumulate(survey->summary->histogram.begin(), survey->summary->histogram.end(), std::int64_t{0}), bytes / 2);
  EXPECT_EQ(survey->summary->range, (ValueRange{0, 1023})) << "it is spread over all of the volume";
  EXPECT_THAT(survey->summary->bricks, IsEmpty()) << "any value";
}

// A list of its blocks would take 6 GiB.
TEST(SurveyTest, OfAVolumeOfAnySizeTakesLittle) {
  ComputedSource source({{65535, 65535, 65535}}, {32, 32, 32});
  const Result<Survey> survey = SurveySource(source, kFarSurvey);
  ASSERT_TRUE(survey.ok()) << survey.status().message();
  EXPECT_LE(2 * source.voxels_read()[0], kFarSurvey.coarse);
  EXPECT_TRUE(source.starts_at_blocks());
}

TEST(SurveyTest, OfBlocksOfAnySizeTakesLittle) {
  ComputedSource source({{4096, 4096, 4096}}, {4096, 4096, 64});
  ASSERT_TRUE(SurveySource(source, kFarSurvey).ok());
  EXPECT_LE(2 * source.voxels_read()[0], 32 << 20) << "a part of a block of 2 GiB";
}

TEST(SurveyTest, BehindAnAddressLittleIsRead) {
  ComputedSource levels({{512, 512, 512}, {256, 256, 256}, {128, 128, 128}, {64, 64, 64}}, {64, 64, 64});
  const Result<Survey> survey = SurveySource(levels, kFarSurvey);
  ASSERT_TRUE(survey.ok()) << survey.status().message();
  EXPECT_EQ(survey->level, 2);
  EXPECT_THAT(levels.voxels_read(), ElementsAre(0, 0, 128 * 128 * 128, 0));
  ComputedSource one({{512, 512, 512}}, {64, 64, 64});
  ASSERT_TRUE(SurveySource(one, kFarSurvey).ok());
  EXPECT_GT(2 * one.voxels_read()[0], kFarSurvey.coarse / 2);
  EXPECT_LE(2 * one.voxels_read()[0], kFarSurvey.coarse);
}

TEST(SurveyTest, AnErrorEndsIt) {
  ComputedSource source({{512, 512, 512}}, {64, 64, 64});
  source.Fail();
  EXPECT_EQ(SurveySource(source).status(), Status::DataLoss("1/0: damaged"));
}

TEST(UnreadSummaryTest, HasTheStatisticsOfTheSurveyAndNoBricks) {
  Random random(42);
  SCOPED_TRACE(random.trace());
  const VolumeSummary surveyed = Summarize(*SomeVolume(random, {40, 40, 40}, ScalarType::kUint16));
  VolumeDescription finer = surveyed.description;
  finer.geometry.size = {80, 79, 78};
  const VolumeSummary summary = UnreadSummary(finer, surveyed);
  EXPECT_EQ(summary.description, finer);
  EXPECT_EQ(summary.range, surveyed.range);
  EXPECT_EQ(summary.histogram, surveyed.histogram);
  EXPECT_EQ(summary.brick_counts, (Index3{5, 5, 5}));
  EXPECT_THAT(summary.bricks, IsEmpty());
}

TEST(ReadLevelTest, IsTheVolume) {
  Random random(43);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    const std::shared_ptr<const Volume> volume = SomeVolume(random, {33, 70, 130}, type);
    const Result<LevelInMemory> read = MakeMemorySource(volume, {})->ReadLevel(0);
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(read->volume->description, volume->description);
    EXPECT_EQ(read->volume->block.box, volume->block.box);
    EXPECT_EQ(read->volume->block.bytes, volume->block.bytes);
    EXPECT_EQ(read->exact, nullptr);
  }
}

// Large enough to be read in several stretches. The one number that float32 rounds lies in the last slice.
TEST(ReadLevelTest, KeepsWholeNumbersThatAreRounded) {
  const auto volume = std::make_shared<Volume>();
  volume->description = {.geometry = {.size = {512, 512, 40}}, .type = ScalarType::kFloat32};
  volume->block = MakeVoxelBlock(volume->description.geometry.bounds(), ScalarType::kFloat32);
  const std::size_t count = CountIn(volume->description.geometry.size);
  std::vector<std::uint64_t> ids(count);
  for (std::size_t i = 0; i < count; ++i) ids[i] = i * 3;
  const auto read = [&](bool all) {
    const auto exact = std::make_shared<ExactSamples>(ExactSamples{{SampleType::kUint64}, {}});
    exact->bytes.resize(count * sizeof(std::uint64_t));
    std::memcpy(exact->bytes.data(), ids.data(), exact->bytes.size());
    std::ranges::copy(ids, volume->block.samples<float>());
    Result<LevelInMemory> level = MakeMemorySource(volume, {}, exact)->ReadLevel(0, nullptr, {.all_exact = all});
    EXPECT_TRUE(level.ok()) << level.status().message();
    EXPECT_EQ(level->volume->block.bytes, volume->block.bytes);
    EXPECT_TRUE(level->exact == nullptr || level->exact->bytes == exact->bytes);
    return level->exact != nullptr;
  };
  for (std::uint64_t& id : ids) id &= 0xffffff;  // all of these are exact as float32
  EXPECT_FALSE(read(false));
  EXPECT_TRUE(read(true));
  ids.back() = 12857642017;
  EXPECT_TRUE(read(false));
}

}  // namespace
}  // namespace slabstream
