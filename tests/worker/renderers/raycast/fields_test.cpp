// Several fields in the ray caster: formulas, the kernel against its reference, and that neither boxes nor the order of channels matter.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "common/kernels/combine.h"
#include "tests/support/renderers.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/raycast/scene_reference.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/frame_fields.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

const VolumeGeometry kGeometry = {{24, 20, 22}, {1, 1, 1}, {}};

Scene MakeScene(Volume volume, SetupOptions options, double rate = 1) {
  FrameSetup setup = RaycastSetup(volume, std::move(options), rate);
  return {std::move(volume), {}, std::move(setup)};
}

SetupOptions Unlit(double opacity, Rgb color) {
  SetupOptions options;
  options.shading.model = ShadingModel::kNone;
  options.transfer = Uniform(opacity, color);
  return options;
}

const Rgb kRed = {1, 0, 0}, kGreen = {0, 1, 0};

// ---- formulas: a block of each field fills the picture, so that the mixture is one material

Rgb StraightOf(const std::array<float, 4>& pixel) { return {pixel[0] / pixel[3], pixel[1] / pixel[3], pixel[2] / pixel[3]}; }

// As one material of these colours and this opacity of a voxel length.
void ExpectMaterial(const Scene& scene, double opacity, Rgb color) {
  SetupOptions options = Unlit(opacity, color);
  const LocalImage image = Rendered(scene);
  Scene alone = MakeScene(scene.volume, options);
  alone.setup.camera = scene.setup.camera;
  EXPECT_LT(LargestDifference(image, Rendered(alone)), 1e-4F) << opacity << " " << color.r << " " << color.g;
}

TEST(Fields, ThatAddHaveTheirDensitiesAndMeanColour) {
  constexpr double kA = 0.3, kB = 0.2, kWeight = 0.6;
  Scene scene = MakeScene(MakeBlock(kGeometry), Unlit(kA, kRed));
  scene.Show(MakeBlock(kGeometry), {.transfer = Uniform(kB, kGreen), .range = {}, .weight = kWeight});
  const double b = 1 - std::pow(1 - kB, kWeight);
  ExpectMaterial(scene, 1 - (1 - kA) * (1 - b), {float(kA / (kA + b)), float(b / (kA + b)), 0});
}

TEST(Fields, ThatCoverThinTheOthers) {
  constexpr double kA = 0.3, kB = 0.6;
  Scene scene = MakeScene(MakeBlock(kGeometry), Unlit(kA, kRed));
  scene.Show(MakeBlock(kGeometry), {.transfer = Uniform(kB, kGreen), .range = {}, .blend = Blend::kOver});
  const double below = kA * (1 - kB);
  ExpectMaterial(scene, 1 - std::pow(1 - kA, 1 - kB) * (1 - kB), {float(below / (below + kB)), float(kB / (below + kB)), 0});
  scene.setup.fields[0].look.transfer = Uniform(1, kGreen);
  ExpectMaterial(scene, 1, kGreen);
}

TEST(Fields, InASliceAddTheirLight) {
  constexpr double kA = 1, kB = 0.75;
  Scene scene = MakeScene(MakeBlock(kGeometry), Unlit(kA, kRed));
  scene.Show(MakeBlock(kGeometry), {.transfer = Uniform(kB, {0, 1, 1}), .range = {}});
  scene.setup.flat = true;
  const LocalImage image = Rendered(scene);
  int pixels = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const auto pixel = PixelOf(image, x, y);
      if (pixel[3] < 0.99F) continue;
      ++pixels;
      EXPECT_NEAR(StraightOf(pixel).r, 1, 1e-4);
      EXPECT_NEAR(StraightOf(pixel).g, kB, 1e-4) << "one field does not take light from the other";
    }
  }
  EXPECT_GT(pixels, 100);
}

TEST(Fields, ShowTheVolumeAsItIsWhereTheyHaveNothing) {
  SetupOptions options;
  Scene scene = MakeScene(MakeBlobs(kGeometry, ScalarType::kUint16, 3), options);
  const LocalImage alone = Rendered(scene);
  const auto nothing = [](const Index3&) { return std::numeric_limits<double>::quiet_NaN(); };
  scene.Show(MakeVolume(kGeometry, ScalarType::kFloat32, nothing), {.transfer = Uniform(1, kGreen)});
  scene.Show(MakeBlobs(kGeometry, ScalarType::kUint8, 4), {.transfer = Uniform(1, kGreen), .range = {}, .weight = 0});
  EXPECT_LT(LargestDifference(Rendered(scene), alone), 1e-5F);
}

TEST(Fields, StandByThemselves) {
  Scene scene = MakeScene(MakeBlobs(kGeometry, ScalarType::kUint8, 3), {});
  scene.setup.weight = 0;
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    const Volume field = MakeBlobs(kGeometry, type, 5);
    scene.setup.fields.clear();
    scene.fields.clear();
    scene.Show(field, {.transfer = Ramp(0.4)});
    SetupOptions options;
    options.transfer = Ramp(0.4);
    EXPECT_LT(LargestDifference(Rendered(scene), Rendered(MakeScene(field, options))), 1e-5F);
  }
}

// The same matter in a grid whose axes point elsewhere: positions, gradients, lights and spacings are turned with it.
TEST(Fields, LookTheSameWhicheverWayTheirAxesPoint) {
  const VolumeGeometry grid = {{24, 20, 22}, {1, 0.8, 1.3}, {}};
  const Volume field = MakeBlobs(grid, ScalarType::kFloat32, 6);
  // x' = y, y' = -x, z' = z.
  VolumeGeometry turned = {{20, 24, 22}, {0.8, 1, 1.3}, {}};
  turned.orientation.axes = {Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}};
  turned.orientation.origin = {23, 0, 0};
  const Volume same = MakeVolume(turned, ScalarType::kFloat32, [&](const Index3& v) {
    return double(field.block.samples<float>()[field.block.Offset({23 - v.y, v.x, v.z})]);
  });
  SetupOptions options;
  options.view.azimuth_degrees = 33;
  options.view.elevation_degrees = 20;
  options.shading.lights = {{1, 2, 3}, {-1, 0.3, -0.2}};
  options.clipping.planes = {{{1, 0.5, 0.2}, 0.3}};
  Scene scene = MakeScene(MakeVolume(grid, ScalarType::kUint8, [](const Index3&) { return 0; }), options);
  scene.Show(field, {.transfer = Ramp(0.6)});
  const LocalImage expected = Rendered(scene);
  scene.setup.fields.clear();
  scene.fields.clear();
  scene.Show(same, {.transfer = Ramp(0.6)});
  EXPECT_LT(LargestDifference(Rendered(scene), expected), 1e-4F);
  EXPECT_GT(PixelOf(expected, 32, 32)[3], 0.1F);
}

// A coarser level of a field looks as the same level of a volume does.
TEST(Fields, HaveLevels) {
  VolumeGeometry coarse = {{12, 10, 11}, {2, 2, 2}, {}};
  coarse.orientation.origin = {0.5, 0.5, 0.5};
  const Volume fine = MakeBlobs(kGeometry, ScalarType::kUint16, 3), clear = MakeBlobs(coarse, ScalarType::kUint16, 4),
               shown = MakeBlobs(coarse, ScalarType::kUint16, 5);
  SetupOptions options;
  options.transfer = Ramp(0.4);
  options.view.azimuth_degrees = 25;
  const auto rendered = [&](const FrameSetup& setup, const Volume& volume, const Volume* field) {
    const LevelBox at = {{{0, 0, 0}, {24, 20, 12}}, 1};
    const auto data = CutBox(volume, PaddedBox(at, setup));
    std::unique_ptr<BoxData> of_field;
    if (field != nullptr) {
      of_field = CutBox(*field, PaddedBox(at, setup, setup.fields[0]));
      data->SetFields({of_field.get()});
    }
    RankReport report;
    return MakeRenderer(*setup.renderer)->Render(*data, at, setup, {}, RenderControl(), report).value();
  };
  Scene scene = MakeScene(fine, options);
  scene.setup.coarser = {{7, clear.description, {}}};
  const LocalImage expected = rendered(scene.setup, shown, nullptr);
  scene.setup.weight = 0;
  scene.setup.fields.push_back({.levels = {{8, fine.description, {}}, {9, shown.description, {}}},
                                .of_volume = {0, 1},
                                .look = {.transfer = options.transfer, .range = scene.setup.range}});
  EXPECT_LT(LargestDifference(rendered(scene.setup, clear, &shown), expected), 1e-5F);
  EXPECT_GT(PixelOf(expected, 32, 32)[3], 0.1F);
}

TEST(Fields, AddInAnyOrder) {
  constexpr unsigned kSeed = 71;
  std::mt19937 random(kSeed);
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32}) {
    SetupOptions options;
    options.view = RandomView(Projection::kPerspective, random);
    options.transfer = Ramp(0.3);
    Scene scene = MakeScene(MakeBlobs(kGeometry, type, 1), options, 1.5);
    scene.setup.weight = 0.7;
    for (unsigned i = 2; i < 5; ++i) {
      TransferFunction transfer = Ramp(0.1 * i);
      transfer.colors = {{0, {float(i) / 5, 0.5, 1}}, {200, {1, float(i) / 6, 0}}};
      scene.Show(MakeBlobs(kGeometry, type, i), {.transfer = transfer, .range = {}, .weight = 1.0 / i});
    }
    const LocalImage expected = Rendered(scene);
    Scene exchanged = scene;
    FieldLook& other = exchanged.setup.fields[1].look;
    std::swap(exchanged.volume, exchanged.fields[1]);
    std::swap(exchanged.setup.transfer, other.transfer);
    std::swap(exchanged.setup.range, other.range);
    std::swap(exchanged.setup.weight, other.weight);
    std::swap(exchanged.setup.fields[0], exchanged.setup.fields[2]);
    std::swap(exchanged.fields[0], exchanged.fields[2]);
    EXPECT_LT(LargestDifference(Rendered(exchanged), expected), 1e-5F) << "type " << int(type) << ", seed " << kSeed;
  }
}

// ---- shadows

SetupOptions Shadowed(SetupOptions options) {
  options.shading.shadows = 1;
  options.shading.ambient_occlusion = 0.7F;
  options.shading.lights = {{1, 0.4, 0.6}, {-0.2, 1, 0.3}};
  return options;
}

// A volume with a floor, and a field with a slab above half of it. The slab is black, so that what is seen through it tells of the floor.
TEST(Fields, CastShadowsOnEachOther) {
  constexpr double kOpacity = 0.06;
  const VolumeGeometry geometry = {{96, 64, 64}};
  const auto floor = [](const Index3& v) { return v.z < 10 ? 100 : 0; };
  const auto slab = [](const Index3& v) { return v.x < 48 && v.z >= 40 && v.z < 52 ? 100 : 0; };
  SetupOptions options;
  options.view = {.elevation_degrees = 20, .zoom = 1};
  options.size = {160, 160};
  options.shading = {.lights = {{0, 0, 1}}, .ambient = 0, .diffuse = 1, .specular = 0};
  const auto rendered = [&](bool floor_is_volume, float shadows, const Vec3& point) {
    options.transfer = floor_is_volume ? Uniform(1, {1, 1, 1}) : Uniform(kOpacity, {0, 0, 0});
    options.shading.shadows = shadows;
    Scene scene = MakeScene(floor_is_volume ? MakeVolume(geometry, ScalarType::kUint8, floor)  //
                                            : MakeVolume(geometry, ScalarType::kUint8, slab),
                            options);
    if (floor_is_volume) {
      scene.Show(MakeVolume(geometry, ScalarType::kUint8, slab), {.transfer = Uniform(kOpacity, {0, 0, 0})});
    } else {
      scene.Show(MakeVolume(geometry, ScalarType::kUint8, floor), {.transfer = Uniform(1, {1, 1, 1})});
    }
    const auto at = scene.setup.camera.Project(point);
    return double(PixelOf(Rendered(scene), int(at.x), int(at.y))[0]);
  };
  for (const bool floor_is_volume : {true, false}) {
    const auto ratio_at = [&](const Vec3& point) {
      const double lit = rendered(floor_is_volume, 0, point);
      EXPECT_GT(lit, 0.3);
      return rendered(floor_is_volume, 1, point) / lit;
    };
    // Values from 1 on have the opacity, so the interpolated slab is nearly a voxel longer.
    EXPECT_NEAR(ratio_at({24, 20, 9.5}), std::pow(1 - kOpacity, 12.99), 0.02) << floor_is_volume;
    EXPECT_NEAR(ratio_at({72, 20, 9.5}), 1, 0.01) << "beside the slab";
  }
}

TEST(Fields, CastTheSameShadowsInAnyOrder) {
  SetupOptions options = Shadowed({});
  options.view.azimuth_degrees = 40;
  const Volume a = MakeBlobs(kGeometry, ScalarType::kUint8, 1), b = MakeBlobs(kGeometry, ScalarType::kUint16, 2);
  TransferFunction of_a = Ramp(0.2), of_b = Ramp(0.4);
  of_b.colors = {{0, {0.5, 0.5, 1}}, {200, {1, 0.3F, 0}}};
  const auto rendered = [&](const Volume& volume, const TransferFunction& transfer, const Volume& field, const TransferFunction& other) {
    options.transfer = transfer;
    Scene scene = MakeScene(volume, options);
    scene.setup.weight = &volume == &a ? 0.6 : 0.9;
    scene.Show(field, {.transfer = other, .range = {}, .weight = &volume == &a ? 0.9 : 0.6});
    return Rendered(scene);
  };
  const LocalImage expected = rendered(a, of_a, b, of_b);
  EXPECT_LT(LargestDifference(rendered(b, of_b, a, of_a), expected), 1e-5F);
  options.shading.shadows = options.shading.ambient_occlusion = 0;
  EXPECT_GT(LargestDifference(rendered(a, of_a, b, of_b), expected), 0.1F);
}

TEST(Fields, CastNoShadowIfTheyAreHidden) {
  const Volume volume = MakeBlobs(kGeometry, ScalarType::kUint8, 1), field = MakeBlobs(kGeometry, ScalarType::kUint8, 2);
  SetupOptions options = Shadowed({});
  options.transfer = Ramp(0.3);
  Scene scene = MakeScene(volume, options), other = MakeScene(field, options);
  const LocalImage alone = Rendered(scene), other_alone = Rendered(other);
  scene.Show(field, {.transfer = Ramp(0.3), .range = {}, .weight = 0});
  EXPECT_LT(LargestDifference(Rendered(scene), alone), 1e-5F);
  scene.setup.weight = 0;
  scene.setup.fields[0].look.weight = 1;
  EXPECT_LT(LargestDifference(Rendered(scene), other_alone), 1e-5F);
}

// ---- any fields, boxes and instruction set

Vec3 Unit(const Vec3& v) { return (1 / std::sqrt(Dot(v, v))) * v; }

Scene RandomScene(unsigned seed, int i, bool shadows = false) {
  std::mt19937 random(seed + unsigned(i));
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto number = [&](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
  const VolumeGeometry geometry = {{23, 19, 27}, {1, 0.7, 1.4}, {}};
  SetupOptions options;
  options.view = RandomView(i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, random);
  options.transfer = Ramp(uniform(0.05, 0.9));
  if (i % 5 == 2) options.transfer.isosurfaces = {{60, {1, 1, 1}, 0.5}};
  if (i % 5 == 4) options.transfer.gradient_opacities = {{0, 0.2}, {30, 1}};
  if (i % 4 == 1) options.clipping = RandomClipping(geometry, random);
  if (i % 7 == 3) options.shading.model = ShadingModel::kNone;
  if (i % 3 == 1) options.shading.lights = {{1, 2, 3}, {-1, 0.3, -0.2}};
  options.size = {45, 38};
  if (shadows) options = Shadowed(std::move(options));
  Scene scene = MakeScene(MakeBlobs(geometry, ScalarType(1 + i % 3), unsigned(i)), options, i % 4 == 1 ? 2.5 : 1);
  scene.setup.weight = uniform(0.3, 1);
  scene.setup.flat = i % 6 == 5;
  for (int field = number(1, 3); field > 0; --field) {
    VolumeGeometry grid = geometry;
    if (number(0, 2) != 0) {
      grid.size = {number(5, 30), number(5, 30), number(5, 30)};
      grid.spacing = {uniform(0.4, 2), uniform(0.4, 2), uniform(0.4, 2)};
      const Vec3 x = Unit({uniform(-1, 1), uniform(-1, 1), uniform(0.1, 1)}), z = Unit(Cross(x, Vec3{uniform(-1, 1), 1, 0.3}));
      grid.orientation.axes = {x, Cross(z, x), z};
      // Its middle lies somewhere in the volume.
      grid.orientation.origin =
          Vec3{uniform(0, 22), uniform(0, 14), uniform(0, 36)} - grid.orientation.ToWorld(0.5 * grid.spacing * ToVec3(grid.size));
    }
    Volume volume = MakeBlobs(grid, ScalarType(number(1, 3)), unsigned(i) + 100 * unsigned(field));
    if (volume.description.type == ScalarType::kFloat32) {
      volume.block.samples<float>()[volume.block.box.voxel_count() / 2] = std::numeric_limits<float>::quiet_NaN();
    }
    scene.Show(std::move(volume), {.transfer = Ramp(uniform(0.05, 0.9)),
                                   .range = {},
                                   .weight = uniform(0.2, 1),
                                   .blend = number(0, 1) == 0 ? Blend::kAdd : Blend::kOver});
  }
  return scene;
}

TEST(Fields, DoNotDependOnBoxes) {
  constexpr unsigned kSeed = 330;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 16; ++i) {
    const Scene scene = RandomScene(kSeed, i);
    const Partition partition = CutAtRandom(scene.volume.description.geometry.bounds(), 2 + i % 5, random);
    const LocalImage frame = CombinedBoxes(scene.setup, partition, [&](const Box& box) { return Rendered(scene, box); });
    EXPECT_LE(LargestDifference(frame, Rendered(scene)), 5e-6F) << "case " << i << ", seed " << kSeed;
  }
}

// A worker that has more of a field than is drawn takes that, so that the voxels of one may begin elsewhere than those of another.
TEST(Fields, MayHaveMoreVoxelsThanAreDrawn) {
  constexpr unsigned kSeed = 332;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 16; ++i) {
    const Scene scene = RandomScene(kSeed, i);
    const Box whole = scene.volume.description.geometry.bounds();
    const SceneBoxes more(scene, whole);
    const std::unique_ptr<Renderer> renderer = MakeRenderer(*scene.setup.renderer);
    const Partition partition = CutAtRandom(whole, 5, random);
    for (const Box& box : partition.boxes()) {
      const SceneBoxes drawn(scene, box);
      const auto rendered = [&](const SceneBoxes& volume, const SceneBoxes& fields) {
        std::vector<BoxData*> voxels;
        for (std::size_t field = 0; field < scene.fields.size(); ++field) {
          voxels.push_back(drawn.fields[field] == nullptr ? nullptr : fields.fields[field].get());
        }
        volume.volume->SetFields(std::move(voxels));
        RankReport report;
        return renderer->Render(*volume.volume, box, scene.setup, {}, RenderControl(), report).value();
      };
      const LocalImage expected = rendered(drawn, drawn);
      EXPECT_EQ(LargestDifference(rendered(more, drawn), expected), 0) << "of the volume, case " << i << ", seed " << kSeed;
      EXPECT_EQ(LargestDifference(rendered(drawn, more), expected), 0) << "of the fields, case " << i << ", seed " << kSeed;
    }
  }
}

TEST(Fields, CastShadowsThatDoNotDependOnBoxes) {
  constexpr unsigned kSeed = 331;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 6; ++i) {
    const Scene scene = RandomScene(kSeed, i, true);
    const LocalImage one = Rendered(scene);
    for (const int boxes : {3, 8}) {
      const Partition partition = CutAtRandom(scene.volume.description.geometry.bounds(), boxes, random);
      const LocalImage frame = CombinedBoxes(scene.setup, partition, [&](const Box& box) { return Rendered(scene, box); });
      EXPECT_LE(LargestDifference(frame, one), 5e-6F) << "case " << i << ", " << boxes << " boxes, seed " << kSeed;
    }
  }
}

// Twice as far from it as one field: covering takes two powers a sample.
TEST(Fields, AgreeWithTheReference) {
  constexpr unsigned kSeed = 57;
  for (int i = 0; i < 16; ++i) {
    SCOPED_TRACE(::testing::Message() << "case " << i << ", seed " << kSeed);
    ExpectAgreesWithReference(RandomScene(kSeed, i), 4e-5F);
  }
}

}  // namespace
}  // namespace slabstream
