// Slices of compressed streams make the volume that ReadVolume reads.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "data/positional/slice_stream.h"
#include "data/volume_io/volume_reader.h"
#include "tests/data/volume_io/more_files.h"
#include "tests/data/volume_io/stored_object.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

SliceStream OpenedStream(const std::string& path, const ReadOptions& options = {}) {
  Result<SliceStream> stream = SliceStream::Open(path, options);
  CHECK(stream.ok()) << stream.status().message();
  return *std::move(stream);
}

// All boxes put together. Each lies at a multiple of `slices` along the axis of the slices.
VoxelBlock Collect(const SliceStream& stream, std::int32_t slices) {
  const VolumeDescription& description = stream.info().levels[0].description;
  VoxelBlock all = MakeVoxelBlock(description.geometry.bounds(), description.type);
  std::int64_t voxels = 0;
  const Status status = stream.Read(slices, [&](const Box& box, std::span<const std::byte> samples) {
    EXPECT_EQ(box.begin[stream.along()] % slices, 0);
    EXPECT_EQ(samples.size(), std::size_t(box.voxel_count()) * BytesPerSample(description.type));
    voxels += box.voxel_count();
    const std::size_t row = std::size_t(box.size().x) * BytesPerSample(description.type);
    for (int z = box.begin.z; z < box.end.z; ++z) {
      for (int y = box.begin.y; y < box.end.y; ++y) {
        std::memcpy(all.bytes.data() + std::size_t(all.Offset({box.begin.x, y, z})) * BytesPerSample(description.type), samples.data(),
                    row);
        samples = samples.subspan(row);
      }
    }
    return Status::Ok();
  });
  EXPECT_TRUE(status.ok()) << status.message();
  EXPECT_EQ(voxels, description.geometry.bounds().voxel_count());
  return all;
}

void ExpectStreamLikeWhole(const std::string& path, const ReadOptions& options = {}) {
  const Result<LoadedVolume> whole = ReadVolume(path, options);
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  EXPECT_TRUE(SliceStream::Recognises(path));
  const SliceStream stream = OpenedStream(path, options);
  EXPECT_EQ(stream.info().levels[0].description, whole->info.description);
  for (const std::int32_t slices : {1, 2, 3, 64}) EXPECT_TRUE(Collect(stream, slices).bytes == whole->volume->block.bytes) << slices;
}

TEST(SliceStream, GivesTheVolumeOfEveryFormatTypeAndByteOrder) {
  Random random(51);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const SampleType type : {SampleType::kInt8, SampleType::kUint8, SampleType::kInt16, SampleType::kUint16, SampleType::kFloat32}) {
    for (const bool big : {false, true}) {
      const FileSpec spec{.size = {5, 4, 7}, .type = type, .big_endian = big, .qform = 1};
      std::vector<double> values(140);
      for (double& value : values) value = random.Integer(0, 127);
      const FileBytes samples = EncodeSamples(type, values, big), zlib = Zlib(samples);
      const std::pair<std::string, FileBytes> files[] = {{"v.nii.gz", Gzip(NiftiHeader(spec) + samples)},
                                                         {"v.nrrd", NrrdHeader(spec, "gzip") + Gzip(samples)},
                                                         {"v.mha", MetaHeader(spec, "LOCAL", std::int64_t(zlib.size())) + zlib}};
      for (const auto& [name, bytes] : files) {
        SCOPED_TRACE(name);
        WriteFile(directory / name, bytes);
        ExpectStreamLikeWhole(directory / name);
      }
    }
  }
}

TEST(SliceStream, TurnsSlicesOfEachOfThe48Storages) {
  const TemporaryDirectory directory;
  for (const Storage& storage : AllStorages()) {
    SCOPED_TRACE(Text(storage));
    Stored stored = StoredAs({.size = {7, 5, 4}}, storage);
    const FileBytes plain = NrrdFile(stored);
    const std::size_t header = plain.size() - stored.samples.size();
    FileBytes bytes = plain.substr(0, header);
    bytes.replace(bytes.find("raw"), 3, "gzip");
    WriteFile(directory / "v.nrrd", bytes + Gzip(stored.samples));
    ExpectStreamLikeWhole(directory / "v.nrrd");
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

TEST(SliceStream, EndsWithWhatIsWrong) {
  const TemporaryDirectory directory;
  const FileSpec spec{.size = {50, 40, 30}};
  const std::string path = directory / "v.nii.gz";
  FileBytes samples;
  Random random(52);
  for (int i = 0; i < 60000; ++i) samples += char(random.Integer(0, 255));
  const FileBytes bytes = Gzip(NiftiHeader(spec) + samples);
  const auto read = [&](const FileBytes& file, const SliceStream::Take& take, std::stop_token stop = {}) {
    WriteFile(path, file);
    return OpenedStream(path).Read(4, take, std::move(stop));
  };
  int boxes = 0;
  const SliceStream::Take count = [&](const Box&, std::span<const std::byte>) {
    ++boxes;
    return Status::Ok();
  };
  const Status cut = read(bytes.substr(0, 40000), count);
  EXPECT_EQ(cut.code(), StatusCode::kDataLoss);
  EXPECT_THAT(cut.message(), HasSubstr("v.nii.gz: truncated"));
  EXPECT_GT(boxes, 2);
  FileBytes damaged = bytes;
  damaged[damaged.size() - 6] ^= 1;  // of the checksum
  EXPECT_THAT(read(damaged, count).message(), HasSubstr("damaged"));
  const Status full = read(bytes, [](const Box&, std::span<const std::byte>) { return Status::Unavailable("the disk is full"); });
  EXPECT_EQ(full, Status::Unavailable("the disk is full"));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(read(bytes, count, stop.get_token()).code(), StatusCode::kCancelled);
  WriteFile(directory / "v.nii", NiftiHeader(spec) + samples);
  EXPECT_FALSE(SliceStream::Recognises(directory / "v.nii"));
  EXPECT_THAT(SliceStream::Open(directory / "v.nii", {}).status().message(), HasSubstr("not compressed"));
}

}  // namespace
}  // namespace slabstream
