// Labels in the ray caster: formulas, the kernel against its reference, and that neither boxes nor the grid and the type of the labels
// matter.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "common/decomposition/decomposition.h"
#include "common/frame/smooth_label.h"
#include "common/kernels/combine.h"
#include "tests/support/random.h"
#include "tests/support/random_box.h"
#include "tests/support/renderers.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/raycast/scene_reference.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/frame_fields.h"
#include "worker/renderers/raycast/ray_labels.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

const RendererKind* RayCasting() { return FindRenderer("raycast"); }

const VolumeGeometry kGeometry = {{24, 20, 22}, {1, 1, 1}, {}};

// No look: labels are not shown.
Scene Labelled(const Volume& volume, const Volume& labels, SetupOptions options, std::optional<LabelLook> look) {
  options.renderer = RayCasting();
  Scene scene = {volume, {}, MakeSetup(volume, options)};
  if (look) scene.Show(labels, *std::move(look));
  return scene;
}

LabelLook Look(LabelMode mode, std::vector<LabelLook::Entry> entries, double tint = 1, std::vector<LabelLook::Span> shown = {}) {
  return {.mode = mode, .tint = tint, .entries = std::move(entries), .shown = std::move(shown)};
}

const Rgb kRed = {1, 0, 0}, kGreen = {0, 1, 0};

constexpr ScalarType kLabelTypes[] = {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kUint32, ScalarType::kUint64};
// Different labels of n > 0, which take all bytes of the type.
std::uint64_t LabelOf(ScalarType type, int n) {
  const std::uint64_t factor = type == ScalarType::kUint64 ? 0x0123456789ABCDEF : type == ScalarType::kUint32 ? 0x01234567 : 1;
  return std::uint64_t(n) * factor;
}

// A block within a clear surrounding: label 1 in the lower half along x, label 2 in the upper one (LabelOf).
bool InBlock(const Index3& v) { return v.x >= 4 && v.x < 20 && v.y >= 4 && v.y < 16 && v.z >= 4 && v.z < 18; }
Volume Block() {
  return MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3& v) { return InBlock(v) ? 100 : 0; });
}
Volume TwoLabels(ScalarType type = ScalarType::kUint8) {
  return MakeVolume(kGeometry, type, [&](const Index3& v) { return LabelOf(type, InBlock(v) ? v.x < 12 ? 1 : 2 : 0); });
}
Volume OneLabel() {
  return MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3&) { return 1; });
}

SetupOptions Unlit() {
  SetupOptions options;
  options.shading.model = ShadingModel::kNone;
  options.view.azimuth_degrees = 0;
  return options;
}

// Straight colours of all pixels that are not clear.
std::vector<Rgb> ColorsOf(const LocalImage& image) {
  std::vector<Rgb> colors;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const float alpha = image.rgba[i + 3];
    if (alpha > 1e-3F) colors.push_back({image.rgba[i] / alpha, image.rgba[i + 1] / alpha, image.rgba[i + 2] / alpha});
  }
  return colors;
}
bool IsNear(const Rgb& a, const Rgb& b) {
  return std::abs(a.r - b.r) < 1e-4F && std::abs(a.g - b.g) < 1e-4F && std::abs(a.b - b.b) < 1e-4F;
}

// Seen from the front, one ray meets one label.
TEST(Labels, HaveTheirOwnColoursAndNoThirdAtTheirBorder) {
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    for (const ScalarType type : kLabelTypes) {
      SetupOptions options = Unlit();
      // Material on label 0 beside the block: only what is labelled has a colour of a label.
      options.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{60, 0, 0.5, 1}, {61, 0.5, 0.5, 0}}};
      const LabelLook look = Look(mode, {{LabelOf(type, 1), kRed}, {LabelOf(type, 2), kGreen}});
      const LocalImage image = Rendered(Labelled(Block(), TwoLabels(type), options, look));
      int red = 0, green = 0;
      for (const Rgb& color : ColorsOf(image)) {
        if (IsNear(color, kRed)) {
          ++red;
        } else if (IsNear(color, kGreen)) {
          ++green;
        } else {
          FAIL() << "mode " << int(mode) << ": a third colour " << color.r << " " << color.g << " " << color.b;
        }
      }
      EXPECT_GT(red, 50);
      EXPECT_GT(green, 50);
    }
  }
}

TEST(Labels, OneThatIsClearIsMissingAndTheOtherStaysAsItIs) {
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    SetupOptions options = Unlit();
    options.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{60, 0, 0.5, 1}, {61, mode == LabelMode::kTint ? 0.5 : 0.0, 0.5, 0}}};
    const LocalImage both = Rendered(Labelled(Block(), TwoLabels(), options, Look(mode, {{1, kRed}, {2, kGreen}})));
    const LocalImage one = Rendered(Labelled(Block(), TwoLabels(), options, Look(mode, {{1, kRed}, {2, kGreen, 0}})));
    int kept = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const auto before = PixelOf(both, x, y), after = PixelOf(one, x, y);
        if (before[0] > 1e-3F) {
          EXPECT_EQ(after, before);
          ++kept;
        } else {
          EXPECT_EQ(after[3], 0) << "mode " << int(mode) << " at " << x << ", " << y;
        }
      }
    }
    EXPECT_GT(kept, 50);
  }
}

// As if it were not in the file, to the last bit: samples and isosurfaces.
TEST(Labels, OneThatIsNotShownLeavesTheVolumeAsItIs) {
  const Volume blobs = MakeBlobs(kGeometry, ScalarType::kUint8, 5), both = TwoLabels();
  const Volume one = MakeVolume(kGeometry, ScalarType::kUint8,
                                [&](const Index3& v) { return both.block.samples<std::uint8_t>()[both.block.Offset(v)] == 1 ? 1 : 0; });
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    SetupOptions options = Unlit();
    options.transfer = Ramp(0.3);
    options.transfer.isosurfaces = {{90, {1, 1, 1}, 0.5}};
    const LocalImage hidden = Rendered(Labelled(blobs, both, options, Look(mode, {{1, kRed, 0.5F}, {2, kGreen, 0}}, 0.7, {{1, 1}})));
    const LocalImage expected = Rendered(Labelled(blobs, one, options, Look(mode, {{1, kRed, 0.5F}}, 0.7)));
    EXPECT_FALSE(ColorsOf(hidden).empty());
    EXPECT_EQ(hidden.rgba, expected.rgba);
    const LocalImage neither = Rendered(Labelled(blobs, both, options, Look(mode, {{1, kRed}, {2, kGreen}}, 1, {{3, 1000}})));
    EXPECT_LE(LargestDifference(neither, Rendered(Labelled(blobs, both, options, std::nullopt))), 1e-6F);
  }
}

// As if its opacity were 0.
TEST(Labels, OneThatIsNotShownTakesItsMaterialAwayIfTheLookHides) {
  const Volume blobs = MakeBlobs(kGeometry, ScalarType::kUint8, 5);
  SetupOptions options;
  options.transfer = Ramp(0.3);
  LabelLook hides = Look(LabelMode::kTint, {{1, kRed}, {2, kGreen}}, 0.7, {{1, 1}});
  hides.hides = true;
  const LocalImage image = Rendered(Labelled(blobs, TwoLabels(), options, hides));
  const LabelLook clear = Look(LabelMode::kTint, {{1, kRed}, {2, kGreen, 0}}, 0.7);
  EXPECT_FALSE(ColorsOf(image).empty());
  EXPECT_EQ(image.rgba, Rendered(Labelled(blobs, TwoLabels(), options, clear)).rgba);
}

// A surface needs no transfer function, and hides the material in its place.
TEST(Labels, SurfacesStandWhateverTheTransferFunctionSays) {
  SetupOptions clear = Unlit(), blue = Unlit();
  clear.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{0, 0}}};
  blue.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{60, 0, 0.5, 1}, {61, 1, 0.5, 0}}};
  const LabelLook look = Look(LabelMode::kSurface, {{1, kRed}, {2, kGreen}});
  const LocalImage alone = Rendered(Labelled(Block(), TwoLabels(), clear, look));
  EXPECT_FALSE(ColorsOf(alone).empty());
  for (const Rgb& color : ColorsOf(Rendered(Labelled(Block(), TwoLabels(), blue, look)))) EXPECT_LT(color.b, 1e-4F);
}

// The opacity of a label is a factor of the material's, for a voxel length of it.
TEST(Labels, OpacityThinsTheMaterial) {
  for (const std::string rate : {"1", "2", "0.7"}) {
    SetupOptions options = Unlit();
    options.transfer = Uniform(0.2, {1, 1, 1});
    Scene thin = Labelled(MakeBlock(kGeometry), OneLabel(), options, Look(LabelMode::kTint, {{1, kRed, 0.25F}}, 0));
    options.transfer = Uniform(0.05, {1, 1, 1});
    Scene expected = Labelled(MakeBlock(kGeometry), OneLabel(), options, std::nullopt);
    for (Scene* scene : {&thin, &expected}) SetParameters(ParseParameters(*RayCasting(), {{"sampling-rate", rate}}).value(), scene->setup);
    EXPECT_LT(LargestDifference(Rendered(thin), Rendered(expected)), 1e-4F);
  }
}

TEST(Labels, TintMixesColours) {
  SetupOptions options = Unlit();
  options.transfer = Uniform(0.3, {0, 0, 1});
  const LocalImage image = Rendered(Labelled(MakeBlock(kGeometry), OneLabel(), options, Look(LabelMode::kTint, {{1, kRed}}, 0.25)));
  ASSERT_FALSE(ColorsOf(image).empty());
  for (const Rgb& color : ColorsOf(image)) EXPECT_TRUE(IsNear(color, {0.25F, 0, 0.75F}));
}

// The surface of a padded box of a label at right angles to the view is lit as one: its normal looks at the viewer everywhere.
TEST(Labels, NormalsOfAPlaneAreThoseOfThePlane) {
  const Volume clear = MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3&) { return 0; });
  const Volume labels = MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3& v) { return v.y >= 8 ? 1 : 0; });
  SetupOptions options;
  options.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{0, 0}}};
  options.shading.specular = 0;
  options.shading.ambient = 0.1F;
  options.shading.diffuse = 0.8F;
  const LocalImage image = Rendered(Labelled(clear, labels, options, Look(LabelMode::kSurface, {{1, {1, 1, 1}}})));
  for (int y = 28; y < 36; ++y) {
    for (int x = 28; x < 36; ++x) {
      EXPECT_NEAR(PixelOf(image, x, y)[0], 0.9, 1e-3);
      EXPECT_NEAR(PixelOf(image, x, y)[3], 1, 1e-3);
    }
  }
}

// ---- grids of their own, and many labels

// The same labels in a grid whose axes point elsewhere: positions and normals are turned with it.
TEST(Labels, LookTheSameWhicheverWayTheirAxesPoint) {
  const VolumeGeometry grid = {{24, 20, 22}, {1, 0.8, 1.3}, {}};
  const Volume volume = MakeBlobs(grid, ScalarType::kUint16, 6), shapes = MakeBlobs(grid, ScalarType::kUint8, 7);
  const auto label = [&](const Index3& v) { return shapes.block.samples<std::uint8_t>()[shapes.block.Offset(v)] / 40; };
  // x' = y, y' = -x, z' = z.
  VolumeGeometry turned = {{20, 24, 22}, {0.8, 1, 1.3}, {}};
  turned.orientation.axes = {Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}};
  turned.orientation.origin = {23, 0, 0};
  SetupOptions options;
  options.view.azimuth_degrees = 33;
  options.view.elevation_degrees = 20;
  options.shading.lights = {{1, 2, 3}, {-1, 0.3, -0.2}};
  options.transfer.isosurfaces = {{90, {1, 1, 1}, 0.5}};
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    const LabelLook look = Look(mode, {{1, kRed, 0.5F}, {2, kGreen, 0.8F}}, 0.6, {{1, 3}});
    const LocalImage expected = Rendered(Labelled(volume, MakeVolume(grid, ScalarType::kUint8, label), options, look));
    const Volume same = MakeVolume(turned, ScalarType::kUint8, [&](const Index3& v) { return label({23 - v.y, v.x, v.z}); });
    EXPECT_LT(LargestDifference(Rendered(Labelled(volume, same, options, look)), expected), 1e-4F);
    EXPECT_GT(LargestDifference(Rendered(Labelled(volume, same, options, std::nullopt)), expected), 0.1F);
  }
}

// A voxel of a coarser grid that covers eight voxels of the volume is the label of each. Beyond that grid there are none.
TEST(Labels, OfACoarserGridAreThoseOfTheVoxelsInTheirs) {
  const Volume blobs = MakeBlobs(kGeometry, ScalarType::kUint8, 5);
  const auto label = [](const Index3& v) { return LabelOf(ScalarType::kUint64, (v.x + 2 * v.y + 3 * v.z) % 4); };
  for (const Index3 size : {Index3{12, 10, 11}, Index3{7, 10, 8}}) {
    VolumeGeometry grid = {size, {2, 2, 2}, {}};
    grid.orientation.origin = {0.5, 0.5, 0.5};
    const Volume coarse = MakeVolume(grid, ScalarType::kUint64, label);
    const Volume copies = MakeVolume(kGeometry, ScalarType::kUint64, [&](const Index3& v) {
      const Index3 voxel = {v.x / 2, v.y / 2, v.z / 2};
      return grid.bounds().Contains(voxel) ? label(voxel) : 0;
    });
    for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
      SetupOptions options = Unlit();  // normals are those of each grid
      options.view.azimuth_degrees = 31;
      options.view.elevation_degrees = 17;
      const LabelLook look = Look(mode, {{LabelOf(ScalarType::kUint64, 1), kRed, 0.5F}, {LabelOf(ScalarType::kUint64, 2), kGreen, 0.1F}});
      const LocalImage expected = Rendered(Labelled(blobs, copies, options, look));
      EXPECT_LT(LargestDifference(Rendered(Labelled(blobs, coarse, options, look)), expected), 1e-6F) << "mode " << int(mode);
      EXPECT_FALSE(ColorsOf(expected).empty());
    }
  }
}

// Each voxel has a label of its own.
const VolumeGeometry kManyGrid = {{48, 44, 40}, {1, 1, 1}, {}};
std::uint64_t ManyLabelOf(const Index3& v) { return 1 + NumberIn(kManyGrid.size, v) * 0x100000007; }

TEST(Labels, MayBeManyInABox) {
  const Volume clear = MakeVolume(kManyGrid, ScalarType::kUint8, [](const Index3&) { return 0; });
  const Volume many = MakeVolume(kManyGrid, ScalarType::kUint64, ManyLabelOf);
  ASSERT_GT(many.block.box.voxel_count(), 65536);
  SetupOptions options = Unlit();
  options.view.azimuth_degrees = 25;
  options.view.elevation_degrees = 15;
  // One voxel of all.
  const Index3 last = {47, 43, 39}, middle = {24, 22, 20};
  for (const Index3& shown : {middle, last}) {
    const std::uint64_t label = ManyLabelOf(shown);
    const LocalImage image = Rendered(Labelled(clear, many, options, Look(LabelMode::kSurface, {{label, kRed}}, 1, {{label, label}})));
    const Volume one = MakeVolume(kManyGrid, ScalarType::kUint8, [&](const Index3& v) { return v == shown ? 1 : 0; });
    const LocalImage expected = Rendered(Labelled(clear, one, options, Look(LabelMode::kSurface, {{1, kRed}})));
    EXPECT_EQ(LargestDifference(image, expected), 0);
    EXPECT_FALSE(ColorsOf(image).empty());
  }
  // All of half of the slices: the matter of one label, in many colours.
  const LabelLook half = Look(LabelMode::kSurface, {}, 1, {{ManyLabelOf({0, 0, 20}), ManyLabelOf(last)}});
  const LocalImage image = Rendered(Labelled(clear, many, options, half));
  const Volume upper = MakeVolume(kManyGrid, ScalarType::kUint8, [](const Index3& v) { return v.z >= 20 ? 1 : 0; });
  const LocalImage expected = Rendered(Labelled(clear, upper, options, Look(LabelMode::kSurface, {})));
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) ASSERT_EQ(PixelOf(image, x, y)[3], PixelOf(expected, x, y)[3]) << x << " " << y;
  }
}

// The numbers stand for the labels of the voxels, in as few bytes as there are labels in the box.
TEST(LabelVolume, NumbersTheLabelsOfABox) {
  for (const ScalarType type : {ScalarType::kUint32, ScalarType::kUint64}) {
    for (const bool many : {false, true}) {
      const auto label = [&](const Index3& v) {
        return many ? type == ScalarType::kUint64 ? ManyLabelOf(v) : 3 * (1 + NumberIn(kManyGrid.size, v)) : LabelOf(type, v.x % 3);
      };
      BoxData data(std::move(MakeVolume(kManyGrid, type, label).block));
      const NumberedLabels& found = *data.CacheOf<LabelVolume>().Of(data).value();
      const PaddedVoxels& numbers = found.numbers.voxels;
      EXPECT_EQ(numbers.type, many ? ScalarType::kUint32 : ScalarType::kUint16);
      ASSERT_TRUE(std::ranges::is_sorted(found.values));
      EXPECT_EQ(found.values.front(), 0U);
      EXPECT_EQ(found.values.size(), many ? 1 + std::size_t(kManyGrid.bounds().voxel_count()) : 3U);
      for (Index3 v; v.z < kManyGrid.size.z; ++v.z) {
        for (v.y = 0; v.y < kManyGrid.size.y; ++v.y) {
          for (v.x = 0; v.x < kManyGrid.size.x; ++v.x) {
            const std::uint64_t number =
                VisitLabelType(numbers.type, [&]<class T>(const T*) { return std::uint64_t{*reinterpret_cast<const T*>(numbers.At(v))}; });
            ASSERT_EQ(found.values.at(number), label(v));
          }
        }
      }
    }
  }
}

// Of the labels that a box has: no voxel is numbered again.
TEST(LabelVolume, FindsStylesOfALookForEachNumber) {
  BoxData data(std::move(MakeVolume(kManyGrid, ScalarType::kUint64, ManyLabelOf).block));
  auto& volume = data.CacheOf<LabelVolume>();
  const NumberedLabels* const found = volume.Of(data).value();
  const std::byte* const voxels = found->numbers.voxels.samples.get();
  std::vector<LabelLook::Span> every_other;
  for (std::int32_t x = 0; x < kManyGrid.size.x; x += 2) every_other.push_back({ManyLabelOf({x, 7, 30}), ManyLabelOf({x, 7, 30})});
  for (const LabelLook& look :
       {Look(LabelMode::kSurface, {}), Look(LabelMode::kTint, {{ManyLabelOf({2, 7, 30}), kRed, 0.3F}}, 1, every_other),
        Look(LabelMode::kSurface, {}, 1, {{ManyLabelOf({5, 5, 5}), ManyLabelOf({6, 6, 6})}})}) {
    const std::vector<LabelStyle>& styles = volume.StylesOf(look);
    ASSERT_EQ(styles.size(), found->values.size());
    for (std::size_t i = 0; i < styles.size(); ++i) {
      const LabelStyle expected = StyleOf(look, found->values[i]);
      ASSERT_EQ(styles[i].color, expected.color);
      ASSERT_EQ(styles[i].opacity, expected.opacity);
      ASSERT_EQ(styles[i].shown, expected.shown);
    }
    EXPECT_EQ(volume.Of(data).value(), found);
    EXPECT_EQ(found->numbers.voxels.samples.get(), voxels);
  }
}

// What is kept of a box is made anew where a look needs it.
TEST(Labels, ABoxFollowsTheLook) {
  const Volume blobs = MakeBlobs(kGeometry, ScalarType::kUint8, 5);
  const Box box = kGeometry.bounds();
  SetupOptions options;
  Scene scene = Labelled(blobs, TwoLabels(ScalarType::kUint64), options, LabelLook());
  const SceneBoxes boxes(scene, box);
  const auto renderer = MakeRenderer(*RayCasting());
  const std::uint64_t one = LabelOf(ScalarType::kUint64, 1), two = LabelOf(ScalarType::kUint64, 2);
  for (const LabelLook& look : {Look(LabelMode::kTint, {{one, kRed}}), Look(LabelMode::kSurface, {{one, kRed}}, 1, {{two, two}}),
                                Look(LabelMode::kSurface, {{one, kRed}}, 1, {{one, one}}), Look(LabelMode::kSurface, {{one, kGreen, 0}}),
                                Look(LabelMode::kTint, {})}) {
    scene.setup.fields[0].labels = look;
    RankReport report;
    EXPECT_EQ(renderer->Render(*boxes.volume, box, scene.setup, {}, RenderControl(), report).value().rgba, Rendered(scene).rgba);
  }
}

// ---- smooth surfaces

LabelLook Smooth(LabelLook look) {
  look.smooth = true;
  return look;
}
constexpr std::uint64_t kWide = 0xFEDCBA9876543210;  // a label that takes all of 64 bits
const TransferFunction kNothing = {.colors = {{0, {0, 0, 1}}}, .opacities = {{0, 0}}};

// A ball of one label, seen from anywhere.
struct Ball {
  VolumeGeometry grid = {{40, 40, 40}, {1, 1, 1}, {}};
  Vec3 centre = {19.3, 20.6, 19.9};
  double radius = 13.4;

  Scene Shown(const LabelLook& look, const SetupOptions& options, const std::string& rate) const {
    const Volume clear = MakeVolume(grid, ScalarType::kUint8, [](const Index3&) { return 0; });
    const Volume labels =
        MakeVolume(grid, ScalarType::kUint64, [&](const Index3& v) { return Length(ToVec3(v) - centre) < radius ? kWide : 0; });
    Scene scene = Labelled(clear, labels, options, look);
    SetParameters(ParseParameters(*RayCasting(), {{"sampling-rate", rate}}).value(), scene.setup);
    return scene;
  }
  // Calls use(x, y, where the ray enters, length of the ray in the ball) for pixels whose rays meet the ball well.
  template <class Use>
  void ForEachHit(const FrameSetup& setup, Use&& use) const {
    ASSERT_EQ(setup.camera.supersample, 1);
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
        const Vec3 from = ray.origin - centre, along = (1 / Length(ray.direction)) * ray.direction;
        const double middle = -Dot(from, along), half = std::sqrt(std::max(radius * radius - Dot(from, from) + middle * middle, 0.0));
        if (half > 0.4 * radius) use(x, y, ray.origin + (middle - half) * along, 2 * half);
      }
    }
  }
};

// As many voxels as half the weight are at least as opaque as the place, and not as many are more opaque.
TEST(SmoothLabels, APlaceHasTheMedianOpacity) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  const auto weight = [](double distance) {
    const double d = std::abs(distance);
    return d < 1 ? 2.0 / 3 - d * d + d * d * d / 2 : d < 2 ? (2 - d) * (2 - d) * (2 - d) / 6 : 0;
  };
  constexpr double kOpacities[] = {-1, 0, 0.25, 1};
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    std::uniform_real_distribution<double> part(0, 1);
    const Vec3 fraction = {part(random), part(random), part(random)};
    std::array<LabelledVoxel, 64> around;
    for (LabelledVoxel& voxel : around) {
      voxel.label = random() % std::uint64_t(2 + i % 7);
      voxel.opacity = kOpacities[voxel.label % 4];
    }
    const LabelledVoxel found = SmoothLabel(around, fraction);
    double as_opaque = 0, more_opaque = 0;
    std::map<std::uint64_t, double> of_opacity;  // labels
    for (int v = 0; v < 64; ++v) {
      const double of = weight(v % 4 - 1 - fraction.x) * weight(v / 4 % 4 - 1 - fraction.y) * weight(v / 16 - 1 - fraction.z);
      const auto& [label, opacity] = around.at(std::size_t(v));
      as_opaque += opacity >= found.opacity ? of : 0;
      more_opaque += opacity > found.opacity ? of : 0;
      if (opacity == found.opacity) of_opacity[label] += of;
    }
    EXPECT_GE(as_opaque, 0.5 - 2 * kWeightMargin);
    EXPECT_LT(more_opaque, 0.5);
    if (found.opacity < 0) continue;
    for (const auto& [label, of] : of_opacity) EXPECT_GE(of_opacity[found.label], of - 2 * kWeightMargin);
  }
}

// The opacity of a pixel tells the length of its ray in the ball, from one surface to the other.
TEST(SmoothLabels, TheSurfacesOfABallLieAFractionOfAVoxelFromIt) {
  constexpr unsigned kSeed = 12;
  std::mt19937 random(kSeed);
  constexpr float kOpacity = 0.02F;
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const Ball ball;
    SetupOptions options = Unlit();
    options.transfer = kNothing;
    options.view = RandomView(kProjections[i % 2], random);
    const auto error = [&](const LabelLook& look) {
      const Scene scene = ball.Shown(look, options, "8");
      const LocalImage image = Rendered(scene);
      double squares = 0;
      int count = 0;
      ball.ForEachHit(scene.setup, [&](int x, int y, const Vec3& /*enters*/, double length) {
        const double seen = std::log1p(-double(PixelOf(image, x, y)[3])) / std::log1p(-double(kOpacity));
        squares += (seen - length) * (seen - length);
        ++count;
      });
      EXPECT_GT(count, 100);
      return std::sqrt(squares / count);
    };
    const LabelLook look = Look(LabelMode::kSurface, {{kWide, kRed, kOpacity}});
    const double smooth = error(Smooth(look));
    EXPECT_LT(smooth, 0.35);
    EXPECT_LT(smooth, 0.6 * error(look));
  }
}

// Lights along the axes tell the components of normals.
TEST(SmoothLabels, TheNormalsOfABallAreItsOwn) {
  constexpr unsigned kSeed = 13;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const Ball ball;
    SetupOptions options;
    options.transfer = kNothing;
    options.shading.ambient = options.shading.specular = 0;
    options.shading.diffuse = 1;
    options.view = RandomView(kProjections[i % 2], random);
    const auto error = [&](const LabelLook& look) {
      std::vector<LocalImage> images;
      for (const Axis axis : kAxes) {
        Vec3 light;
        light[axis] = 1;
        options.shading.lights = {light};
        images.push_back(Rendered(ball.Shown(look, options, "1")));
      }
      double sum = 0, worst = 0;
      int count = 0;
      ball.ForEachHit(ball.Shown(look, options, "1").setup, [&](int x, int y, const Vec3& enters, double /*length*/) {
        const Vec3 seen = {PixelOf(images[0], x, y)[0], PixelOf(images[1], x, y)[0], PixelOf(images[2], x, y)[0]};
        const Vec3 normal = (1 / ball.radius) * Absolute(enters - ball.centre);
        const double degrees = std::acos(std::min(Dot(seen, normal) / Length(seen), 1.0)) * 57.29578;
        sum += degrees;
        worst = std::max(worst, degrees);
        ++count;
      });
      EXPECT_GT(count, 100);
      return std::pair(sum / count, worst);
    };
    const LabelLook look = Look(LabelMode::kSurface, {{kWide, {1, 1, 1}}});
    const auto [mean, worst] = error(Smooth(look));
    EXPECT_LT(mean, 4);
    EXPECT_LT(worst, 15);
    EXPECT_LT(mean, 0.5 * error(look).first);
  }
}

// However many labels it has: there are no grooves between them.
TEST(SmoothLabels, LabelsOfOneOpacityHaveOneSurface) {
  const Volume shapes = MakeBlobs(kGeometry, ScalarType::kUint8, 4);
  const auto parts = [&](int count) {
    return MakeVolume(kGeometry, ScalarType::kUint64, [&](const Index3& v) {
      const bool inside = shapes.block.samples<std::uint8_t>()[shapes.block.Offset(v)] > 60;
      return inside ? LabelOf(ScalarType::kUint64, 1 + (v.x / 5 + v.y / 6 + v.z / 4) % count) : 0;
    });
  };
  const Volume clear = MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3&) { return 0; });
  for (const float opacity : {0.3F, 1.0F}) {
    SetupOptions options = Unlit();
    options.transfer = kNothing;
    options.view.azimuth_degrees = 33;
    options.view.elevation_degrees = 21;
    std::vector<LabelLook::Entry> entries;
    const Rgb colors[] = {kRed, kGreen, {0, 0, 1}};
    for (int n = 1; n <= 3; ++n) entries.push_back({LabelOf(ScalarType::kUint64, n), colors[n - 1], opacity});
    const LabelLook look = Smooth(Look(LabelMode::kSurface, entries));
    const LocalImage many = Rendered(Labelled(clear, parts(3), options, look));
    const LocalImage one = Rendered(Labelled(clear, parts(1), options, look));
    int opaque = 0;
    std::array<int, 3> seen{};
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const auto pixel = PixelOf(many, x, y);
        ASSERT_NEAR(pixel[3], PixelOf(one, x, y)[3], 1e-5) << x << " " << y;
        opaque += pixel[3] > 0 ? 1 : 0;
        for (std::size_t c = 0; c < 3; ++c) seen.at(c) += pixel.at(c) > 0.5F * pixel[3] ? 1 : 0;
      }
    }
    EXPECT_GT(opaque, 400);
    for (const int of : seen) EXPECT_GT(of, 40);
  }
}

// Rounding decides nothing half-way between two voxels: the face of a block at right angles to the view is one colour and one depth.
TEST(SmoothLabels, OfAPlaneBetweenTwoVoxelsAreAPlane) {
  const Volume clear = MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3&) { return 0; });
  const Volume labels = MakeVolume(kGeometry, ScalarType::kUint16, [](const Index3& v) { return v.y < 8 ? 1 : 2; });
  SetupOptions options = Unlit();
  options.transfer = kNothing;
  Scene scene = Labelled(clear, labels, options, Smooth(Look(LabelMode::kSurface, {{1, kRed, 0.2F}, {2, kGreen, 0.4F}})));
  SetParameters(ParseParameters(*RayCasting(), {{"sampling-rate", "2"}}).value(), scene.setup);  // samples lie on the plane, too
  const LocalImage image = Rendered(scene);
  for (int y = 25; y < 39; ++y) {
    for (int x = 25; x < 39; ++x) {
      for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(PixelOf(image, x, y).at(c), PixelOf(image, 32, 32).at(c), 1e-5);
    }
  }
}

TEST(SmoothLabels, DoNotDependOnWorkers) {
  constexpr unsigned kSeed = 61;
  std::mt19937 random(kSeed);
  const VolumeGeometry geometry = {{40, 33, 37}, {1, 0.8, 1.2}, {}};
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const VolumeGeometry grid = i % 2 == 0 ? geometry : RandomGridIn(geometry, random);
    const Volume shapes = MakeBlobs(grid, ScalarType::kUint8, unsigned(i));
    const Volume labels = MakeVolume(grid, ScalarType::kUint64, [&](const Index3& v) {
      return LabelOf(ScalarType::kUint64, shapes.block.samples<std::uint8_t>()[shapes.block.Offset(v)] / 50);
    });
    SetupOptions options;
    options.transfer = Ramp(0.1);
    options.view = RandomView(kProjections[random() % 2], random);
    const LabelLook look = Smooth(Look(LabelMode::kSurface, {{LabelOf(ScalarType::kUint64, 1), kRed, 0.3F}}));
    const Scene scene = Labelled(MakeBlobs(geometry, ScalarType::kUint8, 9), labels, options, look);
    const LocalImage whole = Rendered(scene);
    for (const int workers : {1, 3, 8}) {
      for (const Partition& partition :
           {CutIntoSlabs(scene.volume, workers, Axis(i % 3)), CutAtRandom(geometry.bounds(), workers, random)}) {
        const LocalImage frame = CombinedBoxes(scene.setup, partition, [&](const Box& box) { return Rendered(scene, box); });
        EXPECT_LE(LargestDifference(frame, whole), 5e-6F) << workers << " workers";
      }
    }
  }
}

// ---- any boxes, any instruction set

Scene RandomScene(unsigned seed, int i) {
  std::mt19937 random(seed + unsigned(i));
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const VolumeGeometry geometry = {{23, 19, 27}, {1, 0.7, 1.4}, {}};
  const VolumeGeometry grid = i % 3 == 0 ? geometry : RandomGridIn(geometry, random);
  const Volume shapes = MakeBlobs(grid, ScalarType::kUint8, unsigned(i) + 100);
  const ScalarType type = kLabelTypes[i % 4];
  const auto label = [&](const Index3& v) {
    return LabelOf(type, std::min(shapes.block.samples<std::uint8_t>()[shapes.block.Offset(v)] / 40, 4));
  };
  LabelLook look = Look(i % 8 < 4 ? LabelMode::kTint : LabelMode::kSurface,
                        {{LabelOf(type, 1), kRed, 0.5F},
                         {LabelOf(type, 2), kGreen},
                         {LabelOf(type, 3), {0, 0, 1}, 0},
                         {LabelOf(type, 4), {1, 1, 0}, float(uniform(0, 1))}},
                        uniform(0, 1));
  look.smooth = look.mode == LabelMode::kSurface && i % 3 != 0;
  if (i % 5 == 0) look.shown = {{1, LabelOf(type, 1)}, {LabelOf(type, 3), ~std::uint64_t{0}}};
  SetupOptions options;
  options.view = RandomView(i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, random);
  options.transfer = Ramp(uniform(0.05, 0.9));
  if (i % 5 == 2) options.transfer.isosurfaces = {{60, {1, 1, 1}, 0.5}, {120, {0, 1, 1}, 0.8}};
  if (i % 5 == 4) options.transfer.gradient_opacities = {{0, 0.2}, {30, 1}};
  if (i % 4 == 1) options.clipping = RandomClipping(geometry, random);
  if (i % 7 == 3) options.shading.model = ShadingModel::kNone;
  options.size = {45, 38};
  const Volume labels = MakeVolume(grid, type, label);
  Scene scene = Labelled(MakeBlobs(geometry, ScalarType(1 + i % 3), unsigned(i)), labels, options, std::nullopt);
  if (i % 6 == 5) scene.Show(MakeBlobs(RandomGridIn(geometry, random), ScalarType::kUint16, 9), {.transfer = Ramp(0.3)});
  scene.Show(labels, std::move(look));
  SetParameters(ParseParameters(*RayCasting(), {{"sampling-rate", i % 4 == 1 ? "2.5" : "1"}}).value(), scene.setup);
  return scene;
}

TEST(Labels, DoNotDependOnBoxes) {
  constexpr unsigned kSeed = 310;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 24; ++i) {
    const Scene scene = RandomScene(kSeed, i);
    const Partition partition = CutAtRandom(scene.volume.description.geometry.bounds(), 2 + i % 5, random);
    const LocalImage frame = CombinedBoxes(scene.setup, partition, [&](const Box& box) { return Rendered(scene, box); });
    EXPECT_LE(LargestDifference(frame, Rendered(scene)), 5e-6F) << "case " << i << ", seed " << kSeed;
  }
}

// A sample may lie so near the border of two labels that float32 takes the other one: of the next cases, 27 has one such pixel.
TEST(Labels, AgreeWithTheReference) {
  constexpr unsigned kSeed = 47;
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(::testing::Message() << "case " << i << ", seed " << kSeed);
    ExpectAgreesWithReference(RandomScene(kSeed, i), 4e-5F);
  }
}

}  // namespace
}  // namespace slabstream
