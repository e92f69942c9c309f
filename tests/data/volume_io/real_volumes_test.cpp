// Real scans and simulations, where they are at hand: a folder of test volumes, which SLABSTREAM_SHARED_VOLUMES names, and the MRI brain of
// Debian's mricron-data.
#include <gtest/gtest.h>

#include <filesystem>

#include "common/volume/summary.h"
#include "data/open/read_volume.h"
#include "tests/data/volume_io/volume_files.h"

namespace slabstream {
namespace {

TEST(RealVolumes, HaveTheSizesRangesAndOccupanciesThatAreKnown) {
  const std::string folder = SharedVolumes();
  if (folder.empty()) GTEST_SKIP() << "set SLABSTREAM_SHARED_VOLUMES to a folder of volumes";
  const struct {
    const char* name;
    Index3 size;
    ScalarType type;
    ValueRange range;
    Vec3 spacing;
    double above, occupancy;  // share of voxels with values above
  } known[] = {
      {"ct_head_visible_male", {128, 256, 256}, ScalarType::kUint8, {1, 254}, {1.57774, 0.995861, 1.00797}, 40, 0.4284},
      {"mr_brain_unc", {256, 256, 109}, ScalarType::kUint8, {0, 255}, {1, 1, 1.54}, 28, 0.1807},
      {"ct_bonsai", {256, 256, 256}, ScalarType::kUint8, {0, 255}, {1, 1, 1}, 20, 0.131},
      {"cta_vessels_avm", {337, 319, 154}, ScalarType::kUint8, {0, 255}, {0.5469, 0.5469, 1}, 0, 0.024},
      {"ct_tooth", {103, 94, 161}, ScalarType::kUint16, {0, 1300}, {1, 1, 1}, 500, 0.273},
      {"sim_heptane", {302, 302, 302}, ScalarType::kUint8, {0, 255}, {1, 1, 1}, 0, 0.223},
      {"sim_smoke", {111, 222, 112}, ScalarType::kFloat32, {0, 5.71484375F}, {0.47619, 0.47619, 0.47619}, 0.01, 0.222},
  };
  for (const auto& volume : known) {
    SCOPED_TRACE(volume.name);
    const Result<LoadedVolume> loaded = ReadVolume(folder + "/" + volume.name + ".nrrd");
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    const VolumeDescription& description = loaded->info.finest();
    EXPECT_EQ(description.geometry.size, volume.size);
    EXPECT_EQ(description.type, volume.type);
    for (const Axis axis : kAxes) EXPECT_NEAR(description.geometry.spacing[axis], volume.spacing[axis], 1e-4);
    EXPECT_EQ(Summarize(*loaded->volume).range, volume.range);
    const double share = VisitScalarType(description.type, [&]<class T>(const T*) {
      const T* samples = loaded->volume->block.samples<T>();
      const std::int64_t count = description.geometry.bounds().voxel_count();
      return double(std::count_if(samples, samples + count, [&](T sample) { return double(sample) > volume.above; })) / double(count);
    });
    EXPECT_NEAR(share, volume.occupancy, 0.0006);
  }
}

TEST(RealVolumes, TheDemoBrainIsEightBitAndSkullStripped) {
  const std::string path = "/usr/share/mricron/templates/ch2better.nii.gz";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no file " << path << ": install mricron-data";
  const Result<LoadedVolume> loaded = ReadVolume(path);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->info.format, "NIfTI");
  EXPECT_EQ(loaded->info.finest().geometry.size, (Index3{301, 370, 316}));
  EXPECT_EQ(loaded->info.finest().geometry.spacing, (Vec3{0.5, 0.5, 0.5}));
  EXPECT_EQ(loaded->info.finest().type, ScalarType::kUint8);
  const VolumeSummary summary = Summarize(*loaded->volume);
  EXPECT_EQ(summary.range, (ValueRange{0, 130}));
  EXPECT_NEAR(double(summary.histogram[0]) / double(summary.description.geometry.bounds().voxel_count()), 0.63, 0.005);
}

}  // namespace
}  // namespace slabstream
