// Multi-pass shears as a renderer: analytic truth, the definition, and ray casting beside it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/renderers/shear/shear_parameters.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"
#include "tests/worker/renderers/shear/reference_shear.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support
using shear::Kernel;

constexpr unsigned kSeed = 51;
constexpr Kernel kKernels[] = {Kernel::kCatmullRom, Kernel::kMitchell, Kernel::kBSpline, Kernel::kLinear};

struct ShearOptions {
  double rate = 1;
  Kernel kernel = Kernel::kCatmullRom;
  int supersampling = 1;
};
FrameSetup ShearSetup(const Volume& volume, SetupOptions options, const ShearOptions& shear = {}) {
  options.renderer = FindRenderer("shear");
  FrameSetup setup = MakeSetup(volume, options);
  setup.parameters = {shear.rate, double(shear.kernel), double(shear.supersampling - 1)};
  return setup;
}

double RootMeanSquare(const LocalImage& a, const LocalImage& b) {
  const PixelBounds bounds = Union(a.bounds, b.bounds);
  double sum = 0;
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
    for (int x = bounds.x_begin; x < bounds.x_end; ++x) {
      const auto pa = PixelOf(a, x, y), pb = PixelOf(b, x, y);
      for (std::size_t c = 0; c < 4; ++c) sum += double(pa[c] - pb[c]) * double(pa[c] - pb[c]);
    }
  }
  return std::sqrt(sum / (4 * double(bounds.pixel_count())));
}

TEST(Shear, HomogeneousBlockLooksTheSameFromEverySide) {
  std::mt19937 random(kSeed);
  for (const Vec3 spacing : {Vec3{1, 1, 1}, Vec3{1, 1.5, 0.7}}) {
    for (const double rate : {1.0, 0.7, 3.0}) {
      SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " rate " << rate);
      const Volume block = MakeBlock({{26, 20, 24}, spacing});
      const auto setup = [&](const SetupOptions& options, int view) {
        return ShearSetup(block, options, {.rate = rate, .supersampling = 1 + view % 4});
      };
      // Rays shorter than 1.1 / rate may pass between samples.
      const std::vector<ViewParameters> views = RandomViews(Projection::kOrthographic, 6, random);
      ExpectOpacityOfLength(block, views, {.setup = setup, .least_length = 1.1 / rate});
    }
  }
}

TEST(Shear, AgreesWithTheDefinition) {
  std::mt19937 random(kSeed);
  int view = 0;
  for (const Kernel kernel : kKernels) {
    for (const int supersampling : {1, 2, 3}) {
      for (const ShadingModel model : {ShadingModel::kNone, ShadingModel::kPhong}) {
        const ScalarType type = std::array{ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}[std::size_t(view) % 3];
        const Volume volume = MakeBlobs({{15, 13, 14}, {1, 0.8, 1.3}}, type, kSeed + unsigned(view));
        SetupOptions options;
        options.view = RandomView(Projection::kOrthographic, random);
        options.view.zoom = std::array{0.4, 1.0, 5.0}[std::size_t(view) % 3];
        options.size = {26, 21};
        options.shading.model = model;
        const FrameSetup setup =
            ShearSetup(volume, options,
                       {.rate = std::array{1.0, 0.4, 2.5, 1.3}[std::size_t(view) % 4], .kernel = kernel, .supersampling = supersampling});
        ++view;
        SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " view " << view << " kernel " << int(kernel) << " supersampling "
                                          << supersampling << " shading " << int(model));
        const LocalImage fast = RenderWhole(volume, setup), definition = ReferenceShear(volume, setup);
        // A value at the border of two entries of the transfer function, or a gradient that nearly vanishes, may fall to either side.
        EXPECT_LT(RootMeanSquare(fast, definition), 2e-4);
        EXPECT_LT(LargestDifference(fast, definition), 0.02F);
      }
    }
  }
}

// Every pass reconstructs lines, and so does ray casting.
TEST(Shear, LinearFieldsAreReproduced) {
  std::mt19937 random(kSeed);
  const Volume volume =
      MakeVolume({{40, 44, 36}, {1, 0.8, 1.3}}, ScalarType::kFloat32, [](const Index3& v) { return 1.7 * v.x + 0.9 * v.y + 2.1 * v.z; });
  for (int view = 0; view < 8; ++view) {
    for (const Kernel kernel : kKernels) {
      SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " view " << view << " kernel " << int(kernel));
      SetupOptions options;
      options.view = RandomView(Projection::kOrthographic, random);
      options.view.zoom = 1;
      options.size = {128, 128};
      options.clipping.box = ClipBox{{25, 25, 25}, {75, 75, 75}, ClipUnit::kPercent};  // the border's nearest voxels are not linear
      options.transfer = Ramp(0.3);
      const FrameSetup cast = RaycastSetup(volume, options, 1);
      const LocalImage expected = RenderPicture(volume, cast);
      EXPECT_GT(PixelOf(expected, options.size.width / 2, options.size.height / 2)[3], 0.3F);
      const LocalImage sheared = RenderPicture(volume, ShearSetup(volume, options, {.kernel = kernel, .supersampling = 1 + view % 4}));
      EXPECT_LT(LargestDifference(sheared, expected), 2e-3F);
    }
  }
}

// One pixel a voxel, along an axis: samples are voxels.
TEST(Shear, IdentityShowsTheStoredSamples) {
  constexpr int kSide = 24;
  std::mt19937 random(kSeed);
  std::uniform_int_distribution<int> sample(0, 255);
  std::vector<int> slice(kSide * kSide);
  for (int& value : slice) value = sample(random);
  const Volume volume = MakeVolume({{kSide, kSide, kSide}, {1, 1, 1}}, ScalarType::kUint8,
                                   [&](const Index3& v) { return slice[std::size_t(v.x + kSide * v.z)]; });
  SetupOptions options;
  options.size = {kSide, kSide};
  options.view.zoom = std::sqrt(3.0);  // the ball round the volume against its side
  options.shading.model = ShadingModel::kNone;
  options.transfer.colors = {{0, {0, 0, 0}}, {255, {1, 1, 1}}};
  options.transfer.opacities = {{0, 1, 0.5, 0}, {255, 1, 0.5, 0}};
  for (const Kernel kernel : {Kernel::kCatmullRom, Kernel::kLinear}) {
    const LocalImage image = RenderPicture(volume, ShearSetup(volume, options, {.kernel = kernel}));
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const float expected = float(slice[std::size_t(x + kSide * (kSide - 1 - y))]) / 255;
        ASSERT_NEAR(PixelOf(image, x, y)[0], expected, 2e-3F) << "pixel " << x << ' ' << y;
        ASSERT_NEAR(PixelOf(image, x, y)[3], 1, 1e-5F);
      }
    }
  }
}

TEST(Shear, IsNearRayCastingOfSmoothVolumes) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeVolume({{40, 36, 44}, {1, 1, 1}}, ScalarType::kFloat32, [](const Index3& v) {
    return 100 + 35 * std::sin(0.3 * v.x + 1) + 35 * std::sin(0.25 * v.y + 0.1 * v.z) + 30 * std::cos(0.28 * v.z);
  });
  for (int view = 0; view < 6; ++view) {
    SetupOptions options;
    options.view = RandomView(Projection::kOrthographic, random);
    if (view >= 3) options.view = {.azimuth_degrees = 45.0 * view, .elevation_degrees = 35.26438968};
    options.size = {128, 128};
    options.view.zoom = 1;
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " view " << view);
    const LocalImage cast = RenderPicture(volume, RaycastSetup(volume, options, 1));
    EXPECT_LT(RootMeanSquare(RenderPicture(volume, ShearSetup(volume, options)), cast), 0.01);
  }
}

// With more beams and slices the passes interpolate less aslant.
TEST(Shear, SupersamplingApproachesASeparableKernel) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeBlobs({{30, 30, 30}, {1, 1, 1}}, ScalarType::kFloat32, 9);
  for (int view = 0; view < 4; ++view) {
    SetupOptions options;
    options.view = RandomView(Projection::kOrthographic, random);
    const auto picture = [&](int supersampling) {
      return RenderPicture(volume, ShearSetup(volume, options, {.supersampling = supersampling}));
    };
    const LocalImage finest = picture(4);
    EXPECT_LT(RootMeanSquare(picture(2), finest), RootMeanSquare(picture(1), finest)) << "seed " << kSeed << " view " << view;
  }
}

TEST(Shear, EveryKernelMakesOnePictureOfManyBoxes) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeBlobs({{41, 37, 33}, {1, 0.8, 1.3}}, ScalarType::kUint8, kSeed);
  for (int view = 0; view < 16; ++view) {
    SetupOptions options;
    options.view = RandomView(Projection::kOrthographic, random);
    options.view.zoom = std::array{0.3, 1.0, 4.0}[std::size_t(view) % 3];
    options.transfer = Ramp(0.6);
    if (view % 2 == 1) options.transfer.gradient_opacities = {{3, 0}, {20, 1}, {60, 0.3}};
    const ShearOptions shear = {.rate = std::array{1.0, 0.1, 3.0}[std::size_t(view / 2) % 3],
                                .kernel = kKernels[std::size_t(view) % 4],
                                .supersampling = 1 + view / 4 % 4};
    const FrameSetup setup = ShearSetup(volume, options, shear);
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " view " << view);
    const LocalImage one = RenderWhole(volume, setup);
    EXPECT_LE(LargestDifference(one, RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, 11, random))), 2e-5F);
    EXPECT_LE(LargestDifference(one, RenderByBoxes(volume, setup, CutIntoSlabs(volume, 13, kAxes[std::size_t(view) % 3]))), 2e-5F);
  }
}

TEST(Shear, HiddenTilesChangeNothingElse) {
  std::mt19937 random(kSeed);
  const Volume volume = MakeBlobs({{50, 45, 40}, {1, 1, 1}}, ScalarType::kUint8, kSeed);
  for (const double part : {0.3, 1.0}) {
    SetupOptions options;
    options.view = RandomView(Projection::kOrthographic, random);
    options.size = {90, 80};
    const FrameSetup setup = ShearSetup(volume, options);
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " part " << part);
    ExpectHiddenTilesChangeNothingElse(volume, setup, part, random);
  }
}

TEST(Shear, EmptyAndThinVolumesHavePictures) {
  for (const Index3 size : {Index3{1, 1, 1}, Index3{1, 40, 30}, Index3{33, 1, 2}, Index3{20, 20, 20}}) {
    for (const double value : {0.0, 100.0}) {
      const Volume volume = MakeVolume({size, {1, 1, 1}}, ScalarType::kUint8, [&](const Index3&) { return value; });
      SetupOptions options;
      options.view = {.azimuth_degrees = 30, .elevation_degrees = 20};
      options.transfer = Uniform(0.9, {1, 1, 1});
      for (const int supersampling : {1, 3}) {
        const LocalImage image = RenderPicture(volume, ShearSetup(volume, options, {.supersampling = supersampling}));
        float most = 0;
        for (int y = 0; y < 64; ++y) {
          for (int x = 0; x < 64; ++x) most = std::max(most, PixelOf(image, x, y)[3]);
        }
        EXPECT_EQ(most > 0, value > 0) << size.x << ' ' << size.y << ' ' << size.z;
      }
    }
  }
}

// A sample is empty if a voxel that it is made from is not finite; others do not change.
TEST(Shear, ValuesThatAreNotFiniteAreEmpty) {
  const Index3 size = {24, 24, 24};
  const Index3 hole = {12, 11, 13};
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const auto make = [&](double value) {
      return MakeVolume({size, {1, 1, 1}}, ScalarType::kFloat32, [&](const Index3& v) { return v == hole ? value : 100.0; });
    };
    SetupOptions options;
    options.view = {.azimuth_degrees = 25, .elevation_degrees = 40};
    options.transfer = Uniform(0.05, {1, 1, 1});
    const Volume broken = make(bad), sound = make(100);
    FrameSetup setup = ShearSetup(sound, options);
    const LocalImage with = RenderWhole(broken, setup), without = RenderWhole(sound, setup);
    int less = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const float a = PixelOf(with, x, y)[3], b = PixelOf(without, x, y)[3];
        ASSERT_TRUE(std::isfinite(a));
        ASSERT_LE(a, b + 1e-6F);
        less += a < b - 0.01F ? 1 : 0;
      }
    }
    EXPECT_GT(less, 0);
    EXPECT_LT(less, 200);
  }
}

}  // namespace
}  // namespace slabstream
