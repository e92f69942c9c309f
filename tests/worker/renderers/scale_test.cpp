// Extreme lengths and values: a picture shows the same whatever unit the volume's lengths and values have.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "common/mesh/summarize_cells.h"
#include "common/planning/frame_plan.h"
#include "common/view/world_limits.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr unsigned kSeed = 58;
const VolumeGeometry kOrdinary = {{24, 20, 22}, {1, 0.8, 1.3}, {World::kScene, {3, -5, 8}}};

// The request for a volume whose lengths are `scale` times as long.
FrameRequest Scaled(FrameRequest request, double scale) {
  ViewParameters& view = request.view;
  if (view.look_at) view.look_at = scale * *view.look_at;
  view.distance *= scale;
  if (request.clipping.box) request.clipping.box = ClipBox{scale * request.clipping.box->low, scale * request.clipping.box->high};
  for (ClipPlane& plane : request.clipping.planes) plane.offset *= scale;
  for (GradientOpacityPoint& point : request.transfer.gradient_opacities) point.slope /= scale;
  return request;
}

Volume Scaled(Volume volume, double scale) {
  VolumeGeometry& geometry = volume.description.geometry;
  geometry.spacing = scale * geometry.spacing;
  geometry.orientation.origin = scale * geometry.orientation.origin;
  return volume;
}

FrameSetup SetupOf(const Volume& volume, const FrameRequest& request, DatasetId dataset) {
  const Result<ResolvedRequest> resolved = ResolveRequest(request, dataset, std::make_shared<const VolumeSummary>(SummaryOf(volume)));
  EXPECT_TRUE(resolved.ok()) << resolved.status().message();
  Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  EXPECT_TRUE(setup.ok()) << setup.status().message();
  return *std::move(setup);
}

FrameRequest RequestOf(const RendererKind& kind, Projection projection) {
  FrameRequest request;
  request.dataset = "volume";
  request.renderer = kind.name();
  request.size = {40, 36};
  request.view = {.projection = projection, .azimuth_degrees = 30, .elevation_degrees = 20};
  request.transfer.choice = Ramp(0.2);
  return request;
}

DatasetId NextDataset() {  // what renderers keep between frames is kept by this number
  static DatasetId last = 1000;
  return ++last;
}

class AtEveryScale : public ::testing::Test {
 protected:
  // Powers of two change no bit.
  static void ExpectSamePictures(const RendererKind& kind, const FrameRequest& request, const std::string& what) {
    const Volume ordinary = VolumeFor(kind, MakeBlobs(kOrdinary, ScalarType::kFloat32, kSeed));
    const LocalImage expected = RenderPicture(ordinary, SetupOf(ordinary, request, NextDataset()));
    double shown = 0;
    for (const float channel : expected.rgba) shown += double(channel);
    EXPECT_GT(shown, 10) << what;
    for (const double scale : {0x1p-130, 0x1p-40, 0x1p30, 0x1p120}) {
      SCOPED_TRACE(::testing::Message() << what << ", scale " << scale);
      const Volume scaled = Scaled(ordinary, scale);
      const FrameSetup setup = SetupOf(scaled, Scaled(request, scale), NextDataset());
      const LocalImage picture = RenderPicture(scaled, setup);
      EXPECT_EQ(LargestDifference(picture, expected), 0);
      // Depths are those of the world.
      ASSERT_EQ(picture.depth.size(), expected.depth.size());
      for (std::size_t i = 0; i < picture.depth.size(); ++i) {
        if (std::isfinite(expected.depth[i])) {
          ASSERT_EQ(double(picture.depth[i]), std::min(scale * double(expected.depth[i]), double(std::numeric_limits<float>::max())));
        }
      }
    }
  }
};

TEST_F(AtEveryScale, EveryRendererDrawsTheSamePicture) {
  for (const RendererKind* kind : Renderers()) {
    for (const Projection projection : kind->projections()) {
      ExpectSamePictures(*kind, RequestOf(*kind, projection), fmt::format("{} {}", kind->name(), NameOf(projection)));
    }
  }
}

TEST_F(AtEveryScale, LightShadowsAndClippingAreTheSame) {
  for (const RendererKind* kind : Renderers()) {
    FrameRequest request = RequestOf(*kind, Projection::kOrthographic);
    request.clipping.planes = {{{1, 0.5, 0.2}, -8}};
    request.clipping.box = ClipBox{{5, -1, 10}, {24, 9, 33}};
    if (kind->Can(Ability::kLights)) request.shading.lights = {{1, 0.2, 0.4}};
    if (kind->Can(Ability::kShadows)) request.shading.shadows = request.shading.ambient_occlusion = 1;
    if (kind->Can(Ability::kGradientOpacity)) request.transfer.gradient_opacities = {{0, 0}, {60, 1}};
    ExpectSamePictures(*kind, request, std::string(kind->name()));
  }
}

// Lengths as in headers of files: no powers of two.
TEST(ExtremeLengths, LookLikeOrdinaryOnes) {
  for (const RendererKind* kind : Renderers()) {
    for (const Projection projection : kind->projections()) {
      const FrameRequest request = RequestOf(*kind, projection);
      const Volume ordinary = VolumeFor(*kind, MakeBlobs({{24, 20, 22}, {1, 1, 1}}, ScalarType::kUint8, kSeed));
      const LocalImage expected = RenderPicture(ordinary, SetupOf(ordinary, request, NextDataset()));
      for (const double scale : {1e-36, 1e-7, 1e22, 1e36}) {
        const Volume scaled = Scaled(ordinary, scale);
        const LocalImage picture = RenderPicture(scaled, SetupOf(scaled, request, NextDataset()));
        double difference = 0;
        for (std::size_t i = 0; i < picture.rgba.size(); ++i) difference += std::abs(double(picture.rgba[i]) - double(expected.rgba[i]));
        EXPECT_LT(difference / double(picture.rgba.size()), 1e-3) << kind->name() << ' ' << NameOf(projection) << ' ' << scale;
      }
    }
  }
}

TEST(ExtremeLengths, ThatNoPictureCanShowAreRefusedByName) {
  const auto why = [](const Vec3& spacing, const Vec3& origin = {}) {
    VolumeSummary summary = Summarize(MakeBlock({{8, 8, 8}, spacing, {World::kScene, origin}}));
    const auto resolved = ResolveRequest(RequestOf(*FindRenderer("zbuffer"), Projection::kPerspective), 1,
                                         std::make_shared<const VolumeSummary>(std::move(summary)));
    const Status status = resolved.ok() ? MakeFrameSetup(*resolved).status() : resolved.status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    return status.message();
  };
  EXPECT_NE(why({1e300, 1, 1}).find("spacing is 1e+300, 1, 1: volumes can be drawn if each is in [1e-100, 1e+100]"), std::string::npos);
  EXPECT_NE(why({1e-300, 1, 1}).find("[1e-100, 1e+100]"), std::string::npos);
  EXPECT_NE(why({1e9, 1, 1}).find("8e+09 times as long as the shortest side of a voxel"), std::string::npos) << why({1e9, 1, 1});
  EXPECT_NE(why({1, 1, 1}, {1e300, 0, 0}).find("origin is 1e+300, 0, 0"), std::string::npos);
}

// Gradients of densities in SI units, or of CGS: squares of them overflow or vanish in single precision.
TEST(ExtremeValues, AreLitLikeOrdinaryOnes) {
  for (const RendererKind* kind : Renderers()) {
    if (!kind->Can(Ability::kLights)) continue;
    FrameRequest request = RequestOf(*kind, Projection::kOrthographic);
    request.shading.lights = {{1, 0.2, 0.4}};
    const auto picture = [&](double factor) {
      Volume volume = MakeBlobs(kOrdinary, ScalarType::kFloat32, kSeed);
      for (std::size_t i = 0; i < std::size_t(volume.block.box.voxel_count()); ++i) {
        float& sample = reinterpret_cast<float*>(volume.block.bytes.data())[i];
        sample = float(double(sample) * factor);
      }
      TransferFunction transfer = Ramp(0.2);
      for (ColorPoint& point : transfer.colors) point.value *= factor;
      for (OpacityPoint& point : transfer.opacities) point.value *= factor;
      request.transfer.choice = transfer;
      const Volume shown = VolumeFor(*kind, std::move(volume));
      return RenderPicture(shown, SetupOf(shown, request, NextDataset()));
    };
    const LocalImage ordinary = picture(1);
    for (const double factor : {0x1p-100, 0x1p-70, 0x1p80, 0x1p112}) {
      EXPECT_EQ(LargestDifference(picture(factor), ordinary), 0) << kind->name() << ", values times " << factor;
    }
  }
}

// One voxel far away from the others takes nothing from them.
TEST(ExtremeValues, OfOneVoxelLeaveTheOthersTheirLook) {
  for (const RendererKind* kind : Renderers()) {
    if (!kind->Can(Ability::kTransfer) || kind->Can(Ability::kCells)) continue;
    for (const Projection projection : kind->projections()) {
      FrameRequest request = RequestOf(*kind, projection);
      request.shading.model = ShadingModel::kNone;
      request.clipping.box = ClipBox{.low = {2, 2, 2}, .high = {kMaxCoordinate, kMaxCoordinate, kMaxCoordinate}, .unit = ClipUnit::kVoxels};
      const auto picture = [&](float hot) {
        Volume volume = MakeBlobs(kOrdinary, ScalarType::kFloat32, kSeed);
        reinterpret_cast<float*>(volume.block.bytes.data())[0] = hot;
        return RenderPicture(volume, SetupOf(volume, request, NextDataset()));
      };
      const LocalImage ordinary = picture(100);
      for (const float hot : {2e5F, 2e6F, 9.96921e36F, -9e36F}) {
        EXPECT_LE(LargestDifference(picture(hot), ordinary), 0.01F) << kind->name() << ' ' << NameOf(projection) << ' ' << hot;
      }
    }
  }
}

// A grid of the atmosphere: voxels that are hundreds of times as wide as high. The same volume with ten voxels in place of each, in layers,
// looks alike.
TEST(FlatVoxels, LookLikeMoreVoxels) {
  constexpr int kWide = 30, kMore = 10;
  const auto value = [](double x, double y, double z) {
    return 200 * std::max(0.0, 1 - std::hypot((x - 11.5) / 12, (y - 11.5) / 12, (z - 11.5) / 12));
  };
  const Volume flat =
      MakeVolume({{24, 24, 24}, {kWide, kWide, 1}}, ScalarType::kFloat32, [&](const Index3& v) { return value(v.x, v.y, v.z); });
  const auto fine = [](int i) { return (i + 0.5) / kMore - 0.5; };
  const Volume more = MakeVolume({{24 * kMore, 24 * kMore, 24}, {kWide / kMore, kWide / kMore, 1}}, ScalarType::kFloat32,
                                 [&](const Index3& v) { return value(fine(v.x), fine(v.y), v.z); });
  for (const char* name : {"raycast", "splat", "zbuffer", "mip", "shear"}) {
    for (const double elevation : {0.0, 5.0, 20.0, 60.0}) {
      FrameRequest request = RequestOf(*FindRenderer(name), Projection::kOrthographic);
      request.view.elevation_degrees = elevation;
      request.shading.model = ShadingModel::kNone;
      request.size = {64, 64};
      const LocalImage a = RenderPicture(flat, SetupOf(flat, request, NextDataset()));
      const LocalImage b = RenderPicture(more, SetupOf(more, request, NextDataset()));
      double sum_a = 0, sum_b = 0, difference = 0;
      for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
          const auto p = PixelOf(a, x, y), q = PixelOf(b, x, y);
          sum_a += double(p[3]);
          sum_b += double(q[3]);
          difference += std::abs(double(p[3]) - double(q[3]));
        }
      }
      const double part = name == std::string_view("zbuffer") ? 0.5 : 0.1;  // which draws voxels as they are
      EXPECT_NEAR(sum_a, sum_b, part * sum_b) << name << ' ' << elevation;
      EXPECT_LT(difference, 2 * part * sum_b) << name << ' ' << elevation;
    }
  }
}

}  // namespace
}  // namespace slabstream
