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

std::unique_ptr<BoxData> CutLabelled(const Labelled& data, const Box& box) {
  BoxLayers layers;
  layers.labels.emplace(CutBlock(data.labels.block, box));
  return std::make_unique<BoxData>(CutBlock(data.volume.block, box), std::move(layers));
}

FrameSetup LabelledSetup(const Labelled& data, SetupOptions options, std::optional<LabelLook> look) {
  options.renderer = ZBuffer();
  FrameSetup setup = MakeSetup(data.volume, options);
  setup.layers.labels = data.labels.description.type;
  setup.looks.labels = std::move(look);
  return setup;
}

LocalImage Rendered(const Labelled& data, const FrameSetup& setup, const Box& box) {
  const auto slab = CutLabelled(data, PaddedBox(box, setup));
  RankReport report;
  return MakeRenderer(*setup.renderer)->Render(*slab, box, setup, {}, RenderControl(), report).value();
}
LocalImage Rendered(const Labelled& data, const FrameSetup& setup) { return Rendered(data, setup, data.volume.block.box); }

LabelLook Look(LabelMode mode, std::vector<LabelLook::Entry> entries, double tint = 1) {
  return {.mode = mode, .tint = tint, .entries = std::move(entries)};
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
  const LocalImage image = Rendered(data, LabelledSetup(data, Unlit(), Look(LabelMode::kTint, {{kRed}}, 0.25)));
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
  ExpectSameBits(Rendered(data, LabelledSetup(data, options, Look(LabelMode::kTint, {{kRed}, {kGreen}}, 0))),
                 Rendered(data, LabelledSetup(data, options, std::nullopt)));
}

TEST(ZBufferLabels, OneThatIsNotShownLeavesTheVolumeAsItIs) {
  const Labelled data = {MakeBlobs(kGrid, ScalarType::kUint16, 3),
                         MakeVolume(kGrid, ScalarType::kUint16, [](const Index3& v) { return v.x % 3; })};
  Labelled one = data;  // as if label 2 were not in the file
  one.labels = MakeVolume(kGrid, ScalarType::kUint16, [](const Index3& v) { return v.x % 3 == 1 ? 1 : 0; });
  SetupOptions options;
  options.transfer = Ramp(1);
  for (const LabelMode mode : {LabelMode::kTint, LabelMode::kSurface}) {
    ExpectSameBits(Rendered(data, LabelledSetup(data, options, Look(mode, {{kRed, 1, false}, {kGreen, 0, false}}))),
                   Rendered(data, LabelledSetup(data, options, std::nullopt)));
    const LocalImage image = Rendered(data, LabelledSetup(data, options, Look(mode, {{kRed}, {kGreen, 1, false}})));
    EXPECT_EQ(image.depth, Rendered(one, LabelledSetup(one, options, Look(mode, {{kRed}, {kGreen}}))).depth);
    EXPECT_EQ(image.rgba, Rendered(one, LabelledSetup(one, options, Look(mode, {{kRed}, {kGreen}}))).rgba);
  }
}

// As if the label's voxels were empty: those behind appear. So it is if less than half of them is left.
TEST(ZBufferLabels, TintTakesAwayWhatIsClear) {
  const Labelled data = Block(), rest = BlockWhere([](const Index3&v) { return v.y >= 8; });
  for (const LabelLook::Entry& gone : {LabelLook::Entry{kRed, 0}, LabelLook::Entry{kRed, 0.25F}}) {
    const LocalImage image = Rendered(data, LabelledSetup(data, Unlit(), Look(LabelMode::kTint, {gone, {kGreen}})));
    EXPECT_GT(CountColor(image, kGreen), 100);
    EXPECT_EQ(CountColor(image, kRed), 0);
    ExpectSameBits(image, Rendered(rest, LabelledSetup(rest, Unlit(), Look(LabelMode::kTint, {{kRed}, {kGreen}}))));
  }
  const LabelLook half = Look(LabelMode::kTint, {{kRed, 0.5F}, {kGreen}});
  EXPECT_GT(CountColor(Rendered(data, LabelledSetup(data, Unlit(), half)), kRed), 100);
}

TEST(ZBufferLabels, SurfacesStandWhateverTheTransferFunctionSays) {
  for (const ScalarType type : {ScalarType::kUint8, ScalarType::kUint16}) {
    const Labelled data = Block(type), shapes = BlockWhere([](const Index3&v) { return LabelAt(v) != 0; });
    const LabelLook look = Look(LabelMode::kSurface, {{kRed}, {kGreen}});
    const LocalImage alone = Rendered(data, LabelledSetup(data, Unlit(kClear), look));
    const LocalImage expected = Rendered(shapes, LabelledSetup(shapes, Unlit(), std::nullopt));
    EXPECT_EQ(alone.depth, expected.depth);
    EXPECT_GT(CountColor(alone, kRed), 100);
    EXPECT_GT(CountColor(alone, kGreen), 20);
    // Together with the volume, labels hide it in their place, and it stands where they are not.
    const LocalImage both = Rendered(data, LabelledSetup(data, Unlit(), look));
    EXPECT_EQ(CountColor(both, kRed), CountColor(alone, kRed));
    EXPECT_GT(CountColor(both, kBlue), 20);
    EXPECT_EQ(both.depth, Rendered(data, LabelledSetup(data, Unlit(), std::nullopt)).depth);
    // One that is hardly opaque is clear, and so is its place.
    const LocalImage thin = Rendered(data, LabelledSetup(data, Unlit(), Look(LabelMode::kSurface, {{kRed, 0.25F}, {kGreen}})));
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
  for (const auto& [look, expected] :
       {std::pair{Look(LabelMode::kTint, {{kRed}, {kGreen}}, 0.5), Rgb{0.5F, 0, 0.5F}},
        std::pair{Look(LabelMode::kSurface, {{kRed}, {kGreen}}), kRed}, std::pair{Look(LabelMode::kTint, {{kRed, 0}, {kGreen}}), kGreen},
        std::pair{Look(LabelMode::kTint, {{kRed, 1, false}, {kGreen}}), kBlue}}) {
    const LocalImage image = Rendered(data, LabelledSetup(data, options, look));
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
  const LabelLook look = Look(LabelMode::kSurface, {{{1, 1, 1}}, {{1, 1, 1}}});
  const LocalImage image = Rendered(data, LabelledSetup(data, options, look));
  for (int y = 28; y < 36; ++y) {
    for (int x = 28; x < 36; ++x) EXPECT_NEAR(PixelOf(image, x, y)[0], 0.9, 1e-3);
  }
}

TEST(ZBufferLabels, ABoxFollowsTheLook) {
  const Labelled data = Block();
  const auto slab = CutLabelled(data, data.volume.block.box);
  const auto renderer = MakeRenderer(*ZBuffer());
  for (const auto& look : std::vector<std::optional<LabelLook>>{
           Look(LabelMode::kTint, {{kRed}, {kGreen}}), Look(LabelMode::kTint, {{kRed, 1, false}, {kGreen}}), std::nullopt,
           Look(LabelMode::kSurface, {{kRed}, {kGreen}}), Look(LabelMode::kTint, {{kGreen}, {kRed}}, 0.5)}) {
    const FrameSetup setup = LabelledSetup(data, Unlit(), look);
    RankReport report;
    ExpectSameBits(renderer->Render(*slab, data.volume.block.box, setup, {}, RenderControl(), report).value(), Rendered(data, setup));
  }
}

TEST(ZBufferLabels, DoNotDependOnBoxes) {
  constexpr unsigned kSeed = 77;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " case " << i);
    const VolumeGeometry geometry = {{43, 29, 37}, {1, 0.7, 1.4}, {}};
    const Volume shapes = MakeBlobs(geometry, ScalarType::kUint8, unsigned(i) + 100);
    const auto label = [&](const Index3& v) { return std::min(shapes.block.samples<std::uint8_t>()[shapes.block.Offset(v)] / 40, 4); };
    const Labelled data = {MakeBlobs(geometry, ScalarType(1 + i % 3), unsigned(i)),
                           MakeVolume(geometry, i % 2 == 0 ? ScalarType::kUint8 : ScalarType::kUint16, label)};
    SetupOptions options;
    options.view = RandomView(kProjections[random() % 2], random);
    options.transfer = i % 5 == 4 ? kClear : Ramp(1);
    if (i % 3 == 1) options.clipping = RandomClipping(geometry, random);
    if (i % 6 == 4) options.clipping.mode = ClipMode::kCutAway;
    const LabelLook look =
        Look(i % 4 < 2 ? LabelMode::kSurface : LabelMode::kTint, {{kRed, 0.7F}, {kGreen, 1, i % 3 != 0}, {kBlue, 0.1F}, {{1, 1, 0}}}, 0.6);
    const FrameSetup setup = LabelledSetup(data, options, look);
    const LocalImage whole = Rendered(data, setup);
    const Partition partition = CutAtRandom(geometry.bounds(), 2 + i % 5, random);
    const LocalImage frame = CombinedBoxes(setup, partition, [&](const Box& box) { return Rendered(data, setup, box); });
    int seen = 0;
    for (int y = 0; y < setup.camera.height; ++y) {
      for (int x = 0; x < setup.camera.width; ++x) {
        ASSERT_EQ(PixelOf(frame, x, y), PixelOf(whole, x, y)) << x << " " << y;
        seen += PixelOf(whole, x, y)[3] > 0 ? 1 : 0;
      }
    }
    EXPECT_GT(seen, 100);
  }
}

}  // namespace
}  // namespace slabstream
