// Compressed streams as brick stores: the same voxels, read once, whoever comes and whatever stops them.
#include "data/brick_store/brick_store.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/survey/survey.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/stored_object.h"
#include "tests/support/full_disk.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

constexpr std::uint64_t kBudget = std::uint64_t{1} << 30;

class BrickStoreTest : public testing::Test {
 protected:
  Result<StoredStream> Open(const std::string& source, const BrickStoreOptions& options = {}, std::uint64_t budget = kBudget) {
    percents_.clear();
    ReadProgress progress([&](const ReadShare& read) { percents_.push_back(read.percent); });
    return OpenStored(source, StoreFolder(stores_, budget), ProcessReadContext(), options, &progress);
  }
  bool ReadTheStream() const { return !percents_.empty(); }

  // A file of noise, which cannot be packed.
  std::string Scan(const std::string& name, const Index3& size = {60, 50, 40}, std::uint64_t seed = 1) const {
    Random random(seed);
    FileBytes samples;
    for (std::size_t i = 0; i < CountIn(size); ++i) samples += char(random.Integer(0, 255));
    WriteFile(directory_ / name, Gzip(NiftiHeader({.size = size}) + samples));
    return directory_ / name;
  }
  void ExpectVoxelsOf(const std::string& source, const StoredStream& stored) const {
    const SourceText text = ParseSourceText(source).value();
    const Result<LoadedVolume> whole = ReadVolume(text.path, text.options);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    const SourceInfo& info = stored.source->info();
    ASSERT_EQ(info.levels.size(), 1U) << "as in memory";
    EXPECT_EQ(info.levels[0].description, whole->info.finest());
    EXPECT_EQ(info.format, whole->info.format);
    EXPECT_EQ(info.file_type, whole->info.file_type);
    EXPECT_EQ(info.labels, whole->info.labels);
    const auto read = stored.source->ReadLevel(0);
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_TRUE(read->volume->block.bytes == whole->volume->block.bytes);
  }
  std::vector<std::string> Stores() const {
    std::vector<std::string> names;
    std::error_code error;
    for (const auto& each : fs::directory_iterator(stores_, error)) {
      if (each.is_directory()) names.push_back(each.path().filename().string());
    }
    return names;
  }

  TemporaryDirectory directory_;
  const std::string stores_ = directory_ / "cache/streams";
  std::vector<int> percents_;
};

TEST_F(BrickStoreTest, HasTheVoxelsOfEveryFormatTypeAndByteOrder) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (const SampleFile& stream : CompressedStreams({25, 14, 70}, random)) {
    SCOPED_TRACE(stream.file);
    WriteFile(directory_ / stream.file, stream.bytes);
    for (const bool first : {true, false}) {
      const Result<StoredStream> stored = Open(directory_ / stream.file);
      ASSERT_TRUE(stored.ok()) << stored.status().message();
      EXPECT_EQ(ReadTheStream(), first) << "later ones use what is there";
      ExpectVoxelsOf(directory_ / stream.file, *stored);
    }
  }
}

TEST_F(BrickStoreTest, HasTheVoxelsOfEachOfThe48Storages) {
  for (const Storage& storage : AllStorages()) {
    SCOPED_TRACE(Text(storage));
    Stored stored = StoredAs({.size = {17, 35, 24}}, storage);
    const FileBytes plain = NrrdFile(stored);
    FileBytes bytes = plain.substr(0, plain.size() - stored.samples.size());
    bytes.replace(bytes.find("raw"), 3, "gzip");
    const std::string file = directory_ / "v.nrrd";
    WriteFile(file, bytes + Gzip(stored.samples));
    const Result<StoredStream> opened = Open(file);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    ExpectVoxelsOf(file, *opened);
  }
}

TEST_F(BrickStoreTest, EachTimeAndEachStateOfAFileHasAStoreOfItsOwn) {
  FileBytes samples;
  for (int i = 0; i < 120; ++i) samples += char(i);
  const std::string file = directory_ / "v.nii.gz";
  WriteFile(file, Gzip(NiftiHeader({.dimensions = {4, 3, 2, 5}}) + samples));
  for (const char* const time : {"?time=0", "?time=4", "?time=0"}) {
    const Result<StoredStream> stored = Open(file + time);
    ASSERT_TRUE(stored.ok()) << stored.status().message();
    ExpectVoxelsOf(file + time, *stored);
  }
  EXPECT_FALSE(ReadTheStream());
  EXPECT_EQ(Stores().size(), 2U);
  std::ranges::reverse(samples);
  WriteFile(file, Gzip(NiftiHeader({.dimensions = {4, 3, 2, 5}}) + samples));
  fs::last_write_time(file, fs::last_write_time(file) + std::chrono::seconds(1));
  const Result<StoredStream> stored = Open(file + "?time=0");
  ASSERT_TRUE(stored.ok()) << stored.status().message();
  EXPECT_TRUE(ReadTheStream());
  ExpectVoxelsOf(file + "?time=0", *stored);
}

// Little memory makes thinner slabs of the same voxels.
TEST_F(BrickStoreTest, MemoryChangesNoVoxel) {
  const std::string file = Scan("v.nii.gz", {300, 280, 90});
  Result<std::uint64_t> version = std::uint64_t{0};
  for (const std::uint64_t mebibytes : {512, 14}) {
    fs::remove_all(stores_);
    const Result<StoredStream> stored = Open(file, {.memory = mebibytes << 20});
    ASSERT_TRUE(stored.ok()) << stored.status().message();
    ExpectVoxelsOf(file, *stored);
  }
  fs::remove_all(stores_);
  const Status refused = Open(file, {.memory = 1 << 20}).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("v.nii.gz: to read its slices once needs "), HasSubstr("only 1 MiB are given")));
  EXPECT_TRUE(Stores().empty());
}

// A stop leaves what a killed process leaves, but for the files that it was writing.
TEST_F(BrickStoreTest, GoesOnAfterAStopAnywhere) {
  const std::string file = Scan("v.nii.gz", {50, 40, 300});
  std::uint64_t written = 0;
  for (const int percent : {1, 40, 70, 90}) {
    std::stop_source stop;
    ReadProgress progress([&](const ReadShare& read) {
      if (read.percent >= percent) stop.request_stop();
    });
    const BrickStoreOptions options{.stop = stop.get_token()};
    const Status stopped = OpenStored(file, StoreFolder(stores_, kBudget), ProcessReadContext(), options, &progress).status();
    EXPECT_EQ(stopped.code(), StatusCode::kCancelled) << stopped.message();
    ASSERT_EQ(Stores().size(), 1U);
    const std::uint64_t now = StoreFolder(stores_, kBudget).BytesOf(Stores().front());
    EXPECT_GE(now, written) << "what is written stays";
    written = now;
    WriteFile(stores_ + "/" + Stores().front() + "/left.1-2.tmp", "of a process that was killed");
  }
  const Result<StoredStream> stored = Open(file);
  ASSERT_TRUE(stored.ok()) << stored.status().message();
  ExpectVoxelsOf(file, *stored);  // what was stopped last may have read all of the stream
  EXPECT_EQ(Stores().size(), 1U);
  EXPECT_FALSE(fs::exists(stored->path + "/left.1-2.tmp"));
}

TEST_F(BrickStoreTest, OneReadsAndTheOthersWait) {
  const std::string file = Scan("v.nii.gz", {60, 50, 150});
  std::atomic<int> read = 0;
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      ReadProgress progress([&](const ReadShare& share) { read += share.percent == 100 ? 1 : 0; });
      const Result<StoredStream> stored = OpenStored(file, StoreFolder(stores_, kBudget), ProcessReadContext(), {}, &progress);
      EXPECT_TRUE(stored.ok()) << stored.status().message();
    });
  }
  threads.clear();
  EXPECT_EQ(read, 1);
}

TEST_F(BrickStoreTest, ADamagedStreamLeavesNothing) {
  const std::string file = Scan("v.nii.gz");
  FileBytes bytes = ReadFile(file);
  bytes[bytes.size() - 6] ^= 1;  // of the checksum, which comes last
  WriteFile(file, bytes);
  const Status status = Open(file).status();
  EXPECT_EQ(status.code(), StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("v.nii.gz: the compressed samples are damaged"));
  EXPECT_TRUE(Stores().empty());
}

TEST_F(BrickStoreTest, AFullDiskEndsInOneLineThatNamesThePlaceAndTheBytes) {
  const std::string file = Scan("v.nii.gz", {200, 150, 100});
  const Status status = OnFullDisk(100000, [&] { return Open(file).status(); });
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("'" + stores_ + "' cannot hold the voxels of '" + file + "': they need about 3 MiB, "),
                                      HasSubstr(" MiB are available"), HasSubstr("File too large"), HasSubstr("XDG_CACHE_HOME")));
  EXPECT_EQ(std::ranges::count(status.message(), '\n'), 0);
  EXPECT_TRUE(Stores().empty()) << "nothing stays on a full disk";
  EXPECT_TRUE(Open(file).ok());
}

TEST_F(BrickStoreTest, APlaceThatCannotBeWrittenIsNamed) {
  const std::string file = Scan("v.nii.gz");
  WriteFile(directory_ / "cache", "a file");
  const Status status = Open(file).status();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), AllOf(HasSubstr(file + ": cannot make the folder '" + stores_ + "': Not a directory")));
}

// The file may be one that nobody else may read.
TEST_F(BrickStoreTest, NobodyElseReadsWhatIsStored) {
  ASSERT_TRUE(Open(Scan("v.nii.gz")).ok());
  int files = 0;
  for (const auto& each : fs::recursive_directory_iterator(directory_ / "cache")) {
    EXPECT_EQ(each.status().permissions() & (fs::perms::group_all | fs::perms::others_all), fs::perms::none) << each.path();
    files += each.is_regular_file() ? 1 : 0;
  }
  EXPECT_GT(files, 2);
}

TEST_F(BrickStoreTest, ALockThatSomebodyKeepsIsNamed) {
  const std::string file = Scan("v.nii.gz");
  ASSERT_TRUE(Open(file).ok());
  const std::string lock = stores_ + "/" + Stores().front() + ".lock";
  const Result<FileDescriptor> held = LockFile(lock, LockMode::kAlone);
  const StoreFolder impatient(stores_, kBudget, std::chrono::milliseconds(10));
  const Status status = OpenStored(file, impatient, ProcessReadContext(), {}).status();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr(file + ": another process holds the lock '" + lock + "'"));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(Open(file, {.stop = stop.get_token()}).status().code(), StatusCode::kCancelled);
}

TEST_F(BrickStoreTest, ThoseUsedLongestAgoLeaveUnlessTheyAreInUse) {
  const std::string files[] = {Scan("a.nii.gz", {60, 50, 40}, 1), Scan("b.nii.gz", {60, 50, 40}, 2), Scan("c.nii.gz", {60, 50, 40}, 3),
                               Scan("d.nii.gz", {60, 50, 40}, 4)};
  const auto uses = [&](const std::string& file, int seconds_ago) {
    for (const auto& each : fs::directory_iterator(stores_)) {
      if (each.path().extension() == ".lock" && each.path().filename().string().starts_with(fs::path(file).stem().stem().string())) {
        fs::last_write_time(each, fs::file_time_type::clock::now() - std::chrono::seconds(seconds_ago));
      }
    }
  };
  std::optional<StoredStream> first = Open(files[0]).value();
  const std::uint64_t one = StoreFolder(stores_, kBudget).BytesOf(Stores().front());
  const std::uint64_t budget = 3 * one + one / 2;
  for (int i = 1; i < 3; ++i) ASSERT_TRUE(Open(files[i], {}, budget).ok());
  for (int i = 0; i < 3; ++i) uses(files[i], 100 - 10 * i);
  // The first one is in use, so the second one goes.
  ASSERT_TRUE(Open(files[3], {}, budget).ok());
  std::vector<std::string> names = Stores();
  const auto has = [&](char letter) { return std::ranges::any_of(names, [&](const std::string& name) { return name[0] == letter; }); };
  EXPECT_TRUE(has('a') && !has('b') && has('c') && has('d'));
  ExpectVoxelsOf(files[0], *first);
  first.reset();
  ASSERT_TRUE(Open(files[1], {}, budget).ok());
  names = Stores();
  EXPECT_TRUE(!has('a') && has('b'));
  // One that is larger than the budget is refused, however many leave for it.
  const Status refused = Open(Scan("e.nii.gz", {60, 50, 400}), {}, budget).status();
  EXPECT_EQ(refused.code(), StatusCode::kUnavailable);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("e.nii.gz"), HasSubstr("need about 2 MiB, 1 MiB are available")));
}

TEST_F(BrickStoreTest, AStoreThatGrowsBeyondTheBudgetIsGivenUp) {
  // Levels make it larger than the file.
  const std::string file = Scan("v.nii.gz", {128, 128, 128});
  const Status refused = Open(file, {}, fs::file_size(file) + 1000).status();
  EXPECT_EQ(refused.code(), StatusCode::kUnavailable);
  EXPECT_THAT(refused.message(), HasSubstr("cannot hold the voxels of"));
  EXPECT_TRUE(Stores().empty());
}

}  // namespace
}  // namespace slabstream
