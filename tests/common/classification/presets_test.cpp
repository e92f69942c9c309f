#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "common/classification/classification_table.h"
#include "common/classification/color_maps.h"
#include "common/classification/histogram_analysis.h"
#include "common/classification/transfer_function.h"
#include "common/volume/sphere.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

// A ball of tissue (around 90) with a bright core (200) in air (around 5), all noisy.
Volume NoisyHead(Random& random, ScalarType type, double scale = 1) {
  return MakeTestVolume({48, 48, 48}, type, [&random, scale](const Index3& v) {
    const double radius = Length(ToVec3(v) - Vec3{23.5, 23.5, 23.5});
    return scale * ((radius < 6 ? 200 : radius < 18 ? 90 : 5) + random.Real(-4, 4));
  });
}

double OpacityAt(const TransferFunction& transfer, double value) { return transfer.Opacity(value); }

TEST(Presets, AreValidAndNamedOnceEach) {
  std::vector<std::string_view> names;
  for (const TransferPreset& info : TransferPresets()) {
    EXPECT_THAT(names, testing::Not(testing::Contains(info.name)));
    names.push_back(info.name);
    EXPECT_FALSE(info.purpose.empty());
  }
  EXPECT_GE(names.size(), 7U);
  EXPECT_THAT(names, testing::Contains("auto"));
}

// Published colours of the maps: their ends and one between.
TEST(Presets, ColourMapsSpanWhatShows) {
  const VolumeSummary summary = Summarize(MakeTestVolume({64, 64, 64}, ScalarType::kUint8, [](const Index3& v) { return 2 * v.x; }));
  const std::vector<OpacityPoint> shown = MakePreset("auto", summary)->opacities;
  const struct {
    const char* name;
    std::array<std::uint32_t, 3> codes;  // at 0, 1/2 and 1
  } cases[] = {{"grey", {0x000000, 0x808080, 0xffffff}},     {"viridis", {0x440154, 0x21918c, 0xfde725}},
               {"magma", {0x000004, 0xb73779, 0xfcfdbf}},    {"plasma", {0x0d0887, 0xcc4778, 0xf0f921}},
               {"cividis", {0x00224e, 0x7d7c78, 0xfee838}},  {"turbo", {0x30123b, 0xa4fc3c, 0x7a0403}},
               {"coolwarm", {0x3b4cc0, 0xdddddd, 0xb40426}}, {"jet", {0x000080, 0x80ff80, 0x800000}}};
  for (const auto& [name, codes] : cases) {
    const TransferFunction transfer = MakePreset(name, summary).value();
    const double least = transfer.colors.front().value, most = transfer.colors.back().value;
    EXPECT_NEAR(least, 3, 2) << name;
    EXPECT_NEAR(most, 123, 2) << name;
    for (int i = 0; i < 3; ++i) {
      const Rgb color = transfer.Color(std::lerp(least, most, 0.5 * i));
      EXPECT_NEAR(color.r, (codes[std::size_t(i)] >> 16) / 255.0, 0.01) << name << i;
      EXPECT_NEAR(color.g, (codes[std::size_t(i)] >> 8 & 0xFF) / 255.0, 0.01) << name << i;
      EXPECT_NEAR(color.b, (codes[std::size_t(i)] & 0xFF) / 255.0, 0.01) << name << i;
    }
    EXPECT_EQ(transfer.opacities, shown) << name;
  }
  for (const ColorMap& map : NamedColorMaps()) {
    EXPECT_FALSE(map.source.empty()) << map.name;
    EXPECT_EQ(map.points.front().at, 0);
    EXPECT_EQ(map.points.back().at, 1);
  }
}

TEST(Presets, OfAnUnknownNameListTheNamesThereAre) {
  const Status status = MakePreset("ct-bones", Summarize(MakeSphere({}).value())).status();
  EXPECT_EQ(status.code(), StatusCode::kNotFound);
  EXPECT_THAT(status.message(),
              testing::AllOf(testing::HasSubstr("'ct-bones'"), testing::HasSubstr("ct-bone,"), testing::HasSubstr("auto")));
}

// Whatever the histogram: the function is valid and does not depend on anything but the summary.
TEST(Presets, AreValidForEveryHistogram) {
  Random random(8);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 400; ++i) {
    VolumeSummary summary;
    summary.description = {{{64, 64, 64}, {1, 1, 1}}, ScalarType::kFloat32, {}};
    const double centre = random.Real(-1, 1) * std::pow(10, random.Real(-3, 37)),
                 width = random.Chance(0.1) ? 0 : std::pow(10, random.Real(-6, 37));
    summary.range = {float(centre - width), float(centre + width)};
    const int filled = random.Integer(0, kHistogramBins);
    for (int n = 0; n < filled; ++n) {
      summary.histogram[random.Integer<std::size_t>(0, kHistogramBins - 1)] = random.Integer<std::uint64_t>(0, 1) << random.Integer(0, 40);
    }
    for (const TransferPreset& info : TransferPresets()) {
      const Result<TransferFunction> transfer = MakePreset(info.name, summary);
      ASSERT_TRUE(transfer.ok());
      EXPECT_TRUE(Validate(*transfer).ok()) << info.name << ": " << Validate(*transfer).message();
      EXPECT_EQ(*transfer, *MakePreset(info.name, summary));
      EXPECT_EQ(!transfer->regions.empty(), info.has_regions) << info.name;
    }
  }
}

TEST(Presets, ForAHeadShowTissueAndLeaveAirOut) {
  Random random(9);
  SCOPED_TRACE(random.trace());
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    const double scale = type == ScalarType::kFloat32 ? 0.01 : 1;
    const VolumeSummary summary = Summarize(NoisyHead(random, type, scale));
    const double ball = 4.0 / 3 * 3.14159 * 18 * 18 * 18 / (48 * 48 * 48);
    for (const char* name : {"auto", "mri-brain"}) {
      const TransferFunction transfer = MakePreset(name, summary).value();
      EXPECT_EQ(OpacityAt(transfer, 5 * scale), 0) << name << ": air";
      EXPECT_GT(OpacityAt(transfer, 90 * scale), 0.01) << name << ": tissue";
      EXPECT_GE(OpacityAt(transfer, 200 * scale), OpacityAt(transfer, 90 * scale)) << name << ": core";
      EXPECT_NEAR(EstimateOccupancy(summary, transfer), ball, 0.03) << name;
    }
    const double tissue = OpacityAt(MakePreset("mri-brain", summary).value(), 90 * scale);
    EXPECT_GT(std::pow(1 - tissue, 2), 0.02) << "soft: not solid within two voxels";
    EXPECT_LT(std::pow(1 - tissue, 10), 0.02) << "solid within ten";
  }
}

TEST(Presets, ForAWholeHeadShowTheBrainThroughTheSkin) {
  Random random(10);
  SCOPED_TRACE(random.trace());
  constexpr double kFat = 190, kBrain = 95, kFluid = 40, kAir = 4;
  const Volume head = MakeTestVolume({128, 128, 128}, ScalarType::kUint8, [&](const Index3& v) {
    const double r = Length(ToVec3(v) - Vec3{63.5, 63.5, 63.5});
    return (r > 60 ? kAir : r > 58 ? kFat : r > 54 ? kFluid : kBrain) + random.Real(-3, 3) * (r > 60 ? 1 : 4);
  });
  const TransferFunction transfer = MakePreset("mri-head", Summarize(head)).value();
  EXPECT_EQ(OpacityAt(transfer, kAir), 0);
  EXPECT_GT(OpacityAt(transfer, kFat), 0) << "a veil";
  EXPECT_GT(std::pow(1 - OpacityAt(transfer, kFat), 5), 0.6) << "the scalp, of five voxels, lets most of the light through";
  EXPECT_GT(std::pow(1 - OpacityAt(transfer, kFluid), 5), 0.9);
  EXPECT_LT(std::pow(1 - OpacityAt(transfer, kBrain), 20), 0.5) << "the brain hides what is behind it";
}

TEST(InDataValues, TakesPercentilesOfTheMaterial) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  const VolumeSummary summary = Summarize(NoisyHead(random, ScalarType::kUint8));  // air 5, tissue 90, a small core of 200
  const auto range = [&](double low, double high) { return InDataValues({low, high, true}, summary); };
  EXPECT_NEAR(range(5, 95).min, 90, 6) << "air does not count";
  EXPECT_NEAR(range(5, 90).max, 90, 6);
  EXPECT_NEAR(range(5, 99.5).max, 200, 6);
  EXPECT_LT(range(0, 100).min, range(50, 100).min);
  EXPECT_EQ(InDataValues({3, 7}, summary), (ScalarRange{3, 7})) << "data values stay";
  const TransferFunction ramp = Stretched(MakePreset("gray-ramp", summary).value(), range(5, 90));
  EXPECT_GT(OpacityAt(ramp, 97), 0.99);
  EXPECT_LT(OpacityAt(ramp, 60), 0.01);
}

TEST(AutoPreset, ShowsWhatLiesBelowTheBackgroundToo) {
  // Swirls of both signs in still air, and a block of low values in a high background.
  const Volume swirls = MakeTestVolume({32, 32, 32}, ScalarType::kFloat32,
                                       [](const Index3& v) { return v.x < 8 ? std::sin(v.y * 0.3) * std::cos(v.z * 0.2) : 0; });
  const TransferFunction both = MakePreset("auto", Summarize(swirls)).value();
  EXPECT_EQ(OpacityAt(both, 0), 0);
  EXPECT_GT(OpacityAt(both, -0.9), 0.1);
  EXPECT_GT(OpacityAt(both, 0.9), 0.1);

  const Volume pit = MakeTestVolume({32, 32, 32}, ScalarType::kUint8, [](const Index3& v) { return v.x < 8 && v.y < 8 ? 20 + v.z : 250; });
  const TransferFunction below = MakePreset("auto", Summarize(pit)).value();
  EXPECT_EQ(OpacityAt(below, 250), 0);
  EXPECT_GT(OpacityAt(below, 30), 0.05);
}

TEST(AutoPreset, ShowsMasks) {
  for (const double share : {0.05, 0.5, 0.8}) {
    const Volume mask = MakeTestVolume({20, 20, 20}, ScalarType::kUint8, [&](const Index3& v) { return v.x < share * 20 ? 1 : 0; });
    const TransferFunction transfer = MakePreset("auto", Summarize(mask)).value();
    EXPECT_EQ(OpacityAt(transfer, 0), 0) << share;
    EXPECT_GT(OpacityAt(transfer, 1), 0.2) << share;
    const Volume floats = MakeTestVolume({20, 20, 20}, ScalarType::kFloat32, [&](const Index3& v) { return v.x < share * 20 ? 1 : 0; });
    EXPECT_EQ(MakePreset("auto", Summarize(floats))->Color(1), transfer.Color(1)) << "a mask has no values to tell apart";
  }
}

TEST(AutoPreset, HasNothingToShowOfVolumesOfOneValue) {
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kFloat32}) {
    for (const double value : {0, 3, 200}) {
      const VolumeSummary summary = Summarize(MakeTestVolume({20, 20, 20}, type, [&](const Index3&) { return value; }));
      for (const char* name : {"auto", "viridis", "grey"}) {
        const TransferFunction transfer = MakePreset(name, summary).value();
        EXPECT_EQ(OpacityAt(transfer, value), 0) << name << " " << value;
        EXPECT_GT(OpacityAt(Stretched(transfer, {-10, 250}), value), 0) << name << " " << value << " is in the range that is asked for";
      }
    }
  }
}

// A plume: thin where values are low, in air of none.
double PlumeAt(const Index3& v) {
  const Vec3 p = ToVec3(v) - Vec3{31.5, 31.5, 0};
  return std::exp(-(p.x * p.x + p.y * p.y) / (4 + 3.0 * v.z)) * (0.7 + 0.3 * std::sin(0.7 * v.x) * std::cos(0.5 * v.z));
}

TEST(AutoPreset, TellsValuesOfSimulationsByAColourMap) {
  const Volume plume = MakeTestVolume({64, 64, 64}, ScalarType::kFloat32, PlumeAt);
  VolumeSummary summary = Summarize(plume);
  const TransferFunction simulated = MakePreset("auto", summary).value();
  const auto brightness = [&](double value) {
    const Rgb color = simulated.Color(value);
    return 0.2126 * color.r + 0.7152 * color.g + 0.0722 * color.b;
  };
  const double low = simulated.colors.front().value, high = simulated.colors.back().value;
  EXPECT_GE(low, 0);
  EXPECT_LT(low, 0.2);
  EXPECT_GT(high, 0.4);
  EXPECT_LE(high, 1);
  for (double share = 0; share < 0.95; share += 0.1) {
    EXPECT_LT(brightness(std::lerp(low, high, share)), brightness(std::lerp(low, high, share + 0.1)))
        << "each value has a colour of its own";
  }
  EXPECT_EQ(simulated.Color(high), MakePreset("viridis", summary)->Color(summary.range.max));
  // A patient, CT and integers look as ever.
  const auto warm = [](const VolumeSummary& of) { return MakePreset("auto", of)->colors.front().color.r > 0.5; };
  EXPECT_FALSE(warm(summary));
  VolumeSummary patient = summary;
  patient.description.geometry.orientation.world = World::kPatient;
  EXPECT_TRUE(warm(patient));
  EXPECT_EQ(MakePreset("auto", patient)->opacities, simulated.opacities);
  const auto of_type = [](ScalarType type, double scale, double offset) {
    return Summarize(MakeTestVolume({64, 64, 64}, type, [=](const Index3& v) { return offset + scale * PlumeAt(v); }));
  };
  EXPECT_TRUE(warm(of_type(ScalarType::kUint8, 250, 0)));
  EXPECT_TRUE(warm(of_type(ScalarType::kFloat32, 2000, -1000))) << "Hounsfield units";
  EXPECT_FALSE(warm(of_type(ScalarType::kFloat32, 2e6, -1e6)));
}

// Whatever the unit, the sign and a few voxels that say nothing, the same shows.
TEST(Presets, ShowSomethingOfEveryVolume) {
  const struct {
    const char* what;
    double scale, offset, outlier;
  } cases[] = {{"plain", 1, 0, 0},           {"tiny", 1e-25, 0, 0},         {"huge", 1e25, 0, 0},      {"negative", 1, -40, 0},
               {"thin band", 1, 100000, 0},  {"a hot pixel", 1, 0, 1e4},    {"no data", 1, 0, 1e20},   {"no data below", 1, 0, -9999},
               {"far outlier", 1, 50, 1e30}, {"low outlier", 1, 50, -1e30}, {"near outlier", 1, 0, 50}};
  for (const auto& [what, scale, offset, outlier] : cases) {
    const auto value_at = [&](const Index3& v) { return outlier != 0 && v == Index3{5, 60, 5} ? outlier : offset + scale * PlumeAt(v); };
    const VolumeSummary summary = Summarize(MakeTestVolume({64, 64, 64}, ScalarType::kFloat32, value_at));
    std::vector<std::string> names = {"auto", "simulation", "mri-brain"};
    for (const ColorMap& map : NamedColorMaps()) names.emplace_back(map.name);
    for (const std::string& name : names) {
      const TransferFunction transfer = MakePreset(name, summary).value();
      EXPECT_EQ(OpacityAt(transfer, offset), 0) << what << ", " << name << ": air";
      EXPECT_GT(OpacityAt(transfer, offset + scale * 0.7), 0.02) << what << ", " << name << ": the core of the plume";
      EXPECT_NE(transfer.Color(offset + 0.3 * scale), transfer.Color(offset + 0.7 * scale)) << what << ", " << name;
    }
    const ScalarRange range = InDataValues({2, 98, true}, summary);
    EXPECT_GT(range.max - range.min, 0.2 * scale) << what;
    EXPECT_LT(range.max - range.min, 1.1 * scale) << what;
  }
}

TEST(WithoutOutliers, LeavesOtherVolumesAsTheyAre) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  const auto expect_same = [](const VolumeSummary& summary) {
    const VolumeSummary usual = WithoutOutliers(summary);
    EXPECT_EQ(usual.range, summary.range);
    EXPECT_EQ(usual.histogram, summary.histogram);
  };
  expect_same(Summarize(NoisyHead(random, ScalarType::kUint8)));
  expect_same(Summarize(NoisyHead(random, ScalarType::kFloat32)));
  expect_same(Summarize(MakeTestVolume({32, 32, 32}, ScalarType::kUint8, [](const Index3& v) { return v == Index3{9, 9, 9} ? 1 : 0; })));
  expect_same(Summarize(MakeTestVolume({32, 32, 32}, ScalarType::kFloat32, [](const Index3&) { return 7; })));
}

TEST(OpaquePreset, MakesExactlyTheSphereSolid) {
  const Volume sphere = MakeSphere({SphereClass::kHollow, 40, 0.05}).value();
  const VolumeSummary summary = Summarize(sphere);
  const TransferFunction transfer = MakePreset("opaque", summary).value();
  EXPECT_EQ(OpacityAt(transfer, 0), 0);
  EXPECT_EQ(OpacityAt(transfer, 128), 1);
  EXPECT_DOUBLE_EQ(EstimateOccupancy(summary, transfer), MeasureOccupancy(sphere));
}

TEST(CtPresets, FindBoneInHounsfieldUnitsStoredUnitsAndEightBits) {
  const struct {
    ScalarType type;
    ValueMapping mapping;
    double low, high;          // range of data values
    double air, tissue, bone;  // data values
  } scans[] = {
      {ScalarType::kUint16, {1, -32768}, -1024, 3071, -1000, 40, 700},
      {ScalarType::kUint16, {}, 0, 4095, 24, 1064, 1724},
      {ScalarType::kUint8, {}, 0, 255, 5, 70, 160},
  };
  for (const auto& scan : scans) {
    VolumeSummary summary;
    summary.description = {{{10, 10, 10}, {1, 1, 1}}, scan.type, scan.mapping};
    summary.range = {float(scan.low), float(scan.high)};
    const TransferFunction bone = MakePreset("ct-bone", summary).value();
    EXPECT_EQ(OpacityAt(bone, scan.tissue), 0);
    EXPECT_GT(OpacityAt(bone, scan.bone), 0.5);
    const TransferFunction veil = MakePreset("ct-soft-tissue", summary).value();
    EXPECT_EQ(OpacityAt(veil, scan.air), 0);
    EXPECT_GT(OpacityAt(veil, scan.tissue), 0.005);
    EXPECT_GT(OpacityAt(veil, scan.bone), 10 * OpacityAt(veil, scan.tissue));
    const TransferFunction skin = MakePreset("ct-skin", summary).value();
    EXPECT_EQ(OpacityAt(skin, scan.air), 0);
    EXPECT_GT(OpacityAt(skin, scan.tissue), 0.8);
  }
}

// A scanner blurs borders: here a step is blurred by a Gaussian. Somewhere in it the border of a bone has the value of a vessel, but a
// steeper slope.
TEST(CtVessels2d, ShowsVesselsAndHidesBordersOfBones) {
  VolumeSummary summary;
  summary.description.geometry = {{64, 64, 64}, {0.5, 0.5, 0.5}};
  summary.range = {-1000, 2000};
  summary.histogram.fill(1);
  const TransferFunction transfer = MakePreset("ct-vessels-2d", summary).value();
  constexpr double kTissue = 40, kBone = 1200, kVessel = 300;
  EXPECT_GT(LookAt(transfer.regions, kVessel, 0).opacity, 0.5);
  for (const double blur : {0.6, 0.8, 1.0}) {  // voxels
    const double sigma = blur * 0.5;
    for (double x = -4 * sigma; x < 4 * sigma; x += 0.01 * sigma) {
      const double value = kTissue + (kBone - kTissue) * 0.5 * std::erfc(-x / sigma / std::sqrt(2));
      const double slope = (kBone - kTissue) * std::exp(-x * x / (2 * sigma * sigma)) / (sigma * std::sqrt(2 * std::numbers::pi));
      EXPECT_LT(LookAt(transfer.regions, value, slope).opacity, 0.01) << blur << " " << value << " " << slope;
    }
  }
}

TEST(EstimateOccupancy, IsExactForFewIntegers) {
  Random random(10);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 30; ++i) {
    const int base = random.Integer(0, 60000);
    Volume volume = MakeTestVolume({13, 11, 7}, i % 2 == 0 ? ScalarType::kUint16 : ScalarType::kUint8,
                                   [&](const Index3&) { return (i % 2 == 0 ? base : 0) + random.Integer(0, 255); });
    volume.description.mapping = {random.Chance(0.5) ? -0.37 : 0.1, -12.5};
    const double edge = volume.description.mapping.FromStored((i % 2 == 0 ? base : 0) + random.Integer(0, 255) + 0.5);
    const TransferFunction transfer = {{{0, {1, 1, 1}}}, {{edge - 1, 0}, {edge, 0}, {edge, 1}}};
    std::int64_t visible = 0;
    for (std::int64_t voxel = 0; voxel < 13 * 11 * 7; ++voxel) {
      const double stored = i % 2 == 0 ? volume.block.samples<std::uint16_t>()[voxel] : volume.block.samples<std::uint8_t>()[voxel];
      visible += transfer.Opacity(volume.description.mapping.FromStored(stored)) > 0 ? 1 : 0;
    }
    EXPECT_DOUBLE_EQ(EstimateOccupancy(Summarize(volume), transfer), double(visible) / (13 * 11 * 7));
  }
}

TEST(EstimateOccupancy, OfFloatsCountsABackgroundAtTheFootOfARampAsEmpty) {
  const Volume volume = MakeTestVolume({10, 10, 10}, ScalarType::kFloat32, [](const Index3& v) { return v.z < 9 ? 0.0 : 2.5; });
  EXPECT_DOUBLE_EQ(EstimateOccupancy(Summarize(volume), {{{0, {1, 1, 1}}}, {{0, 0}, {2.5, 1}}}), 0.1);
}

TEST(EstimateOccupancy, CountsWhatIsNotFiniteAsEmpty) {
  const Volume volume = MakeTestVolume({10, 1, 1}, ScalarType::kFloat32,
                                       [](const Index3& v) { return v.x < 5 ? 1.0F : std::numeric_limits<float>::quiet_NaN(); });
  EXPECT_DOUBLE_EQ(EstimateOccupancy(Summarize(volume), {{{0, {1, 1, 1}}}, {{0, 1}}}), 0.5);
}

}  // namespace
}  // namespace slabstream
