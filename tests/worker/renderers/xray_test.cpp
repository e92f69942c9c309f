// Radiographs: pixels are line integrals of attenuation, whatever the view and the partition; and what values attenuate.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/renderers/xray/attenuation.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support
using xray::Attenuating;
using xray::AttenuationOf;

constexpr double kWindow = 20, kEnergy = 60, kWater = 0.02059;  // of line integrals, keV, per mm

FrameSetup XraySetup(const Volume& volume, SetupOptions options, double samples_per_voxel = 1,
                     Attenuating attenuating = Attenuating::kHounsfield, bool dark = false) {
  options.renderer = FindRenderer("xray");
  FrameSetup setup = MakeSetup(volume, options);
  SetParameters({samples_per_voxel, kEnergy, double(attenuating), kWindow, kWindow / 2, double(dark)}, setup);
  return setup;
}

// Voxels in Hounsfield units.
Volume MakeCt(const VolumeGeometry& geometry, const std::function<double(const Index3&)>& hounsfield) {
  constexpr double kStored = 1024;
  Volume volume = MakeVolume(geometry, ScalarType::kUint16, [&](const Index3& v) { return hounsfield(v) + kStored; });
  volume.description.mapping = {.scale = 1, .offset = -kStored};
  return volume;
}

double IntegralAt(const LocalImage& picture, int x, int y) { return kWindow * double(PixelOf(picture, x, y)[0]); }

FrameSetup SetupOfRange(float least, float largest, Attenuating attenuating) {
  FrameSetup setup;
  SetRenderer(*FindRenderer("xray"), setup);
  setup.range = {least, largest};
  setup.parameters.at(xray::kEnergy) = kEnergy;
  setup.parameters.at(xray::kAttenuation) = double(attenuating);
  return setup;
}

TEST(Attenuation, OfWaterIsThatOfTheTable) {
  EXPECT_NEAR(xray::WaterAttenuation(60), 0.02059, 1e-9);
  EXPECT_NEAR(xray::WaterAttenuation(80), 0.01837, 1e-9);
  EXPECT_NEAR(xray::WaterAttenuation(70), 0.01929, 0.01 * 0.01929) << "Berger et al., XCOM";
  EXPECT_NEAR(xray::WaterAttenuation(xray::kLeastEnergy), 0.5329, 1e-9);
  EXPECT_NEAR(xray::WaterAttenuation(xray::kMostEnergy), 0.001813, 1e-9);
  for (double energy = 11; energy < xray::kMostEnergy; energy *= 1.1) {
    EXPECT_LT(xray::WaterAttenuation(energy), xray::WaterAttenuation(energy / 1.05)) << energy;
  }
}

TEST(Attenuation, OfHounsfieldUnitsIsThatOfWaterAtZero) {
  const auto attenuation = AttenuationOf(SetupOfRange(-1024, 3071, Attenuating::kHounsfield));
  EXPECT_EQ(attenuation.Of(-1000), 0);
  EXPECT_EQ(attenuation.Of(-1024), 0) << "nothing shines";
  EXPECT_NEAR(attenuation.Of(0), kWater, 1e-9);
  EXPECT_NEAR(attenuation.Of(1000), 2 * kWater, 1e-9);
}

TEST(Attenuation, OfARangeGrowsFromNothingToTwiceThatOfWater) {
  const auto attenuation = AttenuationOf(SetupOfRange(50, 150, Attenuating::kRange));
  EXPECT_EQ(attenuation.Of(50), 0);
  EXPECT_NEAR(attenuation.Of(100), kWater, 1e-9);
  EXPECT_NEAR(attenuation.Of(150), 2 * kWater, 1e-9);
  EXPECT_EQ(AttenuationOf(SetupOfRange(7, 7, Attenuating::kRange)).Of(7), 0) << "nothing stands out";
}

TEST(Attenuation, IsFoundFromTheValues) {
  EXPECT_NEAR(AttenuationOf(SetupOfRange(-1024, 1000, Attenuating::kAutomatic)).Of(0), kWater, 1e-9);
  EXPECT_NEAR(AttenuationOf(SetupOfRange(0, 200, Attenuating::kAutomatic)).Of(100), kWater, 1e-9);
}

TEST(Xray, IntegratesABlockFromEverySide) {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  const Volume volume = MakeCt({{60, 50, 40}, {1.2, 1, 1.5}}, [](const Index3&) { return 500; });
  for (int view = 0; view < 12; ++view) {
    SetupOptions options;
    options.view = RandomView(view % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, random);
    options.view.zoom = 1;
    options.size = {160, 160};
    const FrameSetup setup = XraySetup(volume, options, 8);
    ASSERT_EQ(setup.camera.supersample, 1);
    const LocalImage picture = RenderPicture(volume, setup);
    int compared = 0;
    for (int y = 0; y < picture.bounds.height(); y += 7) {
      for (int x = 0; x < picture.bounds.width(); x += 7) {
        const double length = LengthInside(setup, x, y);
        if (length < 15) continue;  // mm
        ++compared;
        EXPECT_NEAR(IntegralAt(picture, x, y), 1.5 * kWater * length, 0.01 * 1.5 * kWater * length) << "seed " << seed << " view " << view;
      }
    }
    EXPECT_GT(compared, 20) << "seed " << seed << " view " << view;
  }
}

// Interpolation spreads a voxel's attenuation over its neighbours and loses none, so one sample a voxel is enough.
TEST(Xray, IntegratesABlockInAirWithOneSampleAVoxel) {
  const Volume volume = MakeCt({{60, 60, 60}, {0.5, 0.5, 0.5}}, [](const Index3& v) {
    return std::min({v.x, v.y, v.z}) >= 10 && std::max({v.x, v.y, v.z}) < 50 ? 0 : -1000;
  });
  SetupOptions options;
  for (const double azimuth : {0.0, 20.0, 90.0, 200.0}) {
    options.view.azimuth_degrees = azimuth;
    const double length = 20 / std::cos((azimuth == 20 || azimuth == 200 ? 20 : 0) * M_PI / 180);  // mm
    const LocalImage picture = RenderPicture(volume, XraySetup(volume, options));
    EXPECT_NEAR(IntegralAt(picture, 32, 32), kWater * length, 0.01 * kWater * length) << azimuth;
  }
}

TEST(Xray, AddsWhatLiesOnARay) {
  const auto near = [](const Index3& v) { return v.y < 12; };
  const auto far = [](const Index3& v) { return v.y > 30; };
  const VolumeGeometry geometry{{40, 45, 30}, {1, 1, 1}};
  const Volume first = MakeCt(geometry, [&](const Index3& v) { return near(v) ? 300 : -1000; });
  const Volume second = MakeCt(geometry, [&](const Index3& v) { return far(v) ? 900 : -1000; });
  const Volume both = MakeCt(geometry, [&](const Index3& v) { return near(v) ? 300 : far(v) ? 900 : -1000; });
  for (const Projection projection : kProjections) {
    SetupOptions options;
    options.view = {.projection = projection, .azimuth_degrees = 25, .elevation_degrees = 15};
    const LocalImage a = RenderPicture(first, XraySetup(first, options)), b = RenderPicture(second, XraySetup(second, options));
    const LocalImage sum = RenderPicture(both, XraySetup(both, options));
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) EXPECT_NEAR(IntegralAt(sum, x, y), IntegralAt(a, x, y) + IntegralAt(b, x, y), 1e-4);
    }
    EXPECT_GT(IntegralAt(sum, 32, 32), 0.5);
  }
}

TEST(Xray, AllPartitionsMakeTheSameBits) {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  for (const Projection projection : kProjections) {
    for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
      const Volume volume = MakeBlobs({{44, 38, 41}, {1, 0.8, 1.2}}, type, seed);
      SetupOptions options;
      options.view = RandomView(projection, random);
      const FrameSetup setup = XraySetup(volume, options, 1, Attenuating::kAutomatic);
      const LocalImage one = RenderPicture(volume, setup);
      const LocalImage many = FinishPicture(RenderByBoxes(volume, setup, CutAtRandom(volume.block.box, 7, random)), setup);
      EXPECT_EQ(LargestDifference(one, many), 0) << "seed " << seed << " type " << int(type);
    }
  }
}

// Opaque where rays meet the volume, in grey.
TEST(Xray, IsBrightOrDark) {
  const Volume volume = MakeCt({{30, 30, 30}, {4, 4, 4}}, [](const Index3&) { return 2000; });
  const LocalImage bright = RenderPicture(volume, XraySetup(volume, {}));
  const LocalImage dark = RenderPicture(volume, XraySetup(volume, {}, 1, Attenuating::kHounsfield, true));
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto pixel = PixelOf(bright, x, y), inverse = PixelOf(dark, x, y);
      EXPECT_EQ(pixel, (std::array{pixel[0], pixel[0], pixel[0], pixel[3]}));
      EXPECT_EQ(inverse[3], pixel[3]);
      EXPECT_NEAR(inverse[0], pixel[3] - pixel[0], 1e-6F);
    }
  }
  EXPECT_EQ(PixelOf(bright, 0, 0)[3], 0);
  EXPECT_EQ(PixelOf(bright, 32, 32)[3], 1);
  EXPECT_GT(PixelOf(bright, 32, 32)[0], 0.3F);
}

TEST(Xray, ShowsTheLargestIntegralWhiteWithoutAWindow) {
  for (const double hounsfield : {-990.0, 0.0, 3000.0}) {
    const Volume volume = MakeCt({{30, 30, 30}, {1, 1, 1}}, [&](const Index3& v) { return v.x < 15 ? hounsfield : -1000; });
    FrameSetup setup = XraySetup(volume, {});
    SetParameters({1, kEnergy, double(Attenuating::kHounsfield), 0, 0, 0}, setup);
    const LocalImage picture = RenderPicture(volume, setup);
    EXPECT_NEAR(PixelOf(picture, 28, 32)[0], 1, 1e-6) << hounsfield;
    EXPECT_NEAR(PixelOf(picture, 36, 32)[0], 0, 1e-6) << hounsfield;
  }
  const Volume air = MakeCt({{30, 30, 30}, {1, 1, 1}}, [](const Index3&) { return -1000; });
  FrameSetup setup = XraySetup(air, {});
  SetParameters({1, kEnergy, double(Attenuating::kHounsfield), 0, 0, 0}, setup);
  EXPECT_EQ(PixelOf(RenderPicture(air, setup), 32, 32), (std::array{0.0F, 0.0F, 0.0F, 1.0F}));
}

}  // namespace
}  // namespace slabstream
