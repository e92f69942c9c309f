// Slices of compressed streams make the volume that is decoded as a whole.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "common/volume/box_assembly.h"
#include "data/positional/file_source.h"
#include "tests/data/positional/read_decoded.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/stored_object.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

std::shared_ptr<VolumeSource> OpenedStream(const std::string& path, const ReadOptions& options = {}) {
  static const SourceContext kContext = std::make_shared<ReadContext>(ReadContext::Limits{});
  Result<std::shared_ptr<VolumeSource>> stream = OpenFile(*FindFormat(path, options), path, options, kContext);
  CHECK(stream.ok() && (*stream)->info().slices) << stream.status().message();
  return *std::move(stream);
}

// Boxes of `slices` slices, in the order of the file.
std::vector<Box> InOrder(const VolumeSource& stream, std::int32_t slices) {
  const Box bounds = stream.info().levels[0].description.geometry.bounds();
  Index3 step = bounds.end;
  step[stream.info().slices->along] = slices;
  std::vector<Box> boxes = CutAtBlocks(bounds, step);
  if (stream.info().slices->from_end) std::ranges::reverse(boxes);
  return boxes;
}

// All boxes put together.
VoxelBlock Collect(VolumeSource& stream, const std::vector<Box>& boxes) {
  const VolumeDescription& description = stream.info().levels[0].description;
  VoxelBlock all = MakeVoxelBlock(description.geometry.bounds(), description.type);
  for (const Box& box : boxes) {
    VoxelBlock part = MakeVoxelBlock(box, description.type);
    const Status status = stream.ReadNow(0, box, part.bytes);
    EXPECT_TRUE(status.ok()) << status.message();
    const std::size_t sample = BytesPerSample(description.type), row = std::size_t(box.size().x) * sample;
    const std::byte* from = part.bytes.data();
    for (int z = box.begin.z; z < box.end.z; ++z) {
      for (int y = box.begin.y; y < box.end.y; ++y, from += row) {
        std::memcpy(all.bytes.data() + std::size_t(all.Offset({box.begin.x, y, z})) * sample, from, row);
      }
    }
  }
  return all;
}

// Voxels are those of `whole`, and the summary that was made while they came is theirs.
void ExpectLevelLikeWhole(VolumeSource& stream, const LoadedVolume& whole) {
  const Result<LevelInMemory> level = stream.ReadLevel(0, nullptr, {.summary = true});
  ASSERT_TRUE(level.ok()) << level.status().message();
  EXPECT_TRUE(level->volume->block.bytes == whole.volume->block.bytes);
  EXPECT_EQ(level->summary == nullptr, MayBeRounded(stream.info().exact.type)) << "the type of rounded samples is known at the end";
  EXPECT_TRUE(level->summary == nullptr || *level->summary == Summarize(*level->volume));
}

void ExpectStreamLikeWhole(const std::string& path, const ReadOptions& options = {}) {
  const Result<LoadedVolume> whole = ReadDecoded(path, options);
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  for (const std::int32_t slices : {1, 2, 3, 64}) {
    const std::shared_ptr<VolumeSource> stream = OpenedStream(path, options);
    EXPECT_EQ(stream->info().levels[0].description, whole->info.finest());
    EXPECT_TRUE(Collect(*stream, InOrder(*stream, slices)).bytes == whole->volume->block.bytes) << slices;
    EXPECT_EQ(stream->counts().stored_bytes % std::size_t(whole->info.finest().geometry.bounds().voxel_count()), 0U);
  }
  ExpectLevelLikeWhole(*OpenedStream(path, options), *whole);
}

FileBytes GzippedNrrd(const Stored& stored) {
  const FileBytes plain = NrrdFile(stored);
  FileBytes header = plain.substr(0, plain.size() - stored.samples.size());
  header.replace(header.find("raw"), 3, "gzip");
  return header + Gzip(stored.samples);
}

TEST(SliceStream, GivesTheVolumeOfEveryFormatTypeAndByteOrder) {
  Random random(51);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const SampleFile& stream : CompressedStreams({5, 4, 7}, random)) {
    SCOPED_TRACE(stream.file);
    WriteFile(directory / stream.file, stream.bytes);
    ExpectStreamLikeWhole(directory / stream.file);
  }
}

TEST(SliceStream, TurnsSlicesOfEachOfThe48Storages) {
  const TemporaryDirectory directory;
  for (const Storage& storage : AllStorages()) {
    SCOPED_TRACE(Text(storage));
    WriteFile(directory / "v.nrrd", GzippedNrrd(StoredAs({.size = {7, 5, 4}}, storage)));
    ExpectStreamLikeWhole(directory / "v.nrrd");
  }
}

TEST(SliceStream, IsSummarizedAsItComesAlongAnyAxisFromBothEnds) {
  const TemporaryDirectory directory;
  constexpr std::int32_t kSlices = 36, kSide = 1024;  // read in stretches of 16 slices
  const auto value = [](const Index3& v) { return std::uint8_t(v.x / 3 + v.y / 5 + v.z); };
  for (const auto& [size, storage] : {std::pair(Index3{kSide, kSide, kSlices}, Storage{{0, 1, 2}, {false, false, true}}),
                                      std::pair(Index3{kSlices, kSide, kSide}, Storage{{2, 1, 0}, {}})}) {
    SCOPED_TRACE(Text(storage));
    const FileBytes file = GzippedNrrd(StoredAs({.size = size, .value = value}, storage));
    WriteFile(directory / "v.nrrd", file);
    const std::shared_ptr<VolumeSource> stream = OpenedStream(directory / "v.nrrd");
    EXPECT_EQ(stream->info().slices->from_end, storage.flipped[2]);
    ExpectLevelLikeWhole(*stream, *ReadDecoded(directory / "v.nrrd"));
    WriteFile(directory / "v.nrrd", file.substr(0, file.size() * 3 / 4));
    EXPECT_EQ(OpenedStream(directory / "v.nrrd")->ReadLevel(0, nullptr, {.summary = true}).status().code(), StatusCode::kDataLoss);
  }
}

TEST(SliceStream, TakesOneOfSeveralTimesAndComponents) {
  const TemporaryDirectory directory;
  FileBytes samples;
  for (int i = 0; i < 120; ++i) samples += char(i);
  WriteFile(directory / "v.nii.gz", Gzip(NiftiHeader({.dimensions = {4, 3, 2, 5}}) + samples));
  for (int time = 0; time < 5; ++time) ExpectStreamLikeWhole(directory / "v.nii.gz", {.time = TimeRange{time, time}});
  WriteFile(directory / "v.nrrd", "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 5 4 2\nencoding: gzip\n\n" + Gzip(samples));
  for (int channel = 0; channel < 3; ++channel) ExpectStreamLikeWhole(directory / "v.nrrd", {.channel = channel});
}

TEST(SliceStream, ReadsChannelsMatricesAndSeveralFilesAsTheWholeReaderDoes) {
  const TemporaryDirectory directory;
  FileBytes samples;
  for (int i = 0; i < 144; ++i) samples += char(i);
  WriteFile(directory / "v.nii.gz", Gzip(NiftiHeader({.qform = 1, .sform = 2, .dimensions = {4, 3, 2, 2, 3}}) + samples));
  for (const char* matrix : {"sform", "qform"}) {
    for (int channel = 0; channel < 3; ++channel) {
      ExpectStreamLikeWhole(directory / "v.nii.gz", {.time = TimeRange{1, 1}, .channel = channel, .matrix = matrix});
    }
  }
  for (int i = 0; i < 4; ++i) WriteFile(directory / fmt::format("{}.gz", i), Gzip(samples.substr(std::size_t(i) * 36, 36)));
  WriteFile(directory / "v.nhdr",
            "NRRD0004\ntype: uint8\ndimension: 4\nkinds: space space space time\nsizes: 4 3 4 3\nencoding: gzip\n"
            "data file: %d.gz 0 3 1\n\n");
  for (int time = 0; time < 3; ++time) ExpectStreamLikeWhole(directory / "v.nhdr", {.time = TimeRange{time, time}});
}

TEST(SliceStream, ReadsInOrderOnceAndAnyBoxFromTheBeginning) {
  const TemporaryDirectory directory;
  const std::string path = directory / "v.nii.gz";
  constexpr std::size_t kSlice = 40 * 30;
  FileBytes samples;
  Random random(53);
  for (std::size_t i = 0; i < kSlice * 20; ++i) samples += char(random.Integer(0, 255));
  WriteFile(path, Gzip(NiftiHeader({.size = {40, 30, 20}}) + samples));
  const VoxelBlock whole = ReadDecoded(path)->volume->block;
  std::vector<int> percents;
  ReadProgress progress([&](const ReadShare& read) { percents.push_back(read.percent); });
  const std::shared_ptr<VolumeSource> stream = OpenedStream(path, {.progress = &progress});
  EXPECT_EQ(stream->info().levels[0].block, (Index3{40, 30, 1}));
  EXPECT_TRUE(Collect(*stream, InOrder(*stream, 6)).bytes == whole.bytes);
  EXPECT_EQ(stream->counts().stored_bytes, kSlice * 20);
  EXPECT_EQ(percents.back(), 100);
  const std::size_t told = percents.size();
  // Any boxes, in any order.
  std::vector<Box> boxes = CutAtBlocks({{0, 0, 0}, {40, 30, 20}}, {17, 13, 7});
  std::ranges::reverse(boxes);
  EXPECT_TRUE(Collect(*stream, boxes).bytes == whole.bytes);
  EXPECT_GT(stream->counts().stored_bytes, kSlice * 40) << "it was read from its beginning several times";
  EXPECT_EQ(percents.size(), told) << "each slice is told once";
}

TEST(SliceStream, EndsWithWhatIsWrong) {
  const TemporaryDirectory directory;
  const FileSpec spec{.size = {50, 40, 30}};
  const std::string path = directory / "v.nii.gz";
  FileBytes samples;
  Random random(52);
  for (int i = 0; i < 60000; ++i) samples += char(random.Integer(0, 255));
  const FileBytes bytes = Gzip(NiftiHeader(spec) + samples);
  int boxes = 0;
  const auto read = [&](const FileBytes& file, std::stop_token stop = {}) {
    WriteFile(path, file);
    const std::shared_ptr<VolumeSource> stream = OpenedStream(path);
    Status status;
    for (const Box& box : InOrder(*stream, 4)) {
      VoxelBlock part = MakeVoxelBlock(box, ScalarType::kUint8);
      status = stream->ReadNow(0, box, part.bytes, stop);
      if (!status.ok()) break;
      ++boxes;
    }
    return status;
  };
  const Status cut = read(bytes.substr(0, 40000));
  EXPECT_EQ(cut.code(), StatusCode::kDataLoss);
  EXPECT_THAT(cut.message(), HasSubstr("v.nii.gz: truncated"));
  EXPECT_GT(boxes, 2);
  FileBytes damaged = bytes;
  damaged[damaged.size() - 6] ^= 1;  // of the checksum
  EXPECT_THAT(read(damaged).message(), HasSubstr("damaged"));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(read(bytes, stop.get_token()).code(), StatusCode::kCancelled);
}

}  // namespace
}  // namespace slabstream
