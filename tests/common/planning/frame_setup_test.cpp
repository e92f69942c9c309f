// What a plan says about the frame that its workers render.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/combining/travel.h"
#include "common/renderers/registry.h"
#include "common/view/clip_corners.h"
#include "common/view/default_view.h"
#include "common/wire/validate_request.h"
#include "tests/common/planning/plan_support.h"
#include "tests/support/random.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

TEST(ResolveRequest, TheAutomaticRendererDrawsTheCellsOfGridsAndTheVoxelsOfVolumes) {
  for (const bool grid : {false, true}) {
    const VolumeSummary summary = grid ? FullGridSummary({20, 20, 20}) : FullSummary({20, 20, 20});
    FrameRequest request = SomeRequest();
    EXPECT_EQ(request.renderer, kAutomatic);
    const ResolvedRequest resolved = Resolved(request, summary);
    EXPECT_EQ(resolved.volume.renderer(), &DefaultRenderer(grid));
    EXPECT_EQ(resolved.volume.renderer()->Can(Ability::kCells), grid);
    EXPECT_EQ(resolved.frame.renderer, resolved.volume.renderer()->name());
    request.renderer = resolved.frame.renderer;
    EXPECT_EQ(SetupOf(request, summary), SetupOf(SomeRequest(), summary));
  }
}

TEST(ResolveRequest, TheAutomaticRendererHasTheParametersThatAreGiven) {
  FrameRequest request = SomeRequest();
  request.parameters = {{"sampling-rate", "2.5"}};
  EXPECT_EQ(SetupOf(request, FullGridSummary({20, 20, 20})).parameters, std::vector{2.5});
  EXPECT_EQ(SetupOf(request, FullSummary({20, 20, 20})).parameters.front(), 2.5);
}

TEST(ResolveRequest, TheViewIsTheDefaultOneAsFarAsNothingElseIsSaid) {
  for (const World world : {World::kVoxels, World::kScene, World::kPatient}) {
    const bool patient = world == World::kPatient;
    VolumeSummary summary = FullSummary({64, 64, 64});
    summary.description.geometry.orientation = {world, {5, -6, 7}};
    const VolumeGeometry& geometry = summary.description.geometry;
    FrameRequest request = SomeRequest();
    request.view = kUnstatedView;
    const ResolvedRequest resolved = Resolved(request, summary);
    const ViewParameters& view = resolved.frame.view;
    EXPECT_EQ(view.azimuth_degrees, patient ? 180 : 30);
    EXPECT_EQ(view.elevation_degrees, patient ? 0 : 20);
    EXPECT_EQ(view.fit, false) << "it has been done";
    ASSERT_TRUE(view.look_at && resolved.framed);
    EXPECT_EQ(*view.look_at, resolved.framed->centre);
    EXPECT_LT(Length(*view.look_at - geometry.ToWorld(geometry.centre())), 1e-9) << "all of it shows";

    // Asked for again, it stays as it is, and so does the picture.
    request.view = view;
    EXPECT_EQ(Resolved(request, summary).frame.view, view);
    EXPECT_EQ(MakeFrameSetup(Resolved(request, summary)).value(), MakeFrameSetup(resolved).value());

    request.view = kUnstatedView;
    request.view.fit = false;
    EXPECT_EQ(Resolved(request, summary).frame.view.look_at, std::nullopt);
    EXPECT_EQ(Resolved(request, summary).frame.view.zoom, 1);
  }
}

TEST(PlanFrame, SetupHoldsWhatTheRequestAsksFor) {
  FrameRequest request = SomeRequest();
  request.renderer = ZBuffer()->name();
  request.termination = 0.25;
  request.transfer.opacity_distance = 3;
  request.shading.model = ShadingModel::kNone;
  request.size = {100, 50};
  const VolumeSummary summary = FullSummary({40, 41, 42});
  const FrameSetup setup = Plan(request, summary, FullRoster(2)).setup;
  EXPECT_EQ(setup.dataset, 7U);
  EXPECT_EQ(setup.description, summary.description);
  EXPECT_EQ(setup.range, summary.range);
  EXPECT_EQ(setup.renderer, ZBuffer());
  EXPECT_EQ(setup.camera,
            MakeCamera(request.view, request.size, summary.description.geometry, Least(summary.description.geometry.spacing)));
  EXPECT_EQ(setup.transfer.opacity_distance, 3);
  EXPECT_EQ(setup.shading, request.shading);
  EXPECT_EQ(setup.termination, 0.25);
  EXPECT_EQ(setup.halo, kHalo);
}

TEST(PlanFrame, TheMaterialOfATransferFunctionIsLit) {
  FrameRequest request = SomeRequest();
  const VolumeSummary summary = FullSummary({20, 20, 20});
  TransferFunction function = {.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.5}}};
  request.transfer.choice = function;
  const FrameSetup plain = SetupOf(request, summary);
  EXPECT_EQ(plain.shading, request.shading);
  function.material = {.ambient = 0.5F, .diffuse = 0.25F, .specular = 0.75F, .shininess = 80};
  request.transfer.choice = function;
  const FrameSetup setup = SetupOf(request, summary);
  EXPECT_EQ(setup.shading, (Shading{.ambient = 0.5F, .diffuse = 0.25F, .specular = 0.75F, .shininess = 80}));
  EXPECT_EQ(setup.transfer, plain.transfer) << "nothing is classified anew";
  // What a request says itself counts, even if it is the standard number.
  request.shading.ambient = Material().ambient;
  request.shading.specular = 0.125F;
  EXPECT_EQ(SetupOf(request, summary).shading, (Shading{.ambient = 0.2F, .diffuse = 0.25F, .specular = 0.125F, .shininess = 80}));
}

// Splatting renders a grid along the slices and the display worker makes the picture of it; the Z-buffer renders the supersampled picture.
TEST(PlanFrame, TheFrameIsWhatThePipelineRenders) {
  FrameRequest request = SomeRequest();
  request.view = {.azimuth_degrees = 30, .elevation_degrees = 20, .zoom = 0.2};
  const VolumeSummary summary = FullSummary({40, 41, 42});
  const VolumeGeometry& geometry = summary.description.geometry;
  const FrameSetup splat = Plan(request, summary, FullRoster(2)).setup;
  EXPECT_EQ(splat.camera, MakeCamera(request.view, request.size, geometry));
  EXPECT_EQ(splat.sheets, MakeSheetGrid(splat.camera, geometry));
  EXPECT_EQ(FrameBounds(splat), (PixelBounds{0, 0, splat.sheets.width, splat.sheets.height}));

  request.renderer = ZBuffer()->name();
  const FrameSetup zbuffer = Plan(request, summary, FullRoster(2)).setup;
  EXPECT_GT(zbuffer.camera.supersample, 1);
  EXPECT_EQ(FrameBounds(zbuffer), (PixelBounds{0, 0, zbuffer.camera.width, zbuffer.camera.height}));
  EXPECT_EQ(WholeFrame(zbuffer).end, std::uint64_t(zbuffer.camera.width) * std::uint64_t(zbuffer.camera.height));
}

// Seen obliquely, slices that lie far apart for the width of their voxels would need absurdly wide images: other slices are taken.
TEST(PlanFrame, TakesSlicesThatLieCloseEnough) {
  FrameRequest request = SomeRequest();
  request.view.elevation_degrees = -50;
  VolumeSummary summary = FullSummary({64, 64, 600});
  EXPECT_EQ(SetupOf(request, summary).camera.traversal_axis, Axis::kZ);
  summary.description.geometry.spacing = {1, 1, 3000};
  const FrameSetup setup = SetupOf(request, summary);
  EXPECT_EQ(setup.camera.traversal_axis, Axis::kY);
  EXPECT_LE(std::max(setup.sheets.width, setup.sheets.height), 4000);
}

// Renderers work in single precision.
TEST(PlanFrame, LengthsAreCountedInAUnitNearToTheVolumes) {
  for (const double spacing : {1e-36, 1e-9, 1e-3, 0.1, 1.0, 50.0, 1e9, 1e36}) {
    VolumeSummary summary = FullSummary({64, 64, 60});
    VolumeGeometry& geometry = summary.description.geometry;
    geometry.spacing = {spacing, spacing, 2 * spacing};
    geometry.orientation = {.world = World::kScene, .origin = {100 * spacing, 0, -spacing}};
    const FrameSetup setup = SetupOf(SomeRequest(), summary);
    const double radius = BoundingRadius(setup.description.geometry);
    EXPECT_TRUE(radius >= 0.5 && radius <= 0x1p20) << spacing;
    EXPECT_EQ(setup.unit == 1, spacing > 0.01 && spacing < 1e4) << spacing;
    EXPECT_EQ(WorldGeometryOf(setup), geometry);
    // Whoever has the picture sees the world's lengths.
    const PictureGeometry shown = PictureGeometryOf(setup), expected = GeometryOf(MakeCamera({}, SomeRequest().size, geometry), geometry);
    EXPECT_DOUBLE_EQ(shown.pixel_size, expected.pixel_size);
    EXPECT_DOUBLE_EQ(shown.target_depth, expected.target_depth);
    EXPECT_NEAR(Length(shown.target - expected.target), 0, 1e-9 * radius * setup.unit);
    EXPECT_NEAR(Length(shown.box_corner - expected.box_corner), 0, 1e-9 * radius * setup.unit);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(Length(shown.box_edges[i] - expected.box_edges[i]), 0, 1e-9 * radius * setup.unit);
    EXPECT_EQ(shown.unit, expected.unit);
  }
}

// The cut of a volume that lies askew in its world touches two opposite borders of the picture and crosses none, however thick it is.
TEST(PlanFrame, ASliceIsFramedByItsCut) {
  Random random(51);
  FrameRequest request = SomeRequest();
  request.renderer = "mip";
  request.size = {300, 200};
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(random.trace());
    VolumeSummary summary = FullSummary({random.Integer(20, 90), random.Integer(20, 90), random.Integer(20, 90)});
    VolumeGeometry& geometry = summary.description.geometry;
    geometry.spacing = {random.Real(0.5, 2), random.Real(0.5, 2), random.Real(0.5, 2)};
    request.view = {.azimuth_degrees = random.Real(0, 360), .elevation_degrees = random.Real(-90, 90), .fit = true};
    const Vec3 normal = MakeCamera(request.view, request.size, geometry).view_direction;
    const Vec3 through = geometry.ToWorld(geometry.centre() + Vec3{random.Real(-8, 8), random.Real(-8, 8), random.Real(-8, 8)});
    request.clipping.slab = ClipSlab{.normal = normal, .through = through, .thickness = i % 2 == 0 ? 0 : random.Real(0, 20)};
    const FrameSetup setup = Plan(request, summary, FullRoster(1)).setup;
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (const Vec3& corner : CornersOf(setup.clip, geometry.bounds())) {
      const Camera::ImagePoint at = setup.camera.Project(corner);
      left = std::min(left, at.x), right = std::max(right, at.x);
      top = std::min(top, at.y), bottom = std::max(bottom, at.y);
    }
    const int scale = setup.camera.supersample;
    EXPECT_NEAR(left + right, 300 * scale, 1e-3);
    EXPECT_NEAR(top + bottom, 200 * scale, 1e-3);
    EXPECT_NEAR(std::max((right - left) / 300, (bottom - top) / 200), scale, 1e-3);
  }
}

TEST(PlanFrame, ResolvesPresets) {
  FrameRequest request = SomeRequest();
  request.transfer = {"auto", 2.5};
  const VolumeSummary summary = FullSummary({40, 41, 42});
  TransferFunction expected = *MakePreset("auto", summary);
  expected.opacity_distance = 2.5;
  EXPECT_EQ(Plan(request, summary, FullRoster(1)).setup.transfer, expected);
}

TEST(PlanFrame, ColoursTravelInAsManyBitsAsTheirErrorAllows) {
  const VolumeSummary summary = FullSummary({40, 40, 40});
  FrameRequest request = SomeRequest();
  request.policy.groups = 1;
  const auto color = [&](double pixel_error, int workers) {
    request.policy.pixel_error = pixel_error;
    const FramePlan plan = Plan(request, summary, FullRoster(workers));
    for (const GroupPlan& group : plan.groups) {
      const Travel travel = TravelOf(DeriveSchedule(group.schedule, WholeFrame(plan.setup)).value(), WholeFrame(plan.setup));
      EXPECT_LE(CodingError(group.color, travel.hops, travel.transfers), pixel_error);
    }
    return plan.groups[0].color;
  };
  for (int workers : {2, 5, 8}) {
    EXPECT_EQ(color(0, workers), ColorCoding::kFloat32);
    EXPECT_EQ(color(1e-6, workers), ColorCoding::kFloat32);
    EXPECT_EQ(color(1.0 / 1024, workers), ColorCoding::kFixed16);
  }
  request.policy.combine = "centralized";
  request.policy.groups = 1;
  const VolumeSummary large = FullSummary({16, 16, 400});
  request.policy.pixel_error = 1.0 / 1024;
  const FramePlan plan = Plan(request, large, FullRoster(100));
  EXPECT_EQ(plan.groups[0].color, ColorCoding::kHalf) << "99 transfers, but one hop";
  request.renderer = ZBuffer()->name();
  EXPECT_EQ(color(kMaxPixelError, 5), ColorCoding::kFloat32);
  request.policy.pixel_error = 0.2;
  EXPECT_EQ(Validate(request).code(), StatusCode::kInvalidArgument);
}

TEST(PlanFrame, ColoursOfTheNearestPixelsTravelIn8BitsIfTheClientTakesThese) {
  const VolumeSummary summary = FullSummary({40, 40, 40});
  const auto color = [&](const RendererKind* renderer, bool straight8, double zoom) {
    FrameRequest request = SomeRequest();
    request.renderer = renderer->name();
    request.straight8 = straight8;
    request.view.zoom = zoom;
    return Plan(request, summary, FullRoster(4)).groups[0].color;
  };
  EXPECT_EQ(color(ZBuffer(), true, 1), ColorCoding::kStraight8);
  EXPECT_EQ(color(ZBuffer(), false, 1), ColorCoding::kFloat32);
  EXPECT_EQ(color(ZBuffer(), true, 0.02), ColorCoding::kFloat32) << "pixels of the picture are means";
  EXPECT_EQ(color(FindRenderer("raycast"), true, 1), ColorCoding::kFloat32) << "colours blend";
  FrameRequest request = SomeRequest();
  request.renderer = ZBuffer()->name();
  request.straight8 = true;
  request.straight8_over = {1, 1, 1};
  EXPECT_EQ(Plan(request, summary, FullRoster(4)).groups[0].color, ColorCoding::kFloat32)
      << "codes are those of the sum with what lies behind";
  request.straight8_over.reset();
  request.shading.model = ShadingModel::kDepthGradient;
  EXPECT_EQ(Plan(request, summary, FullRoster(4)).groups[0].color, ColorCoding::kFloat32) << "colours are shaded after combining";
}

}  // namespace
}  // namespace slabstream
