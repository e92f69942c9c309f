// Colour bars and legends: where they stand, what colours they have, and that pictures side by side have annotations of their own.
#include "common/classification/picture_key.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "client/pictures/annotations.h"
#include "client/pictures/picture_labels.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::ElementsAre;

constexpr ImageSize kKeySize = {300, 200};

struct KeyDrawing {
  ImageSize size;
  std::vector<float> rgba;  // on black
  std::array<float, 3> At(int x, int y) const {
    const float* const pixel = &rgba[4 * (std::size_t(y) * std::size_t(size.width) + std::size_t(x))];
    return {pixel[0], pixel[1], pixel[2]};
  }
  bool Changed(int x, int y) const { return At(x, y) != std::array<float, 3>{}; }
  // Whether any pixel of the columns is.
  bool AnyIn(int begin, int end) const {
    for (int y = 0; y < size.height; ++y) {
      for (int x = begin; x < end; ++x) {
        if (Changed(x, y)) return true;
      }
    }
    return false;
  }
};

KeyDrawing DrawKey(const Annotations& annotations, const PictureKey& key, const std::vector<PictureGeometry>& panes = {{}},
                   ImageSize size = kKeySize) {
  const Result<AnnotationLayers> layers = AnnotationLayers::Draw(MarksOf({.annotations = annotations}, size, panes, key).value());
  EXPECT_TRUE(layers.ok()) << layers.status().message();
  KeyDrawing drawing{size, {}};
  const std::array<float, 4> black = {0, 0, 0, 1};
  for (int i = 0; i < size.width * size.height; ++i) drawing.rgba.insert(drawing.rgba.end(), black.begin(), black.end());
  const std::size_t row = 4 * std::size_t(size.width);
  for (int y = 0; y < size.height; ++y) layers->PutOver(y, std::span(drawing.rgba).subspan(std::size_t(y) * row, row));
  return drawing;
}

PictureKey::Bar RedToBlue() { return {.name = "volume", .colors = {{-100, {1, 0, 0}}, {300, {0, 0, 1}}}}; }

// A channel: from black to its colour.
PictureKey::Bar Ramp(const std::string& name, const Rgb& color) { return {.name = name, .colors = {{0, {0, 0, 0}}, {100, color}}}; }

// At least 3, and as many as are allowed: half the step, or two fifths of it, makes more.
TEST(TicksOf, AreAsManyAsAreAllowed) {
  Random random(21);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 3000; ++i) {
    const double low = random.Real(-1000, 1000), high = low + std::exp(random.Real(-5, 8));
    const int most = random.Integer(3, 8);
    const std::vector<double> ticks = TicksOf(low, high, most);
    const auto count = [&](double step) { return int(std::floor(high / step + 1e-9) - std::ceil(low / step - 1e-9)) + 1; };
    ASSERT_GE(ticks.size(), 3U) << low << " to " << high;
    const double step = ticks[1] - ticks[0], digit = step / std::pow(10, std::floor(std::log10(step) + 1e-6));
    EXPECT_TRUE(std::abs(digit - 1) < 1e-6 || std::abs(digit - 2) < 1e-6 || std::abs(digit - 5) < 1e-6) << step;
    EXPECT_EQ(int(ticks.size()), count(step)) << "all in the range";
    const bool is_five = std::abs(digit - 5) < 1e-6, is_two = std::abs(digit - 2) < 1e-6;
    EXPECT_TRUE(int(ticks.size()) <= most || (ticks.size() <= 8 && count(step * (is_two ? 2.5 : 2)) < 3)) << ticks.size() << " of " << most;
    EXPECT_GT(count(step / (is_five ? 2.5 : 2)), std::min(most, int(ticks.size()))) << "a finer step";
  }
}

TEST(TicksOf, AreRoundNumbersInTheRange) {
  EXPECT_THAT(TicksOf(0, 1), ElementsAre(0, 0.2, 0.4, 0.6, 0.8, 1));
  EXPECT_THAT(TicksOf(-100, 300), ElementsAre(-100, 0, 100, 200, 300));
  EXPECT_THAT(TicksOf(3, 217), ElementsAre(50, 100, 150, 200));
  EXPECT_THAT(TicksOf(0, 0.0007), ElementsAre(0, 0.0002, 0.0004, 0.0006));
  for (const auto& [low, high] : {std::pair(-1e30, 1e30), std::pair(1e-30, 3e-30), std::pair(1e6, 1e6 + 1)}) {
    const std::vector<double> ticks = TicksOf(low, high);
    EXPECT_GE(ticks.size(), 2U) << low;
    EXPECT_LE(ticks.size(), 7U) << low;
    EXPECT_GE(ticks.front(), low);
    EXPECT_LE(ticks.back(), high);
  }
}

TEST(ColorBar, StandsOnTheRightWithTheGreatestValueOnTop) {
  const KeyDrawing drawing = DrawKey({.color_bar = ""}, {.bars = {RedToBlue()}, .entries = {}});
  EXPECT_FALSE(drawing.AnyIn(0, 200));
  int first = kKeySize.height, last = 0;
  const int x = kKeySize.width - 12;  // inside of the bar
  for (int y = 0; y < kKeySize.height; ++y) {
    const auto [r, g, b] = drawing.At(x, y);
    if (g != 0 || r + b < 0.9F) continue;
    first = std::min(first, y);
    last = std::max(last, y);
  }
  ASSERT_GT(last - first, 100);
  for (const double share : {0.02, 0.25, 0.5, 0.75, 0.98}) {
    const auto [r, g, b] = drawing.At(x, first + int(share * (last - first)));
    EXPECT_NEAR(r, share, 0.02);
    EXPECT_NEAR(b, 1 - share, 0.02);
  }
  EXPECT_FALSE(DrawKey({.color_bar = ""}, {}).AnyIn(0, kKeySize.width)) << "there is nothing to show";
  EXPECT_FALSE(DrawKey({}, {.bars = {RedToBlue()}, .entries = {}}).AnyIn(0, kKeySize.width)) << "nobody asked for it";
}

TEST(Legend, NamesWhatThereIsRoomFor) {
  PictureKey key;
  for (int i = 0; i < 100; ++i) key.entries.push_back({"Precentral", {0, 1, 0}});
  const KeyDrawing drawing = DrawKey({.legend = true}, key);
  int green = 0;
  for (int y = 0; y < kKeySize.height; ++y) green += drawing.At(8, y) == std::array<float, 3>{0, 1, 0} ? 1 : 0;
  EXPECT_GT(green, 20);
  EXPECT_LT(green, 120);
  EXPECT_FALSE(drawing.AnyIn(kKeySize.width / 2, kKeySize.width));
}

const std::array<Rgb, 4> kKeyColors = {{{1, 0, 1}, {0, 1, 0}, {0, 1, 1}, {1, 1, 0}}};

PictureKey KeyOfChannels(int count, const std::string& name = "Actin") {
  PictureKey key;
  for (int i = 0; i < count; ++i) key.bars.push_back(Ramp(name, kKeyColors[std::size_t(i) % kKeyColors.size()]));
  return key;
}

// Which channels' colours a column of pixels shows, nearly as bright as they are, from top to bottom; each once where it is many pixels.
std::vector<int> ChannelsIn(const KeyDrawing& drawing, int x) {
  std::vector<int> found;
  for (int y = 0; y < drawing.size.height; ++y) {
    const auto [r, g, b] = drawing.At(x, y);
    for (int i = 0; i < 4; ++i) {
      const Rgb& color = kKeyColors[std::size_t(i)];
      const bool same = std::abs(r - color.r) + std::abs(g - color.g) + std::abs(b - color.b) < 0.25F;
      if (same && (found.empty() || found.back() != i)) found.push_back(i);
    }
  }
  return found;
}

TEST(ColorBars, OfSeveralFieldsStandOneBelowTheOtherInTheirOrder) {
  const ImageSize size = {300, 400};
  const auto bars = [&](int count) {
    return ChannelsIn(DrawKey({.color_bar = ""}, KeyOfChannels(count), {{}}, size), size.width - 12);  // inside of the bars
  };
  EXPECT_THAT(bars(2), ElementsAre(0, 1));
  EXPECT_THAT(bars(4), ElementsAre(0, 1, 2, 3));
  const std::vector<int> many = bars(16);
  EXPECT_GE(many.size(), 4U);
  EXPECT_LT(many.size(), 16U) << "as many as can be read, and how many more there are";
}

TEST(Legend, HasARowForEachFieldIfThereAreSeveral) {
  const ImageSize size = {300, 400};
  const int right_end = 31;  // of the colours, where the greatest values are
  const auto rows = [&](const PictureKey& key) { return ChannelsIn(DrawKey({.legend = true}, key, {{}}, size), right_end); };
  EXPECT_THAT(rows(KeyOfChannels(4)), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(rows(KeyOfChannels(16)).size(), 16U);
  EXPECT_FALSE(DrawKey({.legend = true}, KeyOfChannels(1), {{}}, size).AnyIn(0, size.width)) << "there is nothing to tell apart";
  PictureKey with_label = KeyOfChannels(2);
  with_label.entries = {{"Nucleus", kKeyColors[3]}};
  EXPECT_THAT(ChannelsIn(DrawKey({.legend = true}, with_label, {{}}, size), 8), ElementsAre(3)) << "its swatch is narrower";
}

TEST(Legend, LongNamesEndBeforeTheEdgeAndBeforeColourBars) {
  const std::string name(60, 'W');
  for (const int width : {120, 200, 300, 900}) {
    const ImageSize size = {width, 300};
    const KeyDrawing legend = DrawKey({.legend = true}, KeyOfChannels(3, name), {{}}, size);
    EXPECT_FALSE(legend.AnyIn(width - 3, width)) << width;
    const KeyDrawing bars = DrawKey({.color_bar = ""}, KeyOfChannels(3, name), {{}}, size);
    EXPECT_FALSE(bars.AnyIn(0, 3) || bars.AnyIn(width - 3, width)) << width;
  }
  const ImageSize size = {300, 300};
  const KeyDrawing bars = DrawKey({.color_bar = ""}, KeyOfChannels(2, "A"), {{}}, size);
  const KeyDrawing both = DrawKey({.color_bar = "", .legend = true}, {KeyOfChannels(2, "A").bars, {{name, {1, 0, 0}}}}, {{}}, size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 265; x < size.width; ++x) ASSERT_EQ(both.At(x, y), bars.At(x, y)) << x << ", " << y;
  }
}

TEST(Panes, HaveSidesAndBarsOfTheirOwn) {
  PictureGeometry axial{.world = World::kPatient, .unit = LengthUnit::kMillimetre};
  axial.right = {-1, 0, 0};
  axial.up = {0, 1, 0};
  axial.forward = {0, 0, 1};
  const std::vector<PictureGeometry> panes(3, axial);
  const ImageSize size = {600, 200};
  const KeyDrawing drawing = DrawKey({.scale_bar = true, .orientation_marker = true, .sides_only = true}, {}, panes, size);
  for (int pane = 0; pane < 3; ++pane) {
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < 200; ++x) ASSERT_EQ(drawing.At(x, y), drawing.At(x + 200 * pane, y)) << x << ", " << y;
    }
  }
  EXPECT_TRUE(drawing.AnyIn(0, 30)) << "R";
  EXPECT_TRUE(drawing.AnyIn(170, 200)) << "L";
}

}  // namespace
}  // namespace slabstream
