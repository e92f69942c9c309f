#include <gtest/gtest.h>

#include <limits>

#include "tests/common/kernels/nearest_reference.h"
#include "tests/support/random_image.h"
#include "tests/support/simd_targets.h"

namespace slabstream {
namespace {

TargetPixels PixelsOf(LocalImage& image, std::size_t first) {
  return {image.rgba.data() + 4 * first, image.depth.data() + first, image.voxel.data() + first};
}

TEST(NearestRow, EveryInstructionSetGivesTheBitsOfTheReference) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  ForEachTarget([&] {
    for (std::int32_t count = 0; count <= 70; ++count) {
      for (const std::size_t shift : {0U, 1U, 3U}) {
        const PixelBounds bounds = {0, 0, count + std::int32_t(shift) + 1, 1};
        LocalImage source = RandomImage(random, PixelFormat::kDepth, bounds), target = RandomImage(random, PixelFormat::kDepth, bounds);
        const int kind = random.Integer(0, 3);  // mixed; all farther; all nearer; ties, with voxels that wrap around
        for (std::size_t i = 0; i < source.depth.size(); ++i) {
          if (kind == 1) source.depth[i] = std::numeric_limits<float>::infinity();
          if (kind == 2) source.depth[i] = 0.5F;
          if (kind == 3) {
            source.depth[i] = target.depth[i] = 2;
            source.voxel[i] = std::uint32_t(random.Integer(0, 4)) - 2;
            target.voxel[i] = std::uint32_t(random.Integer(0, 4)) - 2;
          }
        }
        LocalImage expected = target;
        const TargetPixels from = PixelsOf(source, shift);
        testing::NearestRowReference({from.rgba, from.depth, from.voxel}, PixelsOf(expected, shift), std::size_t(count));
        NearestRow({from.rgba, from.depth, from.voxel}, PixelsOf(target, shift), std::size_t(count));
        ASSERT_EQ(target.rgba, expected.rgba) << count << " pixels, shift " << shift;
        ASSERT_EQ(target.depth, expected.depth);
        ASSERT_EQ(target.voxel, expected.voxel);
      }
    }
  });
}

}  // namespace
}  // namespace slabstream
