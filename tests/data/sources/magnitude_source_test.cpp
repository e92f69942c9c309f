#include "data/sources/magnitude_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <vector>

#include "tests/data/sources/memory_source.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

TEST(MagnitudeSourceTest, IsTheRootOfTheSumOfSquaresInAnyBox) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (const std::size_t count : {2U, 3U}) {
    std::vector<std::shared_ptr<const Volume>> volumes;
    std::vector<std::shared_ptr<VolumeSource>> components;
    for (const ScalarType type : std::vector{ScalarType::kUint8, ScalarType::kFloat32, ScalarType::kUint16}) {
      if (volumes.size() == count) break;
      Volume volume = RandomVolume(random, {19, 7, 5}, type);
      volume.description.mapping = {.scale = -0.5 * double(volumes.size() + 1), .offset = 3};
      volumes.push_back(std::make_shared<const Volume>(std::move(volume)));
      components.push_back(MakeMemorySource(volumes.back(), {.format = "test", .channels = std::vector<FieldInfo>(count)}));
    }
    const auto magnitude = MagnitudeOf(components);
    EXPECT_EQ(magnitude->info().finest().type, ScalarType::kFloat32);
    EXPECT_TRUE(magnitude->info().channels.empty());
    const Box box = {{2, 1, 0}, {18, 6, 4}};
    std::vector<float> read(std::size_t(box.voxel_count()));
    ASSERT_TRUE(magnitude->ReadNow(0, box, std::as_writable_bytes(std::span(read))).ok());
    const Result<LevelInMemory> whole = magnitude->ReadLevel(0);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    std::size_t at = 0;
    for (Index3 v = box.begin; v.z < box.end.z; ++v.z) {
      for (v.y = box.begin.y; v.y < box.end.y; ++v.y) {
        for (v.x = box.begin.x; v.x < box.end.x; ++v.x, ++at) {
          double squares = 0;
          for (const auto& volume : volumes) {
            const double value = VisitScalarType(volume->block.type, [&]<class T>(const T*) {
              return volume->description.mapping.FromStored(double(volume->block.samples<T>()[volume->block.Offset(v)]));
            });
            squares += value * value;
          }
          ASSERT_EQ(read[at], float(std::sqrt(squares)));
          ASSERT_EQ(whole->volume->block.samples<float>()[whole->volume->block.Offset(v)], read[at]);
        }
      }
    }
  }
}

TEST(MagnitudeSourceTest, AReadThatIsStoppedEndsOnce) {
  Random random(62);
  const auto volume = std::make_shared<const Volume>(RandomVolume(random, {9, 9, 9}, ScalarType::kUint8));
  const auto magnitude = MagnitudeOf(std::vector(3, MakeMemorySource(volume, {.format = "test"})));
  std::vector<std::byte> out(9 * 9 * 9 * 4);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(magnitude->ReadNow(0, volume->block.box, out, stop.get_token()).code(), StatusCode::kCancelled);
}

}  // namespace
}  // namespace slabstream
