// Intensity projections as a renderer: what a pixel shows, in every mode, and that no partition changes a bit of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "common/kernels/combine.h"
#include "common/renderers/mip/projection_mode.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support
using mip::ProjectionMode;

constexpr ProjectionMode kModes[] = {ProjectionMode::kMaximum, ProjectionMode::kMinimum, ProjectionMode::kMean};

FrameSetup ProjectionSetup(const Volume& volume, SetupOptions options, ProjectionMode mode, double samples_per_voxel = 1) {
  options.renderer = FindRenderer("mip");
  FrameSetup setup = MakeSetup(volume, options);
  SetParameters({samples_per_voxel, double(mode), 0}, setup);
  return setup;
}

// Opacity is the value by 200, colour is white.
TransferFunction Gray() {
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0, 0.5, 0}, {200, 1, 0.5, 0}};
  return transfer;
}

TEST(Mip, AllPartitionsMakeTheSameBits) {
  const unsigned seed = 3;
  std::mt19937 random(seed);
  for (const ProjectionMode mode : kModes) {
    for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
      for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
        const Volume volume = MakeBlobs({{44, 38, 41}, {1, 0.8, 1.2}}, type, seed);
        SetupOptions options;
        options.view = RandomView(projection, random);
        const FrameSetup setup = ProjectionSetup(volume, options, mode);
        const LocalImage one = RenderPicture(volume, setup);
        const LocalImage many = FinishPicture(RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, 7, random)), setup);
        EXPECT_EQ(LargestDifference(one, many), 0) << "seed " << seed << " mode " << int(mode) << " type " << int(type);
      }
    }
  }
}

// A ray along y through a row of known values: the centre of the picture looks along +y.
TEST(Mip, ShowsTheExtremeOrTheMeanOfItsRay) {
  const Volume volume = MakeVolume({{16, 16, 16}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3& v) {
    return v.y == 5 ? 180 : v.y == 11 ? 20 : v.y == 0 ? 0 : v.y == 15 ? 200 : 100;
  });
  SetupOptions options;
  options.transfer = Gray();
  const auto alpha = [&](ProjectionMode mode) {
    return PixelOf(RenderPicture(volume, ProjectionSetup(volume, options, mode, 16)), 32, 32)[3];
  };
  EXPECT_NEAR(alpha(ProjectionMode::kMaximum), 1, 0.02);
  EXPECT_NEAR(alpha(ProjectionMode::kMinimum), 0, 0.02);
  EXPECT_NEAR(alpha(ProjectionMode::kMean), 0.5, 0.02);
  EXPECT_EQ(PixelOf(RenderPicture(volume, ProjectionSetup(volume, options, ProjectionMode::kMinimum)), 1, 1)[3], 0);
}

// A voxel without a value leaves a hole of its own size, and what lies beside it stays.
TEST(Mip, AMissingVoxelIsAHoleOfOneVoxel) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Volume volume = MakeVolume({{16, 16, 16}, {1, 1, 1}}, ScalarType::kFloat32, [&](const Index3& v) {
    return v == Index3{8, 8, 8} || v.y < 4 || v.y > 9 ? nan : 200.0F;
  });
  for (const double interpolation : {0.0, 1.0}) {
    for (const ProjectionMode mode : kModes) {
      for (const int slice : {3, 4, 7, 8, 9, 10}) {
        SetupOptions options;
        options.renderer = FindRenderer("mip");
        options.transfer = Gray();
        options.size = {128, 128};
        options.clipping.slab = ClipSlab{.normal = {0, 1, 0}, .index = slice};
        FrameSetup setup = MakeSetup(volume, options);
        SetParameters({1, double(mode), interpolation}, setup);
        const LocalImage picture = RenderPicture(volume, setup);
        double area = 0;  // of the picture's pixels that show a value
        for (int y = 0; y < 128; ++y) {
          for (int x = 0; x < 128; ++x) area += PixelOf(picture, x, y)[3] > 0 ? 1 : 0;
        }
        const double pixel = setup.camera.PixelSizeAt(1), whole = 16 * 16;
        const double expected = slice < 4 || slice > 9 ? 0 : slice == 8 ? whole - 1 : whole;
        EXPECT_NEAR(area * pixel * pixel, expected, slice == 8 ? 0.6 : 6) << slice << ' ' << interpolation << ' ' << int(mode);
      }
    }
  }
}

// Where data values fall as stored samples rise, the largest value is that of the least sample.
TEST(Mip, ProjectsDataValues) {
  Volume rising = MakeBlobs({{30, 30, 30}, {1, 1, 1}}, ScalarType::kUint8, 4), falling = rising;
  falling.description.mapping = {.scale = -1, .offset = 200};
  for (std::byte& sample : falling.block.bytes) sample = std::byte(200 - int(sample));
  SetupOptions options;
  options.transfer = Gray();
  for (const ProjectionMode mode : kModes) {
    const LocalImage a = RenderPicture(rising, ProjectionSetup(rising, options, mode));
    const LocalImage b = RenderPicture(falling, ProjectionSetup(falling, options, mode));
    EXPECT_LE(LargestDifference(a, b), 2e-4F) << "mode " << int(mode);
  }
}

// ---- several fields

// Volumes of a picture: the frame's, and those of FrameSetup::fields.
struct Fields {
  Volume volume;
  std::vector<Volume> others;
  FrameSetup setup;

  void Show(Volume field, TransferFunction transfer) {
    FieldLook look = {.transfer = std::move(transfer), .range = Summarize(field).range};
    setup.fields.push_back({.levels = {{DatasetId(2 + others.size()), field.description, {}}}, .of_volume = {0}, .look = std::move(look)});
    others.push_back(std::move(field));
  }
};

Result<LocalImage> Projected(const Fields& fields, const Box& box) {
  const auto volume = CutBox(fields.volume, PaddedBox(box, fields.setup));
  std::vector<std::unique_ptr<BoxData>> data;
  std::vector<BoxData*> others;
  for (std::size_t i = 0; i < fields.others.size(); ++i) {
    const Box there = PaddedBox(box, fields.setup, fields.setup.fields[i]);
    data.push_back(there.empty() ? nullptr : CutBox(fields.others[i], there));
    others.push_back(data.back().get());
  }
  volume->SetFields(std::move(others));
  RankReport report;
  return MakeRenderer(*fields.setup.renderer)->Render(*volume, box, fields.setup, {}, RenderControl(), report);
}
LocalImage PictureOf(const Fields& fields) {
  return FinishPicture(Projected(fields, fields.volume.description.geometry.bounds()).value(), fields.setup);
}

TransferFunction Colored(Rgb color) {
  TransferFunction transfer = Gray();
  transfer.colors = {{0, color}};
  return transfer;
}

// On the volume's grid, and on one that is turned and reaches only partly; with holes.
Fields RandomFields(ProjectionMode mode, unsigned seed, std::mt19937& random) {
  SetupOptions options;
  options.view = RandomView(seed % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, random);
  options.transfer = Colored({1, 0, 0});
  Volume volume = MakeBlobs({{24, 28, 21}, {1, 0.8, 1.2}}, ScalarType(1 + seed % 3), seed);
  const VolumeGeometry grid = volume.description.geometry;
  FrameSetup setup = ProjectionSetup(volume, options, mode);
  Fields fields = {std::move(volume), {}, std::move(setup)};
  fields.Show(MakeBlobs(grid, ScalarType::kUint16, seed + 1), Colored({0, 1, 0}));
  VolumeGeometry turned = {{15, 30, 12}, {0.7, 1.1, 1.5}, {}};
  turned.orientation.axes = {Vec3{0.6, 0.8, 0}, Vec3{-0.8, 0.6, 0}, Vec3{0, 0, 1}};
  turned.orientation.origin = {10, -3, 4};
  Volume holes = MakeBlobs(turned, ScalarType::kFloat32, seed + 2);
  for (std::int64_t i = 0; i < holes.block.box.voxel_count(); i += 7) {
    holes.block.samples<float>()[i] = std::numeric_limits<float>::quiet_NaN();
  }
  fields.Show(std::move(holes), Colored({0, 0, 1}));
  fields.Show(MakeBlobs(grid, ScalarType::kUint8, seed + 3), Colored({0.5, 0.5, 0}));
  return fields;
}

TEST(MipOfFields, AllPartitionsMakeTheSameBits) {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  for (const ProjectionMode mode : {ProjectionMode::kMaximum, ProjectionMode::kMinimum}) {
    for (unsigned i = 0; i < 6; ++i) {
      const Fields fields = RandomFields(mode, seed + i, random);
      const Partition partition = CutAtRandom(fields.volume.block.box, 5, random);
      LocalImage frame = MakeLocalImage(fields.setup.format, {});
      for (const Box& box : partition.boxes()) Combine(frame, Projected(fields, box).value(), Side::kBack);
      EXPECT_EQ(LargestDifference(FinishPicture(frame, fields.setup), PictureOf(fields)), 0) << "seed " << seed << " case " << i;
    }
  }
}

// The picture is what the fields' own pictures add up to.
TEST(MipOfFields, AddTheColoursOfEachFieldsLargestValue) {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  for (unsigned i = 0; i < 4; ++i) {
    const Fields all = RandomFields(ProjectionMode::kMaximum, seed + i, random);
    const LocalImage picture = PictureOf(all);
    std::vector<LocalImage> single;
    for (std::size_t shown = 0; shown < 4; ++shown) {
      Fields one = all;
      for (std::size_t other = 0; other < 4; ++other) {
        if (other != shown) (other == 0 ? one.setup.transfer : one.setup.fields[other - 1].look.transfer).opacities = {{0, 0, 0.5, 0}};
      }
      single.push_back(PictureOf(one));
    }
    int colored = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        std::array<double, 4> expected = {0, 0, 0, 1};
        for (const LocalImage& one : single) {
          for (std::size_t c = 0; c < 3; ++c) expected.at(c) += double(PixelOf(one, x, y).at(c));
          expected[3] *= 1 - double(PixelOf(one, x, y)[3]);
        }
        const auto pixel = PixelOf(picture, x, y);
        for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(pixel.at(c), std::min(expected.at(c), 1.0), 1e-5) << x << ' ' << y << " case " << i;
        ASSERT_NEAR(pixel[3], 1 - expected[3], 1e-5);
        colored += pixel[0] > 0.1F && pixel[1] > 0.1F && pixel[2] > 0.1F ? 1 : 0;
      }
    }
    EXPECT_GT(colored, 20);
  }
}

TEST(MipOfFields, AChannelLooksAsItDoesAlone) {
  const VolumeGeometry grid = {{24, 28, 21}, {1, 0.8, 1.2}};
  const Volume clear = MakeVolume(grid, ScalarType::kUint8, [](const Index3&v) { return v.x; }),
               channel = MakeBlobs(grid, ScalarType::kUint16, 3);
  SetupOptions options;
  options.transfer = Gray();
  const LocalImage alone = RenderPicture(channel, ProjectionSetup(channel, options, ProjectionMode::kMaximum));
  options.transfer.opacities = {{0, 0, 0.5, 0}};
  Fields fields = {clear, {}, ProjectionSetup(clear, options, ProjectionMode::kMaximum)};
  fields.Show(channel, Gray());
  EXPECT_LE(LargestDifference(PictureOf(fields), alone), 1e-5F);
}

TEST(MipOfFields, RefusesMoreThanFourAndTheMean) {
  const Volume volume = MakeBlock({{8, 8, 8}});
  const Box all = volume.block.box;
  Fields mean = {volume, {}, ProjectionSetup(volume, {}, ProjectionMode::kMean)};
  mean.Show(volume, Gray());
  EXPECT_EQ(Projected(mean, all).status().code(), StatusCode::kInvalidArgument);
  Fields many = {volume, {}, ProjectionSetup(volume, {}, ProjectionMode::kMaximum)};
  for (int i = 0; i < 4; ++i) many.Show(volume, Gray());
  EXPECT_THAT(Projected(many, all).status().message(), ::testing::HasSubstr("at most 4 fields, not 5"));
}

}  // namespace
}  // namespace slabstream
