// Labels in the ray caster: formulas, the kernel against its reference, and that boxes do not matter.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/decomposition/decomposition.h"
#include "common/kernels/combine.h"
#include "tests/support/random.h"
#include "tests/support/random_box.h"
#include "tests/support/renderers.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/renderers/raycast/march_reference.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/layer_volume.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

const RendererKind* RayCasting() { return FindRenderer("raycast"); }

const VolumeGeometry kGeometry = {{24, 20, 22}, {1, 1, 1}, {}};

std::shared_ptr<const Volume> Shared(Volume volume) { return std::make_shared<const Volume>(std::move(volume)); }

std::unique_ptr<BoxData> CutLayered(const LayeredVolume& volume, const Box& box) {
  BoxLayers layers;
  if (volume.layers.labels != nullptr) layers.labels.emplace(CutBlock(volume.layers.labels->block, box));
  return std::make_unique<BoxData>(CutBlock(volume.volume->block, box), std::move(layers));
}

FrameSetup LayeredSetup(const LayeredVolume& volume, SetupOptions options, LayerLooks looks) {
  options.renderer = RayCasting();
  FrameSetup setup = MakeSetup(*volume.volume, options);
  setup.layers = volume.layers.types();
  setup.looks = std::move(looks);
  return setup;
}

LocalImage Rendered(const LayeredVolume& volume, const FrameSetup& setup, const Box& box) {
  const auto data = CutLayered(volume, PaddedBox(box, setup));
  RankReport report;
  return MakeRenderer(*setup.renderer)->Render(*data, box, setup, {}, RenderControl(), report).value();
}
LocalImage Rendered(const LayeredVolume& volume, const FrameSetup& setup) {
  return Rendered(volume, setup, volume.volume->description.geometry.bounds());
}

LabelLook Look(LabelMode mode, std::vector<LabelLook::Entry> entries, double tint = 1) {
  return {.mode = mode, .tint = tint, .entries = std::move(entries)};
}

const Rgb kRed = {1, 0, 0}, kGreen = {0, 1, 0};

// Label 1 in the lower half along x, label 2 in the upper half of a block within a clear surrounding.
LayeredVolume TwoLabels(ScalarType type = ScalarType::kUint8) {
  const auto inside = [](const Index3& v) { return v.x >= 4 && v.x < 20 && v.y >= 4 && v.y < 16 && v.z >= 4 && v.z < 18; };
  LayeredVolume volume{.volume = Shared(MakeVolume(kGeometry, ScalarType::kUint8, [&](const Index3& v) { return inside(v) ? 100 : 0; }))};
  volume.layers.labels = Shared(MakeVolume(kGeometry, type, [&](const Index3& v) { return inside(v) ? v.x < 12 ? 1 : 2 : 0; }));
  return volume;
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
    for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16}) {
      const LayeredVolume volume = TwoLabels(type);
      SetupOptions options = Unlit();
      // Material on label 0 beside the block: only what is labelled has a colour of a label.
      options.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{60, 0, 0.5, 1}, {61, 0.5, 0.5, 0}}};
      const LocalImage image = Rendered(volume, LayeredSetup(volume, options, {.labels = Look(mode, {{kRed}, {kGreen}})}));
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
  const LayeredVolume volume = TwoLabels();
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    SetupOptions options = Unlit();
    options.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{60, 0, 0.5, 1}, {61, mode == LabelMode::kTint ? 0.5 : 0.0, 0.5, 0}}};
    const LocalImage both = Rendered(volume, LayeredSetup(volume, options, {.labels = Look(mode, {{kRed}, {kGreen}})}));
    const LocalImage one = Rendered(volume, LayeredSetup(volume, options, {.labels = Look(mode, {{kRed}, {kGreen, 0}})}));
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
  LayeredVolume volume = TwoLabels(), one = volume, none = volume;
  volume.volume = one.volume = none.volume = Shared(MakeBlobs(kGeometry, ScalarType::kUint8, 5));
  one.layers.labels = Shared(MakeVolume(kGeometry, ScalarType::kUint8, [&](const Index3& v) {
    const VoxelBlock& both = volume.layers.labels->block;
    return both.samples<std::uint8_t>()[both.Offset(v)] == 1 ? 1 : 0;
  }));
  none.layers = {};
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    SetupOptions options = Unlit();
    options.transfer = Ramp(0.3);
    options.transfer.isosurfaces = {{90, {1, 1, 1}, 0.5}};
    const LocalImage hidden =
        Rendered(volume, LayeredSetup(volume, options, {.labels = Look(mode, {{kRed, 0.5F}, {kGreen, 0, false}}, 0.7)}));
    const LocalImage expected = Rendered(one, LayeredSetup(one, options, {.labels = Look(mode, {{kRed, 0.5F}, {kGreen}}, 0.7)}));
    EXPECT_FALSE(ColorsOf(hidden).empty());
    EXPECT_EQ(hidden.rgba, expected.rgba);
    const LocalImage all = Rendered(volume, LayeredSetup(volume, options, {.labels = Look(mode, {{kRed, 1, false}, {kGreen, 1, false}})}));
    EXPECT_LE(LargestDifference(all, Rendered(none, LayeredSetup(none, options, {}))), 1e-6F);
  }
}

// A surface needs no transfer function, and hides the material in its place.
TEST(Labels, SurfacesStandWhateverTheTransferFunctionSays) {
  const LayeredVolume volume = TwoLabels();
  SetupOptions clear = Unlit(), blue = Unlit();
  clear.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{0, 0}}};
  blue.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{60, 0, 0.5, 1}, {61, 1, 0.5, 0}}};
  const LayerLooks looks = {.labels = Look(LabelMode::kSurface, {{kRed}, {kGreen}})};
  const LocalImage alone = Rendered(volume, LayeredSetup(volume, clear, looks));
  EXPECT_FALSE(ColorsOf(alone).empty());
  for (const Rgb& color : ColorsOf(Rendered(volume, LayeredSetup(volume, blue, looks)))) EXPECT_LT(color.b, 1e-4F);
}

// The opacity of a label is a factor of the material's, for a voxel length of it.
TEST(Labels, OpacityThinsTheMaterial) {
  LayeredVolume volume{.volume = Shared(MakeBlock(kGeometry))};
  volume.layers.labels = Shared(MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3&) { return 1; }));
  for (const std::string rate : {"1", "2", "0.7"}) {
    SetupOptions options = Unlit();
    options.transfer = Uniform(0.2, {1, 1, 1});
    FrameSetup thin = LayeredSetup(volume, options, {.labels = Look(LabelMode::kTint, {{kRed, 0.25F}}, 0)});
    options.transfer = Uniform(0.05, {1, 1, 1});
    FrameSetup expected = LayeredSetup(volume, options, {});
    for (FrameSetup* setup : {&thin, &expected}) SetParameters(ParseParameters(*RayCasting(), {{"sampling-rate", rate}}).value(), *setup);
    EXPECT_LT(LargestDifference(Rendered(volume, thin), Rendered(volume, expected)), 1e-4F);
  }
}

TEST(Labels, TintMixesColours) {
  LayeredVolume volume{.volume = Shared(MakeBlock(kGeometry))};
  volume.layers.labels = Shared(MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3&) { return 1; }));
  SetupOptions options = Unlit();
  options.transfer = Uniform(0.3, {0, 0, 1});
  const LocalImage image = Rendered(volume, LayeredSetup(volume, options, {.labels = Look(LabelMode::kTint, {{kRed}}, 0.25)}));
  ASSERT_FALSE(ColorsOf(image).empty());
  for (const Rgb& color : ColorsOf(image)) EXPECT_TRUE(IsNear(color, {0.25F, 0, 0.75F}));
}

// The surface of a padded box of a label at right angles to the view is lit as one: its normal looks at the viewer everywhere.
TEST(Labels, NormalsOfAPlaneAreThoseOfThePlane) {
  LayeredVolume volume{.volume = Shared(MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3&) { return 0; }))};
  volume.layers.labels = Shared(MakeVolume(kGeometry, ScalarType::kUint8, [](const Index3& v) { return v.y >= 8 ? 1 : 0; }));
  SetupOptions options;
  options.transfer = {.colors = {{0, {0, 0, 1}}}, .opacities = {{0, 0}}};
  options.shading.specular = 0;
  options.shading.ambient = 0.1F;
  options.shading.diffuse = 0.8F;
  const LocalImage image = Rendered(volume, LayeredSetup(volume, options, {.labels = Look(LabelMode::kSurface, {{{1, 1, 1}}})}));
  for (int y = 28; y < 36; ++y) {
    for (int x = 28; x < 36; ++x) {
      EXPECT_NEAR(PixelOf(image, x, y)[0], 0.9, 1e-3);
      EXPECT_NEAR(PixelOf(image, x, y)[3], 1, 1e-3);
    }
  }
}

// ---- any boxes, any instruction set

struct Case {
  LayeredVolume volume;
  FrameSetup setup;
};

Case RandomCase(unsigned seed, int i) {
  std::mt19937 random(seed + unsigned(i));
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const VolumeGeometry geometry = {{23, 19, 27}, {1, 0.7, 1.4}, {}};
  Case result;
  result.volume.volume = Shared(MakeBlobs(geometry, ScalarType(1 + i % 3), unsigned(i)));
  const Volume shapes = MakeBlobs(geometry, ScalarType::kUint8, unsigned(i) + 100);
  LayerLooks looks;
  const auto label = [&](const Index3& v) { return std::min(shapes.block.samples<std::uint8_t>()[shapes.block.Offset(v)] / 40, 4); };
  result.volume.layers.labels = Shared(MakeVolume(geometry, i % 2 == 0 ? ScalarType::kUint8 : ScalarType::kUint16, label));
  looks.labels = Look(i % 4 < 2 ? LabelMode::kTint : LabelMode::kSurface,
                      {{kRed, 0.5F}, {kGreen, 1, i % 5 != 0}, {{0, 0, 1}, 0}, {{1, 1, 0}, float(uniform(0, 1))}}, uniform(0, 1));
  SetupOptions options;
  options.view = RandomView(i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective, random);
  options.transfer = Ramp(uniform(0.05, 0.9));
  if (i % 5 == 2) options.transfer.isosurfaces = {{60, {1, 1, 1}, 0.5}, {120, {0, 1, 1}, 0.8}};
  if (i % 5 == 4) options.transfer.gradient_opacities = {{0, 0.2}, {30, 1}};
  if (i % 4 == 1) options.clipping = RandomClipping(geometry, random);
  if (i % 7 == 3) options.shading.model = ShadingModel::kNone;
  options.size = {45, 38};
  result.setup = LayeredSetup(result.volume, options, std::move(looks));
  return result;
}

TEST(Layers, DoNotDependOnBoxes) {
  constexpr unsigned kSeed = 310;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 12; ++i) {
    const Case c = RandomCase(kSeed, i);
    const LocalImage whole = Rendered(c.volume, c.setup);
    const Partition partition = CutAtRandom(c.volume.volume->description.geometry.bounds(), 2 + i % 5, random);
    const LocalImage frame = CombinedBoxes(c.setup, partition, [&](const Box& box) { return Rendered(c.volume, c.setup, box); });
    EXPECT_LE(LargestDifference(frame, whole), 2e-6F) << "case " << i << ", seed " << kSeed;
  }
}

TEST(Layers, AgreeWithTheReference) {
  constexpr unsigned kSeed = 47;
  for (int i = 0; i < 12; ++i) {
    const Case c = RandomCase(kSeed, i);
    const double rate = i % 4 == 1 ? 2.5 : 1;
    const Volume& volume = *c.volume.volume;
    const ViewRays rays = MakeViewRays(c.setup.camera, volume.description.geometry, rate, c.setup.clip);
    const auto data = CutLayered(c.volume, volume.block.box);
    RayVolume ray_volume;
    LayerVolume layer_volume;
    const auto& pieces = ray_volume.PiecesOf(*data);
    const auto& layer_pieces = layer_volume.PiecesOf(*data, pieces, c.setup.looks);
    const RayLook look =
        MakeRayLook(data->Classification(c.setup), c.setup.transfer, c.setup.description, c.setup.camera, c.setup.shading, rate);
    RayLayers layers;
    std::optional<LabelTables> tables;
    if (c.setup.looks.labels) {
      layers.labels = &tables.emplace(MakeLabelTables(*c.setup.looks.labels, rate, c.setup.transfer.opacity_distance));
      layers.label_type = layer_pieces[0].labels.type;
      layers.label_samples = layer_pieces[0].labels.samples.get();
    }
    // Nothing is leapt over.
    EmptyDistances everywhere(pieces[0].cells.counts, std::vector<std::uint8_t>(pieces[0].cells.ranges.size(), 0));
    everywhere.Find((1U << kOctants) - 1);
    const std::vector<std::int32_t> surface_cells(2 * pieces[0].cells.ranges.size(), -1);
    const RayBox box =
        MakeRayBox(pieces[0].voxels, pieces[0].cells.counts, WholeBox(volume.block.box), WholeBox(volume.block.box), rays, c.setup.camera);
    const MarchWork work = {.rays = &rays,
                            .box = &box,
                            .look = &look,
                            .to_samples = &everywhere,
                            .to_surfaces = look.isovalues.empty() ? nullptr : &everywhere,
                            .surface_cells = surface_cells.data(),
                            .layers = &layers};
    const PixelBounds all = {0, 0, c.setup.camera.width, c.setup.camera.height};
    const auto marched = [&](auto&& marcher) {
      LocalImage image = MakeLocalImage(PixelFormat::kRgba, all);
      marcher(work, all, image.rgba.data(), 4 * std::size_t(all.width()));
      return image;
    };
    const LocalImage expected = marched(MarchTileReference);
    GradientBricks bricks;
    const auto march = [&](const MarchWork& of, const PixelBounds& tile, float* rgba, std::size_t floats_a_row) {
      return MarchTile(of, tile, {&bricks, 1}, rgba, floats_a_row);
    };
    ForEachTarget([&] { EXPECT_LE(LargestDifference(marched(march), expected), 2e-5F) << "case " << i << ", seed " << kSeed; });
    FrameSetup with_leaps = c.setup;
    SetParameters(ParseParameters(*RayCasting(), {{"sampling-rate", rate == 1 ? "1" : "2.5"}}).value(), with_leaps);
    EXPECT_LE(LargestDifference(Rendered(c.volume, with_leaps), expected), 2e-5F) << "leaps change case " << i;
  }
}

}  // namespace
}  // namespace slabstream
