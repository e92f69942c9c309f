#include "data/sources/memory_source.h"

#include <gtest/gtest.h>

#include <vector>

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

}  // namespace
}  // namespace slabstream
