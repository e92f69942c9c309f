#include "data/survey/brick_index.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include "common/files/file_descriptor.h"
#include "data/survey/index_file.h"
#include "data/survey/make_index.h"
#include "tests/data/sources/memory_source.h"
#include "tests/support/random_volume.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

std::shared_ptr<VolumeSource> SomeSource(const std::shared_ptr<const Volume>& volume) { return MakeMemorySource(volume, {}); }

std::shared_ptr<const Volume> MappedVolume(Random& random, const Index3& size, ScalarType type) {
  auto volume = std::make_shared<Volume>(RandomVolume(random, size, type));
  volume->description.mapping = {-0.5, 7};
  if (type == ScalarType::kFloat32) {  // a brick without any finite value
    for (std::int32_t x = 0; x < std::min(size.x, kBrick); ++x) {
      for (std::int32_t y = 0; y < std::min(size.y, kBrick); ++y) {
        for (std::int32_t z = 0; z < std::min(size.z, kBrick); ++z) {
          volume->block.samples<float>()[volume->block.Offset({x, y, z})] = std::numeric_limits<float>::quiet_NaN();
        }
      }
    }
  }
  return volume;
}

BrickIndex IndexOf(VolumeSource& source) {
  BrickIndex index = EmptyIndex(source.info()).value();
  const Status read = ReadIntoIndex(source, {}, index);
  EXPECT_TRUE(read.ok()) << read.message();
  return index;
}

TEST(MakeIndexTest, HasTheRangesOfASummary) {
  Random random(51);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    for (const Index3& size : {Index3{1, 1, 1}, Index3{150, 70, 33}, Index3{17, 400, 65}}) {
      const std::shared_ptr<const Volume> volume = MappedVolume(random, size, type);
      BrickIndex index = EmptyIndex(SomeSource(volume)->info()).value();
      EXPECT_EQ(ShareRead(index), 0);
      EXPECT_EQ(DataRanges(index.levels[0], volume->description), BrickRangeList(index.levels[0].size(), AnyValue(volume->description)));
      std::vector<std::uint64_t> done;
      const Status read =
          ReadIntoIndex(*SomeSource(volume), {.progress = [&](const IndexProgress& p) { done.push_back(p.done_bytes); }}, index);
      ASSERT_TRUE(read.ok()) << read.message();
      EXPECT_EQ(DataRanges(index.levels[0], volume->description), Summarize(*volume).bricks);
      EXPECT_EQ(ShareRead(index), 1);
      EXPECT_EQ(done.front(), 0U);
      EXPECT_EQ(done.back(), std::uint64_t(volume->description.voxel_bytes()));
    }
  }
}

// Reads nothing once it was stopped.
class StoppedSource : public VolumeSource {
 public:
  StoppedSource(std::shared_ptr<VolumeSource> source, int reads) : source_(std::move(source)), left_(reads) {}
  const SourceInfo& info() const override { return source_->info(); }
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    if (left_-- <= 0) return done(Status::Cancelled("reading was stopped"));
    voxels_ += box.voxel_count();
    source_->Read(level, box, out, stop, std::move(done));
  }
  Counts counts() const override { return source_->counts(); }
  std::int64_t voxels() const { return voxels_; }

 private:
  const std::shared_ptr<VolumeSource> source_;
  std::atomic<int> left_;
  std::atomic<std::int64_t> voxels_ = 0;
};

TEST(MakeIndexTest, GoesOnWhereItWasStopped) {
  Random random(52);
  SCOPED_TRACE(random.trace());
  const std::shared_ptr<const Volume> volume = MappedVolume(random, {260, 256, 700}, ScalarType::kUint8);
  StoppedSource stopped(SomeSource(volume), 2);
  BrickIndex index = EmptyIndex(stopped.info()).value();
  EXPECT_EQ(ReadIntoIndex(stopped, {}, index).code(), StatusCode::kCancelled);
  EXPECT_GT(ShareRead(index), 0);
  EXPECT_LT(ShareRead(index), 1);
  StoppedSource rest(SomeSource(volume), 1000);
  ASSERT_TRUE(ReadIntoIndex(rest, {}, index).ok());
  EXPECT_EQ(stopped.voxels() + rest.voxels(), volume->block.box.voxel_count()) << "nothing is read twice";
  EXPECT_EQ(DataRanges(index.levels[0], volume->description), Summarize(*volume).bricks);
}

// ---------------------------------------------------------------- as bytes

TEST(BrickIndexTest, ComesBackFromItsBytes) {
  Random random(53);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    const std::shared_ptr<VolumeSource> source = SomeSource(MappedVolume(random, {50, 40, 30}, type));
    BrickIndex index = IndexOf(*source);
    index.levels[0][3] = kNotRead;
    const std::vector<std::byte> bytes = EncodeIndex(index, source->info(), "scan").value();
    const Result<BrickIndex> decoded = DecodeIndex(bytes, source->info(), "scan");
    ASSERT_TRUE(decoded.ok()) << decoded.status().message();
    EXPECT_EQ(*decoded, index);
    EXPECT_EQ(DecodeIndex(bytes, source->info(), "scam").status().code(), StatusCode::kNotFound);
  }
}

TEST(BrickIndexTest, AirTakesNoRoom) {
  const std::shared_ptr<VolumeSource> source =
      SomeSource(std::make_shared<const Volume>(MakeTestVolume({200, 200, 200}, ScalarType::kUint16, [](const Index3&) { return 0; })));
  EXPECT_LT(EncodeIndex(IndexOf(*source), source->info(), "scan").value().size(), 500U) << "of 2197 bricks";
}

TEST(BrickIndexTest, DamageIsFound) {
  Random random(54);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : kTypes) {
    const std::shared_ptr<VolumeSource> source = SomeSource(MappedVolume(random, {50, 40, 30}, type));
    const std::vector<std::byte> good = EncodeIndex(IndexOf(*source), source->info(), "scan").value();
    for (std::size_t i = 0; i < good.size(); ++i) {
      std::vector<std::byte> bytes = good;
      bytes[i] ^= std::byte(1U << random.Integer(0, 7));
      EXPECT_FALSE(DecodeIndex(bytes, source->info(), "scan").ok()) << "byte " << i;
      EXPECT_FALSE(DecodeIndex(std::span(good).first(i), source->info(), "scan").ok()) << i << " bytes";
    }
    std::vector<std::byte> longer = good;
    longer.push_back({});
    EXPECT_EQ(DecodeIndex(longer, source->info(), "scan").status().code(), StatusCode::kDataLoss);
  }
}

// ---------------------------------------------------------------- as a file

class IndexFileTest : public testing::Test {
 protected:
  IndexFileTest() { ::setenv("XDG_CACHE_HOME", (directory_ / "cache").c_str(), 1); }
  void Put(const std::string& name, const std::string& text) const { std::ofstream(directory_ / name) << text; }

  const TemporaryDirectory directory_;
  Random random_{55};
  const std::shared_ptr<VolumeSource> source_ = SomeSource(MappedVolume(random_, {50, 40, 30}, ScalarType::kUint16));
};

TEST_F(IndexFileTest, IsKeptForEachPathAndItsOptions) {
  const IndexFile file = IndexFile::Of(directory_ / "a.nrrd", "").value();
  const std::string name = file.NameNow(1, source_->info()).value();
  EXPECT_FALSE(file.facts());
  EXPECT_EQ(file.Read(name, source_->info()).value(), std::nullopt);
  const BrickIndex index = IndexOf(*source_);
  const Status written = file.Write(name, index, source_->info());
  ASSERT_TRUE(written.ok()) << written.message();
  ASSERT_TRUE(file.facts());
  EXPECT_EQ(file.Read(name, source_->info()).value(), index);
  EXPECT_EQ(IndexFile::Of((directory_ / "b/../a.nrrd"), "").value().path(), file.path()) << "the same path";
  EXPECT_NE(IndexFile::Of(directory_ / "a.nrrd", "?time=1").value().path(), file.path());
  EXPECT_NE(IndexFile::Of(directory_ / "b.nrrd", "").value().path(), file.path());
}

TEST_F(IndexFileTest, IsOfTheFilesAsTheyWere) {
  std::filesystem::create_directories(directory_ / "scan.zarr/0");
  Put("scan.zarr/0/1", "chunk");
  const IndexFile file = IndexFile::Of(directory_ / "scan.zarr", "").value();
  SourceInfo info = source_->info();
  info.folder = directory_ / "scan.zarr";
  const std::string name = file.NameNow(1, info).value();
  EXPECT_EQ(file.NameNow(1, info).value(), name);
  ASSERT_TRUE(file.Write(name, IndexOf(*source_), info).ok());
  EXPECT_NE(file.NameNow(2, info).value(), name);
  Put("scan.zarr/0/1", "another chunk");
  const std::string changed = file.NameNow(1, info).value();
  EXPECT_NE(changed, name) << "a chunk has changed";
  const Status stale = file.Read(changed, info).status();
  EXPECT_EQ(stale.code(), StatusCode::kNotFound);
  EXPECT_NE(stale.message().find(file.path()), std::string::npos) << stale.message();
  Put("scan.zarr/0/2", "chunk");
  EXPECT_NE(file.NameNow(1, info).value(), changed) << "there is one more";
}

TEST_F(IndexFileTest, AFileThatIsTooLongOrDamagedIsNoIndex) {
  const IndexFile file = IndexFile::Of(directory_ / "a.nrrd", "").value();
  const std::string name = file.NameNow(1, source_->info()).value();
  ASSERT_TRUE(file.Write(name, IndexOf(*source_), source_->info()).ok());
  std::filesystem::resize_file(file.path(), 100'000'000);
  EXPECT_FALSE(file.Read(name, source_->info()).ok());
  std::ofstream(file.path()) << "nonsense";
  EXPECT_EQ(file.Read(name, source_->info()).status().code(), StatusCode::kDataLoss);
}

TEST_F(IndexFileTest, SeveralMayWriteIt) {
  const BrickIndex index = IndexOf(*source_);
  const IndexFile file = IndexFile::Of(directory_ / "a.nrrd", "").value();
  const std::string name = file.NameNow(1, source_->info()).value();
  ASSERT_TRUE(file.Write(name, index, source_->info()).ok());
  std::vector<std::jthread> writers;
  for (int i = 0; i < 4; ++i) {
    writers.emplace_back([&] {
      for (int turn = 0; turn < 20; ++turn) EXPECT_TRUE(file.Write(name, index, source_->info()).ok());
    });
  }
  for (int turn = 0; turn < 20; ++turn) EXPECT_EQ(file.Read(name, source_->info()).value(), index);
  writers.clear();
  EXPECT_EQ(file.Read(name, source_->info()).value(), index);
}

TEST_F(IndexFileTest, WhatSeveralKnowIsMerged) {
  const BrickIndex all = IndexOf(*source_);
  const IndexFile file = IndexFile::Of(directory_ / "a.nrrd", "").value();
  const std::string name = file.NameNow(1, source_->info()).value();
  std::vector<std::jthread> writers;
  for (std::size_t brick = 0; brick < all.levels[0].size(); ++brick) {
    writers.emplace_back([&, brick] {
      BrickIndex one = EmptyIndex(source_->info()).value();
      one.levels[0][brick] = all.levels[0][brick];
      EXPECT_TRUE(file.Merge(name, one, source_->info()).ok());
    });
  }
  writers.clear();
  EXPECT_EQ(file.Read(name, source_->info()).value(), all);
}

TEST_F(IndexFileTest, ALockOfSomebodyElseOnTheFolderHoldsUpNobody) {
  const IndexFile file = IndexFile::Of(directory_ / "a.nrrd", "").value();
  ASSERT_TRUE(file.Write("name", IndexOf(*source_), source_->info()).ok());
  const FileDescriptor folder(::open(std::filesystem::path(file.path()).parent_path().c_str(), O_RDONLY | O_CLOEXEC));
  ASSERT_EQ(::flock(folder.number(), LOCK_EX), 0);
  EXPECT_TRUE(file.Merge("name", IndexOf(*source_), source_->info()).ok());
}

TEST_F(IndexFileTest, OneInAFolderThatOthersMayWriteIsNotUsed) {
  const IndexFile file = IndexFile::Of(directory_ / "a.nrrd", "").value();
  ASSERT_TRUE(file.Write("name", IndexOf(*source_), source_->info()).ok());
  std::filesystem::permissions(std::filesystem::path(file.path()).parent_path(), std::filesystem::perms::all);
  const Status read = file.Read("name", source_->info()).status();
  EXPECT_EQ(read.code(), StatusCode::kUnavailable);
  EXPECT_NE(read.message().find("can be written by all users"), std::string::npos) << read.message();
}

TEST_F(IndexFileTest, ACacheFolderThatCannotBeMadeIsNamed) {
  Put("file", "");
  ::setenv("XDG_CACHE_HOME", (directory_ / "file").c_str(), 1);
  const IndexFile file = IndexFile::Of(directory_ / "a.nrrd", "").value();
  const Status written = file.Write("name", IndexOf(*source_), source_->info());
  EXPECT_EQ(written.code(), StatusCode::kUnavailable);
  EXPECT_NE(written.message().find("XDG_CACHE_HOME"), std::string::npos) << written.message();
  ::setenv("XDG_CACHE_HOME", "here", 1);
  ::unsetenv("HOME");
  EXPECT_EQ(IndexFile::Of("a", "").status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace slabstream
