// Annotations are drawn onto plain rows and looked at: where there is ink, how much, and that nothing else changes.
#include "client/pictures/annotations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <vector>

#include "client/pictures/picture_labels.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::HasSubstr;

using Color = std::array<float, 4>;
constexpr Color kBlack = {0, 0, 0, 1}, kWhite = {1, 1, 1, 1}, kClear = {0, 0, 0, 0};

struct Drawing {
  ImageSize size;
  std::vector<float> rgba;
  Color background;

  Color At(int x, int y) const {
    Color color;
    std::copy_n(&rgba[4 * (std::size_t(y) * std::size_t(size.width) + std::size_t(x))], 4, color.begin());
    return color;
  }
  bool Changed(int x, int y) const { return At(x, y) != background; }
  // Of the pixels that `wanted` takes.
  template <class Wanted>
  PixelBounds BoundsOf(Wanted wanted) const {
    PixelBounds bounds;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        if (wanted(At(x, y))) bounds = Union(bounds, {x, y, x + 1, y + 1});
      }
    }
    return bounds;
  }
  PixelBounds ChangedBounds() const {
    return BoundsOf([this](const Color& c) { return c != background; });
  }
};

Drawing DrawFormat(const PictureFormat& format, ImageSize size, const PictureGeometry& geometry, Color background) {
  const Result<AnnotationLayers> layers = AnnotationLayers::Draw(MarksOf(format, size, {&geometry, 1}).value());
  EXPECT_TRUE(layers.ok()) << layers.status().message();
  Drawing drawing{size, {}, background};
  for (std::int64_t i = 0; i < std::int64_t{size.width} * size.height; ++i)
    drawing.rgba.insert(drawing.rgba.end(), background.begin(), background.end());
  const std::size_t row = 4 * std::size_t(size.width);
  for (int y = 0; y < size.height; ++y) layers->PutOver(y, std::span(drawing.rgba).subspan(std::size_t(y) * row, row));
  return drawing;
}

// On a background of which the annotations do not know.
Drawing Draw(const Annotations& annotations, ImageSize size, const PictureGeometry& geometry = {}, Color background = kBlack) {
  return DrawFormat({.annotations = annotations}, size, geometry, background);
}

PictureGeometry OfPatient() {
  PictureGeometry geometry;
  geometry.world = World::kPatient;
  geometry.unit = LengthUnit::kMillimetre;
  geometry.right = {-1, 0, 0};  // the anterior view
  geometry.forward = {0, -1, 0};
  geometry.pixel_size = 0.37;
  return geometry;
}

const Annotations kAll{.scale_bar = true,
                       .orientation_marker = true,
                       .title =
                           "Sch\xC3\xA4"
                           "del \xCE\xB1"};

TEST(AnnotationsTest, NothingIsDrawnUnlessAskedFor) {
  const Drawing drawing = Draw({}, {64, 48}, OfPatient());
  EXPECT_TRUE(drawing.ChangedBounds().empty());
}

TEST(AnnotationsTest, EachHasItsPlaceAndChangesNothingElse) {
  for (const ImageSize size : {ImageSize{256, 256}, ImageSize{640, 400}, ImageSize{300, 900}}) {
    SCOPED_TRACE(testing::Message() << size.width << " x " << size.height);
    const int w = size.width, h = size.height, shorter = std::min(w, h);
    const PixelBounds title = Draw({.title = "A title"}, size).ChangedBounds();
    EXPECT_NEAR(0.5 * (title.x_begin + title.x_end), 0.5 * w, 0.02 * shorter + 1);
    EXPECT_GE(title.y_begin, 0);
    EXPECT_LT(title.y_end, 0.1 * shorter);

    const PixelBounds bar = Draw({.scale_bar = true}, size).ChangedBounds();
    EXPECT_GT(bar.x_begin, 0.5 * w);
    EXPECT_GT(bar.y_begin, h - 0.2 * shorter);
    EXPECT_LT(bar.x_end, w);
    EXPECT_LT(bar.y_end, h);

    const PixelBounds axes = Draw({.orientation_marker = true}, size).ChangedBounds();
    EXPECT_GE(axes.x_begin, 0);
    EXPECT_LT(axes.x_end, 0.35 * shorter);
    EXPECT_GT(axes.y_begin, h - 0.35 * shorter);
    EXPECT_LE(axes.y_end, h);
  }
}

TEST(AnnotationsTest, TheScaleBarIsAsLongAsItSays) {
  Random random(91);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    PictureGeometry geometry = OfPatient();
    geometry.pixel_size = std::exp(random.Real(-5, 5));
    const ImageSize size = {random.Integer(200, 900), random.Integer(200, 400)};
    const Drawing drawing = Draw({.scale_bar = true}, size, geometry);
    // The lowest row that is all bar; the halo does not show on black.
    double longest = 0;
    for (int y = size.height / 2; y < size.height; ++y) {
      double sum = 0;
      for (int x = 0; x < size.width; ++x) sum += double(drawing.At(x, y)[0]);
      longest = std::max(longest, sum);
    }
    EXPECT_NEAR(longest, ChooseScaleBar(geometry, size.width)->pixels, 1e-3);
  }
}

TEST(AnnotationsTest, EverythingCanBeReadOnAnyBackground) {
  for (const Color& background : {kBlack, kWhite, kClear, Color{0.5F, 0.5F, 0.5F, 1}, Color{0.3F, 0, 0, 0.3F}}) {
    for (const Annotations& annotations : {Annotations{.scale_bar = true}, Annotations{.title = "Title"}}) {
      const Drawing drawing = Draw(annotations, {400, 400}, OfPatient(), background);
      int bright = 0, outline = 0;
      for (int y = 0; y < 400; ++y) {
        for (int x = 0; x < 400; ++x) {
          const Color color = drawing.At(x, y);
          if (!drawing.Changed(x, y) || color[3] < 0.8F) continue;
          bright += color[1] > 0.8F ? 1 : 0;
          outline += color[1] < 0.25F ? 1 : 0;
        }
      }
      // On white the letters are what their outline leaves white.
      if (background != kWhite) {
        EXPECT_GT(bright, 50);
      }
      if (background != kBlack) {
        EXPECT_GT(outline, 30);
      }
    }
  }
}

// As codes of a PNG.
std::array<int, 4> CodesOf(const Color& color) {
  std::array<int, 4> codes{};
  std::ranges::transform(color, codes.begin(), [](float channel) { return int(std::lround(255 * channel)); });
  return codes;
}

// Black or white, and nothing that is farther from the letters' colour than the background: no outline.
TEST(AnnotationsTest, LettersStandAloneOnAnOpaqueBackground) {
  for (const Color& background : {kBlack, kWhite, Color{0.5F, 0.5F, 0.5F, 1}, Color{0.1F, 0.1F, 0.4F, 1}, Color{1, 0.9F, 0.2F, 1}}) {
    const auto [r, g, b, a] = background;
    const Drawing drawing =
        DrawFormat({.background = {r, g, b, a}, .annotations = {.scale_bar = true, .title = "Title"}}, {400, 400}, OfPatient(), background);
    const bool white = background == kBlack || b == 0.4F;
    int full = 0;
    for (int y = 0; y < 400; ++y) {
      for (int x = 0; x < 400; ++x) {
        const std::array<int, 4> here = CodesOf(drawing.At(x, y)), ground = CodesOf(background);
        for (std::size_t c = 0; c < 4; ++c) ASSERT_TRUE(white ? here[c] >= ground[c] : here[c] <= ground[c] || c == 3) << x << " " << y;
        full += here == (white ? std::array{255, 255, 255, 255} : std::array{0, 0, 0, 255}) ? 1 : 0;
      }
    }
    EXPECT_GT(full, 200);
  }
}

// Where the picture lies behind them, letters have an outline of the background's colour.
TEST(AnnotationsTest, LettersCanBeReadBeforeThePicture) {
  const Color picture = {0.1F, 0.1F, 0.1F, 1};
  const Drawing drawing = DrawFormat({.background = {1, 1, 1, 1}, .annotations = {.title = "Title"}}, {400, 400}, OfPatient(), picture);
  int black = 0, bright = 0;
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 400; ++x) {
      black += drawing.At(x, y)[0] == 0 ? 1 : 0;
      bright += drawing.At(x, y)[0] > 0.8F ? 1 : 0;
    }
  }
  EXPECT_GT(black, 50);
  EXPECT_GT(bright, 30);
}

TEST(AnnotationsTest, TheFontsSizeIsInPoints) {
  const auto height = [](double points, std::optional<int> dots_per_inch, int side) {
    const PictureFormat format{.annotations = {.title = "H", .font_size = points}, .dots_per_inch = dots_per_inch};
    return DrawFormat(format, {side, side}, {}, kBlack).ChangedBounds().height();  // of a capital letter and its halo, which is black
  };
  EXPECT_NEAR(height(20, {}, 500), 0.73 * 20, 2);
  EXPECT_NEAR(height(20, 144, 500), 0.73 * 40, 2);
  EXPECT_NEAR(height(20, 144, 4000), 0.73 * 40, 2) << "whatever the picture's size is";
  EXPECT_LT(height(1000, 10000, 500), 250) << "no letter fills the picture";
  EXPECT_GT(height(1, {}, 8), 0);
}

TEST(AnnotationsTest, SizesGrowWithThePicture) {
  const auto height = [](int side) { return Draw({.title = "Mean"}, {side, side}, {}, kBlack).ChangedBounds().height(); };
  EXPECT_GE(height(256), 8);  // of a capital letter and its halo
  EXPECT_NEAR(height(4096), 8 * height(512), 0.1 * height(4096));
  const auto width = [](int side) { return Draw({.title = "Mean"}, {side, side}, {}, kBlack).ChangedBounds().width(); };
  EXPECT_NEAR(width(4096), 8 * width(512), 0.1 * width(4096));
}

TEST(AnnotationsTest, ATitleThatIsTooWideShrinks) {
  for (const int width : {64, 200, 1000}) {
    const std::string longest(kMaxTitleCharacters, 'W');
    const PixelBounds bounds = Draw({.title = longest}, {width, 300}).ChangedBounds();
    EXPECT_GE(bounds.x_begin, 0);
    EXPECT_LE(bounds.x_end, width);
    if (width == 1000) {
      EXPECT_GT(bounds.width(), 800);
      EXPECT_LT(bounds.x_end, width - 2);
    }
  }
}

// The pattern of a letter: its pixels' brightness, without empty rows and columns.
std::vector<float> Pattern(const Drawing& drawing, const PixelBounds& within) {
  PixelBounds ink;
  for (int y = within.y_begin; y < within.y_end; ++y) {
    for (int x = within.x_begin; x < within.x_end; ++x) {
      if (drawing.At(x, y)[0] > 0) ink = Union(ink, {x, y, x + 1, y + 1});
    }
  }
  std::vector<float> pattern = {float(ink.width())};
  for (int y = ink.y_begin; y < ink.y_end; ++y) {
    for (int x = ink.x_begin; x < ink.x_end; ++x) pattern.push_back(drawing.At(x, y)[0]);
  }
  return pattern;
}

TEST(AnnotationsTest, TheEdgesNameAPatientsSides) {
  constexpr int kSide = 400;
  const Drawing drawing = Draw({.orientation_marker = true}, {kSide, kSide}, OfPatient());
  const auto letter = [&](const char* text) { return Pattern(Draw({.title = text}, {kSide, kSide}), {0, 0, kSide, kSide / 4}); };
  EXPECT_EQ(Pattern(drawing, {0, 150, 40, 250}), letter("R"));
  EXPECT_EQ(Pattern(drawing, {360, 150, kSide, 250}), letter("L"));
  EXPECT_EQ(Pattern(drawing, {150, 0, 250, 40}), letter("S"));
  EXPECT_EQ(Pattern(drawing, {150, 360, 250, kSide}), letter("I"));
  EXPECT_NE(letter("R"), letter("L"));

  PictureGeometry scene = OfPatient();
  scene.world = World::kScene;
  const Drawing of_scene = Draw({.orientation_marker = true}, {kSide, kSide}, scene);
  EXPECT_LT(of_scene.ChangedBounds().x_end, 140) << "the axes alone";

  // Below a title.
  const Drawing titled = Draw({.orientation_marker = true, .title = "Title"}, {kSide, kSide}, OfPatient());
  const PixelBounds title = Draw({.title = "Title"}, {kSide, kSide}).ChangedBounds();
  EXPECT_EQ(Pattern(titled, {150, title.y_end, 250, 80}), letter("S"));
}

// The mean position of the ink of one colour, from where the arrows begin, which is the same for each view.
TEST(AnnotationsTest, ArrowsPointWhereTheAxesDo) {
  constexpr int kSide = 512;
  const auto is_red = [](const Color& c) { return c[0] > 0.5F && c[0] > 1.5F * c[2]; };
  const auto is_blue = [](const Color& c) { return c[2] > 0.5F && c[2] > 1.5F * c[0]; };
  PictureGeometry front;
  front.world = World::kScene;
  const Drawing drawing = Draw({.orientation_marker = true}, {kSide, kSide}, front);
  const PixelBounds red = drawing.BoundsOf(is_red), blue = drawing.BoundsOf(is_blue);
  EXPECT_GT(red.width(), 30) << "x to the right";
  EXPECT_LT(red.height(), 30);
  EXPECT_GT(blue.height(), 30) << "z upwards";
  EXPECT_LT(blue.width(), 30);
  EXPECT_GT(red.x_begin + red.x_end, blue.x_begin + blue.x_end);
  EXPECT_LT(blue.y_begin + blue.y_end, red.y_begin + red.y_end);

  PictureGeometry turned = front;  // by 90 degrees, clockwise
  turned.right = {0, 0, 1};
  turned.up = {-1, 0, 0};
  const Drawing after = Draw({.orientation_marker = true}, {kSide, kSide}, turned);
  const PixelBounds red_after = after.BoundsOf(is_red), blue_after = after.BoundsOf(is_blue);
  EXPECT_GT(red_after.height(), 30) << "x downwards";
  EXPECT_GT(blue_after.width(), 30) << "z to the right";
  EXPECT_GT(red_after.y_begin + red_after.y_end, blue_after.y_begin + blue_after.y_end);
  EXPECT_GT(blue_after.x_begin + blue_after.x_end, red_after.x_begin + red_after.x_end);
}

TEST(AnnotationsTest, AnySizeCanBeAnnotated) {
  Random random(92);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 60; ++i) {
    const ImageSize size = {random.Integer(1, i < 30 ? 12 : 200), random.Integer(1, i < 30 ? 12 : 200)};
    PictureGeometry geometry = OfPatient();
    geometry.projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
    for (const float value : Draw(kAll, size, geometry, kClear).rgba) ASSERT_TRUE(value >= 0 && value <= 1.0001F) << value;
  }
}

TEST(AnnotationsTest, LettersBeyondAsciiAreThemselves) {
  Font font = Font::Open().value();
  const Ink plain = font.Draw("a", 40), umlaut = font.Draw("\xC3\xA4", 40), none = font.Draw("\xF3\xB0\x80\x80", 40);
  const PixelBounds& a = plain.bounds;
  EXPECT_EQ(umlaut.bounds.y_end, a.y_end);
  EXPECT_LT(umlaut.bounds.y_begin, a.y_begin - 5) << "the dots";
  ASSERT_EQ(umlaut.bounds.width(), a.width());
  EXPECT_TRUE(std::equal(plain.coverage.rbegin(), plain.coverage.rend(), umlaut.coverage.rbegin())) << "the rest is the letter";
  for (const char* text : {"\xCE\xB1", "\xE2\x86\x92", "\xD0\x96", "\xF0\x9D\x94\xB8"}) {  // alpha, an arrow, zhe, a double-struck A
    const Ink ink = font.Draw(text, 40);
    EXPECT_FALSE(ink.bounds.empty());
    EXPECT_NE(ink.coverage, none.coverage) << text << " is drawn as the box of characters that the font lacks";
  }
  EXPECT_EQ(font.Width("ab", 40), font.Width("a", 40) + font.Width("b", 40));
  EXPECT_TRUE(font.Draw(" ", 40).bounds.empty());
}

TEST(AnnotationsTest, TitlesAreOneLineOfUtf8) {
  for (const std::string good : {"", "a",
                                 "Sch\xC3\xA4"
                                 "del",
                                 "\xE2\x86\x92 \xF0\x9F\xA7\xA0", "'\"\\$ <b>"}) {
    EXPECT_EQ(CheckTitle("--title", good), Status::Ok()) << good;
  }
  std::string many;
  for (int i = 0; i < kMaxTitleCharacters; ++i) many += "\xC3\xA4";
  EXPECT_EQ(CheckTitle("--title", many), Status::Ok());
  const std::vector<std::pair<std::string, std::string>> bad = {
      {many + "x", "--title has 121 characters, at most 120 are possible"},
      {"two\nlines", "--title has a control character at byte 3; it must be one line of text"},
      {"\x1b[31m", "control character at byte 0"},
      {std::string("a\0b", 3), "control character at byte 1"},
      {"a\x7f", "control character at byte 1"},
      {"a\xC2\x85", "control character at byte 1"},
      {"a\xFF", "--title is not UTF-8: byte 1 is 0xFF"},
      {"\xC3", "--title is not UTF-8: byte 0 is 0xC3"},
      {"\xED\xA0\x80", "not UTF-8: byte 0"},
      {"\xF5\x80\x80\x80", "not UTF-8: byte 0"},
  };
  for (const auto& [title, message] : bad) {
    const Status status = CheckTitle("--title", title);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), HasSubstr(message));
  }
}

// Sets a variable of the environment while it lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) { ::setenv(name, value.c_str(), 1); }
  ~Variable() { ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

TEST(AnnotationsTest, AFontThatIsNotThereIsNamed) {
  const TemporaryDirectory directory;
  const std::string missing = directory / "no.ttf", text = directory / "text.ttf";
  std::ofstream(text) << "this is no font";
  const PictureGeometry pane;
  EXPECT_EQ(CheckCanDraw(kAll), Status::Ok());
  {
    const Variable variable("SLABSTREAM_FONT", missing);
    EXPECT_EQ(CheckCanDraw({}), Status::Ok()) << "nobody needs it";
    EXPECT_EQ(CheckCanDraw(kAll), Status::NotFound("$SLABSTREAM_FONT names '" + missing + "', which is no file"));
    EXPECT_EQ(MarksOf({.annotations = kAll}, {64, 64}, {&pane, 1}).status().code(), StatusCode::kNotFound);
  }
  const Variable variable("SLABSTREAM_FONT", text);
  EXPECT_EQ(MarksOf({.annotations = kAll}, {64, 64}, {&pane, 1}).status(),
            Status::InvalidArgument("the font '" + text + "' cannot be read"));
}

}  // namespace
}  // namespace slabstream
