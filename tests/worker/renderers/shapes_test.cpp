// Shapes in a volume, by every renderer that draws them: what the equations of a homogeneous block say, and one picture for all partitions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/shapes/packed_shape.h"
#include "tests/support/random.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/shapes/compose_shapes.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// Steps between the voxels of an axis differ by up to `ratio`.
std::vector<double> UnevenPlaces(int size, double ratio, Random& random) {
  std::vector<double> ends = {0};
  for (int i = 0; i <= size; ++i) ends.push_back(ends.back() + std::pow(ratio, random.Real(-0.5, 0.5)));
  std::vector<double> places;
  for (int i = 1; i <= size; ++i) places.push_back(ends[std::size_t(i)] / ends.back() * size - 0.5);
  return places;
}

VolumeGeometry Grid(bool rectilinear, Random& random) {
  VolumeGeometry grid{.size = {26, 20, 24}, .spacing = {1, 1.5, 0.7}};
  if (!rectilinear) return grid;
  grid.stretch = Stretch::Make({{UnevenPlaces(26, 10, random), {}, UnevenPlaces(24, 10, random)}}, grid.size).value();
  return grid;
}

// A volume and shapes whose coordinates are those of data space.
struct ShapesInVolume {
  Volume volume;
  FrameSetup setup;
  std::vector<std::shared_ptr<const VoxelBlock>> bytes = {};

  ShapesInVolume(const VolumeGeometry& grid, const SetupOptions& options, bool blobs = false)
      : volume(VolumeFor(*options.renderer, blobs ? MakeBlobs(grid, ScalarType::kUint8, 3) : MakeBlock(grid))),
        setup(MakeSetup(volume, options)) {}

  void Add(const Shape& shape, const ShapeLook& look) {
    auto block = std::make_shared<VoxelBlock>();
    block->bytes = PackShape(shape).value();
    block->box = {{0, 0, 0}, {std::int32_t(block->bytes.size()), 1, 1}};
    const ShapeInfo info = InfoOf(block->bytes).value();
    const Vec3 width = {8, 8, 8};  // more than that of any line or point
    setup.shapes.push_back({.low = info.low - width, .high = info.high + width, .look = look});
    bytes.push_back(std::move(block));
  }
  LocalImage Picture(const Partition& partition) const {
    const auto shapes = MakeFrameShapes(setup, bytes, nullptr).value();
    const LocalImage frame = CombinedBoxes(setup, partition, [&](const Box& box) {
      const auto data = BoxFor(*setup.renderer, volume, box, setup.halo);
      data->SetShapes(shapes);
      RankReport report;
      return MakeRenderer(*setup.renderer)->Render(*data, box, setup, {}, RenderControl(), report).value();
    });
    const bool has_colors = setup.format == PixelFormat::kRgba || setup.format == PixelFormat::kDepth;
    if (has_colors) return FinishPicture(ComposeShapes(frame, WholeFrame(setup), setup, *shapes), setup);
    return PictureOverShapes(FinishPicture(frame, setup), setup, *shapes);
  }
  LocalImage Picture(int boxes, std::mt19937& random) const { return Picture(CutAtRandom(volume.block.box, boxes, random)); }
};

std::array<float, 3> ToFloats(const Vec3& p) { return {float(p.x), float(p.y), float(p.z)}; }

// The parallelogram centre + s a + t b with s and t from -1 to 1.
Shape Parallelogram(const Vec3& centre, const Vec3& a, const Vec3& b) {
  return {.positions = {ToFloats(-a - b), ToFloats(a - b), ToFloats(b - a), ToFloats(a + b)},
          .origin = centre,
          .triangles = {{0, 1, 2}, {1, 3, 2}}};
}

struct Case {
  const RendererKind* renderer;
  bool rectilinear;
};
std::vector<Case> Cases(bool blending) {
  std::vector<Case> cases;
  for (const RendererKind* renderer : Renderers()) {
    if (!renderer->Can(Ability::kShapes)) continue;
    if (blending && (renderer->format() != PixelFormat::kRgba || renderer->along_slices())) continue;
    cases.push_back({renderer, false});
    if (renderer->Can(Ability::kRectilinear)) cases.push_back({renderer, true});
  }
  return cases;
}

// Where a ray is in the volume, and where it meets a plane, as depths.
struct Depths {
  double enter = -1e300, leave = 1e300, plane = 0;
};

constexpr double kOpacity = 0.04;  // of a voxel length of the block, which is blue

// A slanted plane through a homogeneous block, in red. Calls check(colour, voxel lengths of a pixel's ray in the block before the plane,
// and behind it) where both are 0, or so long that there are samples.
template <class Check>
void ForEachRayThroughPlane(double opacity, Check&& check) {
  Random random(31);
  std::mt19937 views(31);
  for (const auto& [renderer, rectilinear] : Cases(true)) {
    for (const Projection projection : renderer->projections()) {
      for (int view = 0; view < 3; ++view) {
        SetupOptions options{.renderer = renderer, .view = RandomView(projection, views), .transfer = Uniform(kOpacity, {0, 0, 1})};
        options.view.zoom = 2;  // so that the frame is the picture
        options.shading.model = ShadingModel::kNone;
        ShapesInVolume scene(Grid(rectilinear, random), options);
        const Camera& camera = scene.setup.camera;
        ASSERT_EQ(camera.supersample, 1);
        const VolumeGeometry& grid = scene.setup.description.geometry;
        const Vec3 a = camera.right - random.Real(-0.6, 0.6) * camera.view_direction;
        const Vec3 b = camera.up - random.Real(-0.6, 0.6) * camera.view_direction, normal = Cross(a, b);
        const Vec3 centre = grid.centre() + Vec3{random.Real(-4, 4), random.Real(-4, 4), random.Real(-4, 4)};
        scene.Add(Parallelogram(centre, 500 * a / grid.spacing, 500 * b / grid.spacing), {.color = {1, 0, 0}, .opacity = opacity});
        const LocalImage image = scene.Picture(1, views);
        for (const int boxes : {3, 8}) {
          EXPECT_LE(LargestDifference(image, scene.Picture(boxes, views)), 2e-5F) << renderer->name() << ", " << boxes << " boxes";
        }
        ForEachTarget([&] { EXPECT_LE(LargestDifference(image, scene.Picture(2, views)), 2e-5F) << renderer->name(); });
        int checked = 0;
        for (int y = 0; y < camera.height; ++y) {
          for (int x = 0; x < camera.width; ++x) {
            const Camera::Ray ray = camera.RayAt(x + 0.5, y + 0.5);
            Depths depths{.plane = Dot(normal, (centre - ray.origin) * grid.spacing) / Dot(normal, ray.direction * grid.spacing)};
            for (const Axis axis : kAxes) {
              const double low = (-0.5 - ray.origin[axis]) / ray.direction[axis];
              const double high = (grid.size[axis] - 0.5 - ray.origin[axis]) / ray.direction[axis];
              depths.enter = std::max(depths.enter, std::min(low, high));
              depths.leave = std::min(depths.leave, std::max(low, high));
            }
            depths.leave = std::max(depths.leave, depths.enter);
            const double length = Length(ray.direction * grid.spacing) / Least(grid.spacing);
            const double before = (std::clamp(depths.plane, depths.enter, depths.leave) - depths.enter) * length;
            const double behind = (depths.leave - depths.enter) * length - before;
            // Shorter parts may pass between samples.
            const auto sampled = [](double part) { return part == 0 || part > 1.2; };
            if (!sampled(before) || !sampled(behind)) continue;
            ++checked;
            SCOPED_TRACE(::testing::Message() << renderer->name() << (rectilinear ? ", rectilinear, " : ", ") << NameOf(projection)
                                              << ", view " << view << ", pixel " << x << ' ' << y << ", " << before << " before, " << behind
                                              << " behind");
            check(PixelOf(image, x, y), before, behind);
            if (::testing::Test::HasFailure()) return;
          }
        }
        EXPECT_GT(checked, 1000);
      }
    }
  }
}

double Through(double length) { return std::pow(1 - kOpacity, length); }

TEST(Shapes, FogInFrontOfAnOpaquePlaneHasTheOpacityOfItsLength) {
  ForEachRayThroughPlane(1, [](const std::array<float, 4>& pixel, double before, double /*behind*/) {
    EXPECT_NEAR(pixel[0], Through(before), 0.002);
    EXPECT_NEAR(pixel[2], 1 - Through(before), 0.002);
    EXPECT_NEAR(pixel[3], 1, 1e-5);
  });
}

// Some renderers composite a fragment in front of the next sample behind it: half a step may be on the other side.
TEST(Shapes, ATranslucentPlaneTakesItsShareInItsPlace) {
  constexpr double kPlane = 0.25;
  ForEachRayThroughPlane(kPlane, [](const std::array<float, 4>& pixel, double before, double behind) {
    const double front = Through(before), back = Through(behind);
    EXPECT_NEAR(pixel[0], front * kPlane, kPlane * kOpacity / 2 + 0.002);
    EXPECT_NEAR(pixel[2], 1 - front + front * (1 - kPlane) * (1 - back), kPlane * kOpacity / 2 + 0.002);
    EXPECT_NEAR(pixel[3], 1 - front * (1 - kPlane) * back, 0.002);
  });
}

// Triangles, lines and points in the volume and around it.
void AddShapes(double opacity, ShapesInVolume& scene, Random& random) {
  const Vec3 size = ToVec3(scene.setup.description.geometry.size);
  const auto place = [&] { return ToFloats(size * Vec3{random.Real(-0.2, 1.2), random.Real(-0.2, 1.2), random.Real(-0.2, 1.2)}); };
  Shape mesh, lines{.kind = ShapeKind::kLines, .line_begins = {0}}, points{.kind = ShapeKind::kPoints};
  for (std::uint32_t i = 0; i < 12; ++i) {
    for (int corner = 0; corner < 3; ++corner) mesh.positions.push_back(place());
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    lines.positions.push_back(place());
    points.positions.push_back(place());
  }
  lines.line_begins.push_back(std::uint32_t(lines.positions.size()));
  scene.Add(mesh, {.color = {1, 0.5F, 0.3F}, .opacity = opacity});
  scene.Add(lines, {.color = {0.5F, 1, 0.3F}, .opacity = opacity, .width = 1.5});
  scene.Add(points, {.color = {0.5F, 0.3F, 1}, .opacity = opacity, .width = 5});
}

TEST(Shapes, AllPartitionsMakeOnePicture) {
  Random random(32);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(32);
  for (const auto& [renderer, rectilinear] : Cases(false)) {
    for (const Projection projection : renderer->projections()) {
      for (int view = 0; view < 4; ++view) {
        SetupOptions options{.renderer = renderer, .view = RandomView(projection, views), .transfer = Ramp(view % 2 == 0 ? 0.3 : 0.05)};
        options.view.zoom = view == 0 ? 4 : 1;
        const VolumeGeometry grid = Grid(rectilinear, random);
        if (view >= 2) {
          options.clipping = RandomClipping(grid, views);
          options.clipping.mode = view % 2 == 0 ? ClipMode::kKeep : ClipMode::kCutAway;
        }
        if (view % 2 == 1) options.termination = 1.0 / 1024;
        ShapesInVolume scene(grid, options, true);
        const LocalImage bare = RenderPicture(scene.volume, scene.setup);
        AddShapes(view % 2 == 0 ? 1 : 0.4, scene, random);
        AddShapes(0.5, scene, random);
        const LocalImage one = scene.Picture(1, views);
        EXPECT_GT(LargestDifference(one, bare), 0.1F) << "no shape shows";
        const float tolerance = scene.setup.format == PixelFormat::kRgba ? 2e-5F + float(options.termination) : 0;
        for (const int boxes : {2, 3, 5, 8, 13}) {
          EXPECT_LE(LargestDifference(one, scene.Picture(boxes, views)), tolerance)
              << renderer->name() << (rectilinear ? ", rectilinear, " : ", ") << NameOf(projection) << ", view " << view << ", " << boxes
              << " boxes";
        }
      }
    }
  }
}

// Boxes without a visible sample, or without a cell, have their fragments all the same.
TEST(Shapes, ShapesAloneAreTheSameInAnyPartitionAndOrder) {
  Random random(33);
  SCOPED_TRACE(random.trace());
  std::mt19937 views(33);
  for (const auto& [renderer, rectilinear] : Cases(true)) {
    for (const Projection projection : renderer->projections()) {
      SCOPED_TRACE(::testing::Message() << renderer->name() << (rectilinear ? ", rectilinear, " : ", ") << NameOf(projection));
      SetupOptions options{.renderer = renderer, .view = RandomView(projection, views), .transfer = Uniform(0, {0, 0, 1})};
      for (const double opacity : {1.0, 0.4}) {
        ShapesInVolume scene(Grid(rectilinear, random), options);
        AddShapes(opacity, scene, random);
        const LocalImage alone = PictureOverShapes(FinishPicture(MakeLocalImage(PixelFormat::kRgba, {}), scene.setup), scene.setup,
                                                   *MakeFrameShapes(scene.setup, scene.bytes, nullptr).value());
        EXPECT_GT(std::ranges::max(alone.rgba), 0.3F);
        // Edges are translucent, too.
        for (const int boxes : {1, 3, 8}) EXPECT_LE(LargestDifference(alone, scene.Picture(boxes, views)), 1e-6F) << boxes;
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
