// Labels in the Z-buffer: which voxels are drawn, in which colours, and independence of boxes.
#include <gtest/gtest.h>

#include <cmath>

#include "common/decomposition/decomposition.h"
#include "common/kernels/combine.h"
#include "tests/support/same_image.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

const Rgb kRed = {1, 0, 0}, kGreen = {0, 1, 0}, kBlue = {0, 0, 1};
const VolumeGeometry kGrid = {{24, 20, 22}, {1, 1, 1}, {}};

struct Labelled {
  Volume volume, labels;
};

// No look: labels are not shown.
Scene SceneOf(const Labelled& data, SetupOptions options, std::optional<LabelLook> look) {
  options.renderer = ZBuffer();
  Scene scene = {data.volume, {}, MakeSetup(data.volume, options)};
  if (look) scene.Show(data.labels, *std::move(look));
  return scene;
}
LocalImage RenderedWith(const Labelled& data, const SetupOptions& options, std::optional<LabelLook> look) {
  return Rendered(SceneOf(data, options, std::move(look)));
}

LabelLook Look(LabelMode mode, std::vector<LabelLook::Entry> entries, double tint = 1, std::vector<LabelLook::Span> shown = {}) {
  return {.mode = mode, .tint = tint, .entries = std::move(entries), .shown = std::move(shown)};
}

SetupOptions Unlit(TransferFunction transfer = Uniform(1, kBlue)) {
  SetupOptions options;
  options.shading.model = ShadingModel::kNone;
  options.view.azimuth_degrees = 20;
  options.view.elevation_degrees = 25;
  options.transfer = std::move(transfer);
  return options;
}
const TransferFunction kClear = {.colors = {{0, {0, 0, 1}}}, .opacities = {{0, 0}}};

bool InBlock(const Index3& v) { return v.x >= 4 && v.x < 20 && v.y >= 4 && v.y < 16 && v.z >= 4 && v.z < 18; }
// A block in a clear surrounding: label 1 in front, label 2 in the middle, none behind.
int LabelAt(const Index3& v) { return !InBlock(v) ? 0 : v.y < 8 ? 1 : v.y < 12 ? 2 : 0; }
Labelled Block(ScalarType type = ScalarType::kUint8) {
  return {MakeVolume(kGrid, ScalarType::kUint8, [](const Index3& v) { return InBlock(v) ? 100 : 0; }), MakeVolume(kGrid, type, LabelAt)};
}
// The block, and nothing but its voxels for which `keep` is true.
template <class Keep>
Labelled BlockWhere(Keep&& keep) {
  Labelled data = Block();
  data.volume = MakeVolume(kGrid, ScalarType::kUint8, [&](const Index3& v) { return InBlock(v) && keep(v) ? 100 : 0; });
  return data;
}

// Calls check(colour) for all pixels that are not clear; returns how many there are.
template <class Check>
int ForEachColor(const LocalImage& image, Check&& check) {
  int seen = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    if (image.rgba[i + 3] == 0) continue;
    check(Rgb{image.rgba[i], image.rgba[i + 1], image.rgba[i + 2]});
    ++seen;
  }
  return seen;
}
int CountColor(const LocalImage& image, const Rgb& color) {
  int count = 0;
  ForEachColor(image, [&](const Rgb& c) { count += c == color ? 1 : 0; });
  return count;
}

TEST(ZBufferLabels, TintMixesColours) {
  const Labelled data = {MakeBlock(kGrid), MakeVolume(kGrid, ScalarType::kUint8, [](const Index3& v) { return v.z < 11 ? 1 : 0; })};
  const LocalImage image = RenderedWith(data, Unlit(), Look(LabelMode::kTint, {{1, kRed}}, 0.25));
  EXPECT_GT(CountColor(image, {0.25F, 0, 0.75F}), 100);
  EXPECT_GT(CountColor(image, kBlue), 100);
  EXPECT_EQ(CountColor(image, {0.25F, 0, 0.75F}) + CountColor(image, kBlue), ForEachColor(image, [](const Rgb&) {}));
}

// Tinted or not, the same voxels are seen with the same light.
TEST(ZBufferLabels, WithoutTintChangeNothing) {
  const Labelled data = {MakeBlobs(kGrid, ScalarType::kUint16, 3),
                         MakeVolume(kGrid, ScalarType::kUint16, [](const Index3& v) { return v.x % 3; })};
  SetupOptions options;
  options.transfer = Ramp(1);
  ExpectSameBits(RenderedWith(data, options, Look(LabelMode::kTint, {{1, kRed}, {2, kGreen}}, 0)),
                 RenderedWith(data, options, std::nullopt));
}

TEST(ZBufferLabels, OneThatIsNotShownLeavesTheVolumeAsItIs) {
  const Labelled data = {MakeBlobs(kGrid, ScalarType::kUint16, 3),
                         MakeVolume(kGrid, ScalarType::kUint16, [](const Index3& v) { return v.x % 3; })};
  Labelled one = data;  // as if label 2 were not in the file
  one.labels = MakeVolume(kGrid, ScalarType::kUint16, [](const Index3& v) { return v.x % 3 == 1 ? 1 : 0; });
  SetupOptions options;
  options.transfer = Ramp(1);
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    ExpectSameBits(RenderedWith(data, options, Look(mode, {{1, kRed}, {2, kGreen, 0}}, 1, {{3, 9}})),
                   RenderedWith(data, options, std::nullopt));
    const LocalImage image = RenderedWith(data, options, Look(mode, {{1, kRed}, {2, kGreen}}, 1, {{1, 1}}));
    EXPECT_EQ(image.depth, RenderedWith(one, options, Look(mode, {{1, kRed}, {2, kGreen}})).depth);
    EXPECT_EQ(image.rgba, RenderedWith(one, options, Look(mode, {{1, kRed}, {2, kGreen}})).rgba);
  }
}

// As if the label's voxels were empty: those behind appear. So it is if less than half of them is left.
TEST(ZBufferLabels, TintTakesAwayWhatIsClear) {
  const Labelled data = Block(), rest = BlockWhere([](const Index3&v) { return v.y >= 8; });
  for (const LabelLook::Entry& gone : {LabelLook::Entry{1, kRed, 0}, LabelLook::Entry{1, kRed, 0.25F}}) {
    const LocalImage image = RenderedWith(data, Unlit(), Look(LabelMode::kTint, {gone, {2, kGreen}}));
    EXPECT_GT(CountColor(image, kGreen), 100);
    EXPECT_EQ(CountColor(image, kRed), 0);
    ExpectSameBits(image, RenderedWith(rest, Unlit(), Look(LabelMode::kTint, {{1, kRed}, {2, kGreen}})));
  }
  const LabelLook half = Look(LabelMode::kTint, {{1, kRed, 0.5F}, {2, kGreen}});
  EXPECT_GT(CountColor(RenderedWith(data, Unlit(), half), kRed), 100);
}

TEST(ZBufferLabels, SurfacesStandWhateverTheTransferFunctionSays) {
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kUint32, ScalarType::kUint64}) {
    const Labelled data = Block(type), shapes = BlockWhere([](const Index3&v) { return LabelAt(v) != 0; });
    const LabelLook look = Look(LabelMode::kSurface, {{1, kRed}, {2, kGreen}});
    const LocalImage alone = RenderedWith(data, Unlit(kClear), look);
    const LocalImage expected = RenderedWith(shapes, Unlit(), std::nullopt);
    EXPECT_EQ(alone.depth, expected.depth);
    EXPECT_GT(CountColor(alone, kRed), 100);
    EXPECT_GT(CountColor(alone, kGreen), 20);
    // Together with the volume, labels hide it in their place, and it stands where they are not.
    const LocalImage both = RenderedWith(data, Unlit(), look);
    EXPECT_EQ(CountColor(both, kRed), CountColor(alone, kRed));
    EXPECT_GT(CountColor(both, kBlue), 20);
    EXPECT_EQ(both.depth, RenderedWith(data, Unlit(), std::nullopt).depth);
    // One that is hardly opaque is clear, and so is its place.
    const LocalImage thin = RenderedWith(data, Unlit(), Look(LabelMode::kSurface, {{1, kRed, 0.25F}, {2, kGreen}}));
    EXPECT_EQ(CountColor(thin, kRed), 0);
    EXPECT_GT(CountColor(thin, kGreen), 100);
  }
}

TEST(ZBufferLabels, CutsHaveTheirColours) {
  const Labelled data = Block();
  SetupOptions options = Unlit();
  options.view.azimuth_degrees = 0;
  options.view.elevation_degrees = 0;
  options.clipping.planes = {{{0, 1, 0}, -6}};  // keeps y >= 6, behind the cut
  for (const auto& [look, expected] : {std::pair{Look(LabelMode::kTint, {{1, kRed}, {2, kGreen}}, 0.5), Rgb{0.5F, 0, 0.5F}},
                                       std::pair{Look(LabelMode::kSurface, {{1, kRed}, {2, kGreen}}), kRed},
                                       std::pair{Look(LabelMode::kTint, {{1, kRed, 0}, {2, kGreen}}), kGreen},
                                       std::pair{Look(LabelMode::kTint, {{1, kRed}, {2, kGreen}}, 1, {{2, 2}}), kBlue}}) {
    const LocalImage image = RenderedWith(data, options, look);
    EXPECT_EQ(PixelOf(image, 32, 32), (std::array<float, 4>{expected.r, expected.g, expected.b, 1}));
  }
}

// Of the border of what is opaque: at right angles to the view it is lit as a plane.
TEST(ZBufferLabels, SurfacesHaveTheNormalsOfTheirBorder) {
  const Labelled data = {MakeVolume(kGrid, ScalarType::kUint8, [](const Index3&) { return 0; }),
                         MakeVolume(kGrid, ScalarType::kUint8, [](const Index3& v) { return v.y >= 8 ? 1 + v.x % 2 : 0; })};
  SetupOptions options;
  options.transfer = kClear;
  options.shading.specular = 0;
  options.shading.ambient = 0.1F;
  options.shading.diffuse = 0.8F;
  const LabelLook look = Look(LabelMode::kSurface, {{1, {1, 1, 1}}, {2, {1, 1, 1}}});
  const LocalImage image = RenderedWith(data, options, look);
  for (int y = 28; y < 36; ++y) {
    for (int x = 28; x < 36; ++x) EXPECT_NEAR(PixelOf(image, x, y)[0], 0.9, 1e-3);
  }
}

TEST(ZBufferLabels, ABoxFollowsTheLook) {
  const Labelled data = Block(ScalarType::kUint64);
  const SceneBoxes boxes(SceneOf(data, Unlit(), LabelLook()), kGrid.bounds());
  const auto renderer = MakeRenderer(*ZBuffer());
  for (const auto& look : std::vector<std::optional<LabelLook>>{
           Look(LabelMode::kTint, {{1, kRed}, {2, kGreen}}), Look(LabelMode::kTint, {{1, kRed}, {2, kGreen}}, 1, {{2, 2}}), std::nullopt,
           Look(LabelMode::kSurface, {{1, kRed}, {2, kGreen}}), Look(LabelMode::kTint, {{1, kGreen}, {2, kRed}}, 0.5)}) {
    const Scene scene = SceneOf(data, Unlit(), look);
    boxes.volume->SetFields(look ? std::vector{boxes.fields[0].get()} : std::vector<BoxData*>());
    RankReport report;
    ExpectSameBits(renderer->Render(*boxes.volume, kGrid.bounds(), scene.setup, {}, RenderControl(), report).value(), Rendered(scene));
  }
}

// A voxel of the volume has the label of the nearest voxel of theirs, of any size; beyond their grid it has none.
TEST(ZBufferLabels, OfAnyGridAreThoseOfTheNearestVoxels) {
  constexpr unsigned kSeed = 5;
  std::mt19937 random(kSeed);
  int changed = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    VolumeGeometry grid = RandomGridIn(kGrid, random);
    if (i == 0) grid = {{10, 9, 10}, {2, 2, 2}, {}};
    const auto label = [](const Index3& v) { return std::uint64_t((v.x / 3 + v.y / 4 + v.z / 2) % 3) << 40; };
    const Volume blobs = MakeBlobs(kGrid, ScalarType::kUint8, 3), labels = MakeVolume(grid, ScalarType::kUint64, label);
    const Volume nearest = MakeVolume(kGrid, ScalarType::kUint64, [&](const Index3& v) {
      const Vec3 p = AffineMapBetween(kGrid, grid).To(ToVec3(v));
      const auto of = [](double position) { return std::int32_t(std::floor(position + 0.5)); };
      const Index3 voxel = {of(p.x), of(p.y), of(p.z)};
      return grid.bounds().Contains(voxel) ? label(voxel) : 0;
    });
    SetupOptions options;
    options.transfer = Ramp(1);
    options.view = RandomView(Projection::kPerspective, random);
    const LabelLook look = Look(i % 2 == 0 ? LabelMode::kSurface : LabelMode::kTint,
                                {{std::uint64_t{1} << 40, kRed}, {std::uint64_t{2} << 40, kGreen, 0.1F}}, 0.6);
    const LocalImage image = RenderedWith({blobs, labels}, options, look);
    ExpectSameBits(image, RenderedWith({blobs, nearest}, options, look));
    changed += image.rgba != RenderedWith({blobs, labels}, options, std::nullopt).rgba ? 1 : 0;
  }
  EXPECT_GE(changed, 10);
}

TEST(ZBufferLabels, DoNotDependOnBoxes) {
  constexpr unsigned kSeed = 77;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const VolumeGeometry geometry = {{43, 29, 37}, {1, 0.7, 1.4}, {}};
    VolumeGeometry grid = geometry;
    if (i % 4 == 3) grid = RandomGridIn(geometry, random);
    if (i % 8 == 2) grid = {{43, 29, 370}, {1, 0.7, 0.14}, {}};  // thin slices of labels on thick ones
    const Volume shapes = MakeBlobs(grid, ScalarType::kUint8, unsigned(i) + 100);
    const auto label = [&](const Index3& v) { return std::min(shapes.block.samples<std::uint8_t>()[shapes.block.Offset(v)] / 40, 4); };
    const Labelled data = {MakeBlobs(geometry, ScalarType(1 + i % 3), unsigned(i)),
                           MakeVolume(grid, i % 2 == 0 ? ScalarType::kUint8 : ScalarType::kUint64, label)};
    SetupOptions options;
    options.view = RandomView(kProjections[random() % 2], random);
    const LabelMode mode = i % 4 < 2 || i % 8 == 2 ? LabelMode::kSurface : LabelMode::kTint;
    options.transfer = i % 5 == 4 && mode == LabelMode::kSurface ? kClear : Ramp(1);
    if (i % 3 == 1) options.clipping = RandomClipping(geometry, random);
    if (i % 6 == 4) options.clipping.mode = ClipMode::kCutAway;
    LabelLook look = Look(mode, {{1, kRed, 0.7F}, {2, kGreen}, {3, kBlue, 0.1F}, {4, {1, 1, 0}}}, 0.6);
    if (i % 3 == 0) look.shown = {{1, 1}, {3, 4}};
    const Scene scene = SceneOf(data, options, look);
    const LocalImage whole = Rendered(scene);
    const Partition partition = CutAtRandom(geometry.bounds(), 2 + i % 5, random);
    const LocalImage frame = CombinedBoxes(scene.setup, partition, [&](const Box& box) { return Rendered(scene, box); });
    int seen = 0;
    for (int y = 0; y < scene.setup.camera.height; ++y) {
      for (int x = 0; x < scene.setup.camera.width; ++x) {
        ASSERT_EQ(PixelOf(frame, x, y), PixelOf(whole, x, y)) << x << " " << y;
        seen += PixelOf(whole, x, y)[3] > 0 ? 1 : 0;
      }
    }
    EXPECT_GT(seen, 100);
  }
}

}  // namespace
}  // namespace slabstream
