#include "tests/data/sources/memory_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "data/sources/part_source.h"

namespace slabstream {
namespace {

TEST(MemorySourceTest, BoxesAreThoseOfTheVolume) {
  auto volume = std::make_shared<Volume>();
  volume->description = {.geometry = {.size = {70, 5, 6}, .spacing = {1, 2, 3}}, .type = ScalarType::kUint16, .mapping = {2, 1}};
  volume->block = MakeVoxelBlock(volume->description.geometry.bounds(), ScalarType::kUint16);
  for (std::uint16_t i = 0; i < 70 * 5 * 6; ++i) volume->block.samples<std::uint16_t>()[i] = i;
  const auto source = MakeMemorySource(volume, {.format = "NRRD", .file_type = "uint16"});
  ASSERT_EQ(source->info().levels.size(), 1U);
  EXPECT_EQ(source->info().levels[0].description, volume->description);
  EXPECT_EQ(source->info().levels[0].block, (Index3{64, 5, 6}));
  EXPECT_EQ(source->info().format, "NRRD");
  const Box box = {{3, 1, 2}, {66, 4, 6}};
  AlignedVector<std::byte> out(std::size_t(box.voxel_count()) * 2);
  EXPECT_TRUE(source->ReadNow(0, box, out).ok());
  EXPECT_EQ(out, CutBlock(volume->block, box).bytes);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(source->ReadNow(0, box, out, stop.get_token()).code(), StatusCode::kCancelled);
}

template <class T>
std::vector<T> ReadExactly(VolumeSource& source, const Box& box) {
  std::vector<T> samples(std::size_t(box.voxel_count()));
  const BoxRoom room = BoxRoom::Dense(box, reinterpret_cast<std::byte*>(samples.data()), true);
  EXPECT_TRUE(source.ReadNow(0, box, room).ok());
  return samples;
}

TEST(MemorySourceTest, ExactSamplesAreThoseOfTheFile) {
  auto volume = std::make_shared<Volume>();
  const Box box = {{1, 0, 0}, {3, 1, 1}};
  volume->description = {.geometry = {.size = {3, 1, 1}}, .type = ScalarType::kUint8, .mapping = {2, -256}};  // twice int8
  volume->block = MakeVoxelBlock(volume->description.geometry.bounds(), ScalarType::kUint8);
  std::ranges::copy(std::vector<int>{0, 127, 255}, volume->block.samples<std::uint8_t>());
  const auto of_bytes = MakeMemorySource(volume, {.file_type = "int8"});
  EXPECT_EQ(of_bytes->info().exact.type, SampleType::kInt8);
  EXPECT_EQ(of_bytes->info().exact.mapping, (ValueMapping{2, 0}));
  EXPECT_EQ(ReadExactly<std::int8_t>(*of_bytes, box), (std::vector<std::int8_t>{-1, 127}));
  EXPECT_EQ(MakeMemorySource(volume, {.file_type = "uint8"})->info().exact.type, SampleType::kUint8);

  volume->description = {.geometry = {.size = {3, 1, 1}}, .type = ScalarType::kUint16, .mapping = {1, -32768}};
  volume->block = MakeVoxelBlock(volume->description.geometry.bounds(), ScalarType::kUint16);
  EXPECT_EQ(ReadExactly<std::int16_t>(*MakeMemorySource(volume, {.file_type = "int16"}), box), (std::vector<std::int16_t>(2, -32768)));

  const auto exact = std::make_shared<ExactSamples>(ExactSamples{{SampleType::kUint64}, AlignedVector<std::byte>(24)});
  const std::vector<std::uint64_t> ids = {1, 12857642016, 12857642017};
  std::memcpy(exact->bytes.data(), ids.data(), 24);
  const auto of_ids = MakePartSource(MakeMemorySource(volume, {.file_type = "uint64"}, exact), 0, box);
  EXPECT_EQ(of_ids->info().exact.type, SampleType::kUint64);
  EXPECT_EQ(ReadExactly<std::uint64_t>(*of_ids, {{0, 0, 0}, {2, 1, 1}}), (std::vector<std::uint64_t>{12857642016, 12857642017}));
}

TEST(PartSourceTest, ItsVoxelsAreThoseOfTheBoxAndLieWhereTheyLay) {
  auto volume = std::make_shared<Volume>();
  VolumeGeometry& geometry = volume->description.geometry;
  geometry = {.size = {70, 5, 6}, .spacing = {1, 2, 3}, .orientation = {.world = World::kScene, .origin = {10, 20, 30}}};
  geometry.orientation.axes = {Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}};
  volume->block = MakeVoxelBlock(geometry.bounds(), ScalarType::kUint8);
  for (int i = 0; i < 70 * 5 * 6; ++i) volume->block.samples<std::uint8_t>()[i] = std::uint8_t(i % 251);
  const Box box = {{3, 1, 2}, {66, 4, 6}};
  const auto part = MakePartSource(MakeMemorySource(volume, {.format = "NRRD"}), 0, box);
  const VolumeGeometry& of_part = part->info().levels.at(0).description.geometry;
  EXPECT_EQ(of_part.size, box.size());
  EXPECT_EQ(of_part.ToWorld({1, 1, 1}), geometry.ToWorld({4, 2, 3}));
  EXPECT_EQ(part->info().levels[0].block, Min(Uniform(64), box.size()));
  AlignedVector<std::byte> out(2 * 3 * 4);
  ASSERT_TRUE(part->ReadNow(0, {{0, 0, 0}, {2, 3, 4}}, out).ok());
  EXPECT_EQ(out, CutBlock(volume->block, {{3, 1, 2}, {5, 4, 6}}).bytes);
}

}  // namespace
}  // namespace slabstream
