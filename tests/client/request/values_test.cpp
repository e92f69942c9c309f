#include "client/request/values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/turntable_values.h"
#include "client/movie/time_steps.h"
#include "client/request/value_window.h"
#include "common/cli/parse.h"
#include "common/view/world_limits.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(ParseScalarRange, TakesTwoValuesThatRise) {
  EXPECT_EQ(*ParseScalarRange("--scalar-range", "-1000:2.5e3"), (ScalarRange{-1000, 2500}));
  EXPECT_EQ(*ParseScalarRange("--scalar-range", "0%:99.5%"), (ScalarRange{0, 99.5, true}));
  for (const char* text : {"", "1", ":", "1:", "2:1", "1:1", "1:2:3", "nan:1", "0:inf", "a:b", "%:%", "1%:2", "1:2%", "2%:1%", "-1%:5%",
                           "1%:101%", "1%%:5%"}) {
    EXPECT_EQ(ParseScalarRange("--scalar-range", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(ParseTimeSteps, TakesOneTimeARangeAndAStep) {
  const auto count = [](const char* text) { return ParseTimeSteps("--time", text)->count(); };
  EXPECT_EQ(count("7"), 1);
  EXPECT_EQ(count("0:9"), 10);
  EXPECT_EQ(count("0:9:2"), 5);
  EXPECT_EQ(count("0:10:2"), 6);
  EXPECT_EQ(count("3:4:9"), 1);
  for (const char* text : {"", ":", "1:", "2:1", "0:9:0", "0:9:-1", "0:9:x", "0:9:2:3", "-1:2", "1.5"}) {
    EXPECT_THAT(ParseTimeSteps("--time", text).status().message(), HasSubstr("--time")) << text;
  }
  const TimeSteps even = *ParseTimeSteps("--time", "2:6:2");
  std::vector<int> shown;
  for (int frame = 0; frame < 7; ++frame) shown.push_back(even.At(frame, 7));
  EXPECT_EQ(shown, (std::vector{2, 2, 2, 4, 4, 6, 6}));
}

TEST(ParseIsosurfaces, TakesValuesWithColorsAndOpacities) {
  const auto parse = [](const char* text) { return ParseIsosurfaces("--isovalue", text); };
  const std::vector<Isosurface> plain = *parse("120,-3.5e2");
  ASSERT_EQ(plain.size(), 2U);
  EXPECT_EQ(plain[0].value, -350) << "they ascend";
  EXPECT_EQ(plain[1].value, 120);
  EXPECT_EQ(plain[0].opacity, 1);
  EXPECT_NE(plain[0].color, plain[1].color);
  EXPECT_EQ(*parse("1:red"), (std::vector<Isosurface>{{1, {1, 0, 0}, 1}}));
  EXPECT_EQ(*parse("1:#00ff00:0.25,2:0,0.5,1:.5,3:1,0,0"),
            (std::vector<Isosurface>{{1, {0, 1, 0}, 0.25}, {2, {0, 0.5F, 1}, 0.5}, {3, {1, 0, 0}, 1}}));
  EXPECT_EQ(parse("1:#00ff0033")->front().opacity, double(0.2F)) << "a colour's own opacity";
  for (const char* text : {"", ",", "1,", "x", "nan", "1:", "1:rouge", "1:red:2", "1:red:", "1:red:1:1", "1:0,1", "1:0,1,2",
                           "1:0,0,0,1,5:", "1,1", "1e301", "1,2,3,4,5,6,7,8,9"}) {
    EXPECT_EQ(parse(text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(ParseGradientOpacities, TakesPointsThatAscend) {
  const auto parse = [](const char* text) { return ParseGradientOpacities("--gradient-opacity", text); };
  EXPECT_EQ(*parse("0:0,10:0.5,10:1"), (std::vector<GradientOpacityPoint>{{0, 0}, {10, 0.5}, {10, 1}}));
  for (const char* text : {"", "1", "1:", ":1", "-1:0", "1:2", "1:0.5:1", "2:0,1:0", "nan:1", "inf:1", "1:nan", "1:0,"}) {
    EXPECT_EQ(parse(text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(ParseClipBox, TakesBoundsInThreeUnits) {
  constexpr double kEnd = kMaxCoordinate;
  const ClipBox world = *ParseClipBox("--clip-box", "-1.5:2,:,0:");
  EXPECT_EQ(world, (ClipBox{{-1.5, -kEnd, 0}, {2, kEnd, kEnd}, ClipUnit::kWorld}));
  EXPECT_EQ(*ParseClipBox("--clip-box", "0:10,5:6,0:1v"), (ClipBox{{0, 5, 0}, {10, 6, 1}, ClipUnit::kVoxels}));
  EXPECT_EQ(*ParseClipBox("--clip-box", ":50,:,:%"), (ClipBox{{-kEnd, -kEnd, -kEnd}, {50, kEnd, kEnd}, ClipUnit::kPercent}));
  EXPECT_EQ(*ParseClipBox("--clip-box", ":50%,:,:"), (ClipBox{{-kEnd, -kEnd, -kEnd}, {50, kEnd, kEnd}, ClipUnit::kPercent}));
  EXPECT_EQ(ParseClipBox("--clip-box", "10%:50%,2v:,:").status().message(),
            "--clip-box '10%:50%,2v:,:' has bounds in voxels (v) and in percent (%): all must have one unit");
  EXPECT_EQ(*ParseClipBox("--clip-box", "1v:5v,:7,2:v"), (ClipBox{{1, -kEnd, 2}, {5, 7, kEnd}, ClipUnit::kVoxels}));
  for (const char* text : {"", ":", ":,:", "0:1,0:1,0:1,0:1", "1%%:,:,:", "0:1,0:1,1:0", "0:1,0:1,1:1", "0-1,0:1,0:1",
                           "0:1:2,:,:", "a:1,:,:", ":,:,:x", "nan:1,:,:", "0:2e300,:,:"}) {
    EXPECT_EQ(ParseClipBox("--clip-box", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(ParsePoint, TakesAnyPlaceOfAWorld) {
  EXPECT_EQ(*ParsePoint("--at", "3e22,-1e-30,2000000003"), (Vec3{3e22, -1e-30, 2000000003}));
  for (const char* text : {"inf,0,0", "nan,0,0", "1e301,0,0", "1,2"}) {
    EXPECT_EQ(ParsePoint("--at", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(ParseLabelRanges, TakesNumbersAndNames) {
  EXPECT_EQ(*ParseLabelRanges("--labels-shown", "3,5-9,Precentral_L,Temporal_*,4th ventricle,-x"),
            (std::vector<LabelRange>{
                {3, 3}, {5, 9}, {.name = "Precentral_L"}, {.name = "Temporal_*"}, {.name = "4th ventricle"}, {.name = "-x"}}));
  EXPECT_EQ(TextOf(std::vector<LabelRange>{{3, 3}, {5, 9}, {.name = "Gyrus, left"}}), "3,5-9,Gyrus? left");
  for (const char* text : {"", "1,", "0", "9-5", "5-", "-5", "1-2-3", "18446744073709551616"}) {
    EXPECT_EQ(ParseLabelRanges("--labels-shown", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
  EXPECT_EQ(ParseLabelRanges("--labels-shown", std::string(257, 'x')).status().message(),
            "--labels-shown has a name of 257 bytes, at most 256 are possible");
}

TEST(ParseValueWindow, TakesAWidthOrAName) {
  EXPECT_EQ(*ParseValueWindow("--window", "80"), (ValueWindow{80, 40}));
  EXPECT_EQ(*ParseValueWindow("--window", "lung"), (ValueWindow{1500, -600}));
  EXPECT_EQ(ParseValueWindow("--window", "lungs").status().message(),
            "--window 'lungs' is neither a number nor one of bone, lung, mediastinum, soft-tissue, brain, liver; did you mean 'lung'?");
  EXPECT_EQ(ParseValueWindow("--window", "0").status().message(), "--window 0 is out of range (0, 1e+30]");
  for (const char* text : {"", "-5", "1x", "nan"}) EXPECT_FALSE(ParseValueWindow("--window", text).ok()) << text;
}

TEST(ParseClipPlane, TakesANormalAndAnOffset) {
  EXPECT_EQ(*ParseClipPlane("--clip-plane", "1,-2,0.5,-7"), (ClipPlane{{1, -2, 0.5}, -7}));
  for (const char* text : {"", "1,2,3", "0,0,0,1", "1,2,3,4,5", "1,2,x,4", "1,0,0,nan", "1,0,0,inf"}) {
    EXPECT_EQ(ParseClipPlane("--clip-plane", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(Values, NumbersKeepToTheirRange) {
  const NumberRange zoom{0.001, 10000};
  EXPECT_EQ(*ParseNumber("--zoom", "2.5e1", zoom), 25);
  EXPECT_EQ(*ParseNumber("--zoom", "+0.001", zoom), 0.001);
  EXPECT_EQ(ParseNumber("--zoom", "0", zoom).status().message(), "--zoom 0 is out of range [0.001, 10000]");
  EXPECT_EQ(ParseNumber("--occupancy", "0", {0, 1, true}).status().message(), "--occupancy 0 is out of range (0, 1]");
  for (const char* text : {"", "nan", "-nan", "1x", " 1", "1,5", "0x10", "+-1", "--1", "one"}) {
    EXPECT_EQ(ParseNumber("--zoom", text, zoom).status().code(), StatusCode::kInvalidArgument) << text;
  }
  for (const char* text : {"inf", "-inf", "1e400", "-1e400"}) {
    EXPECT_FALSE(ParseNumber("--zoom", text, zoom).ok()) << text;
  }
}

TEST(Values, IntegersKeepToTheirRange) {
  EXPECT_EQ(*ParseInteger("--groups", "7", 0, 8), 7);
  for (const char* text : {"-1", "9", "1.5", "", "99999999999999999999", "7 "}) {
    const Result<int> value = ParseInteger("--groups", text, 0, 8);
    ASSERT_FALSE(value.ok()) << text;
    EXPECT_THAT(value.status().message(), AllOf(HasSubstr("--groups"), HasSubstr("[0, 8]"))) << text;
  }
}

TEST(Values, TimesHaveAUnitAndALimit) {
  using namespace std::chrono_literals;
  const Duration most = 24h;
  const std::vector<std::pair<std::string, Duration>> times = {{"0s", 0s}, {"500ms", 500ms}, {"30s", 30s}, {"2m", 2min}, {"24h", 24h}};
  for (const auto& [text, expected] : times) EXPECT_EQ(*ParseDuration("--drain", text, most), expected) << text;
  for (const char* text : {"", "30", "s", "-1s", "1.5s", "30 s", "30sec", "99999999999999999999s"}) {
    const Result<Duration> value = ParseDuration("--drain", text, most);
    ASSERT_FALSE(value.ok()) << text;
    EXPECT_THAT(value.status().message(), AllOf(HasSubstr("--drain"), HasSubstr("is not a time"))) << text;
  }
  for (const char* text : {"25h", "86401s", "9223372036854775807h"}) {
    EXPECT_THAT(ParseDuration("--drain", text, most).status().message(), AllOf(HasSubstr("--drain"), HasSubstr("86400 s"))) << text;
  }
}

TEST(Values, SizesAreSquaresOrPairs) {
  EXPECT_EQ(*ParseImageSize("--size", "640x480"), (ImageSize{640, 480}));
  EXPECT_EQ(*ParseImageSize("--size", "512"), (ImageSize{512, 512}));
  for (const char* text : {"16384x16384", "", "x", "0", "640x", "x480", "640x480x3", "640X480", "-1x5", "16385", "1x100000"}) {
    EXPECT_EQ(ParseImageSize("--size", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(Values, DirectionsAndColors) {
  EXPECT_EQ(*ParseDirection("--light", "1,-2,0.5"), (Vec3{1, -2, 0.5}));
  EXPECT_EQ(*ParseColor("--background", "0,0.5,1"), (StraightColor{0, 0.5F, 1, 1}));
  EXPECT_EQ(*ParseColor("--background", "0,0,0,0.25"), (StraightColor{0, 0, 0, 0.25F}));
  EXPECT_EQ(*ParseColor("--background", "#ff3300"), (StraightColor{1, 0.2F, 0, 1}));
  EXPECT_EQ(*ParseColor("--background", "#FF330033"), (StraightColor{1, 0.2F, 0, 0.2F}));
  EXPECT_EQ(*ParseColor("--background", "white"), (StraightColor{1, 1, 1, 1}));
  EXPECT_EQ(*ParseColor("--background", "rebeccapurple"), *ParseColor("--background", "#663399"));
  EXPECT_EQ(*ParseColor("--background", "steelblue"), *ParseColor("--background", "#4682b4"));
  for (const char* text : {"", "1,2", "0,0,0", "1,2,3,4", "1,,2", "nan,0,0", "inf,0,0"}) {
    EXPECT_EQ(ParseDirection("--light", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
  for (const char* text :
       {"", "1,1", "1,1,1.5", "-0.1,0,0", "0,0,0,0,0", "rouge", "White", "#ffff", "#12345g", "#1234567", "#+12345", "#"}) {
    EXPECT_EQ(ParseColor("--background", text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

TEST(Values, ChoicesAreNamedWhenNoneFits) {
  constexpr std::string_view kNames[] = {"splat", "zbuffer"};
  EXPECT_EQ(*ParseChoice("--renderer", "zbuffer", kNames), 1U);
  EXPECT_EQ(ParseChoice("--renderer", "ray", kNames).status().message(), "--renderer 'ray' is not one of splat, zbuffer");
}

TEST(FramePatternTest, FillsInTheNumberAsPrintfDoes) {
  for (const char* text : {"frame_%04d.png", "%d.png", "a%%b%3d.exr", "%i", "dir.d/%02u.png"}) {
    const Result<FramePattern> pattern = FramePattern::Parse("-o", text);
    ASSERT_TRUE(pattern.ok()) << pattern.status().message();
    for (const int index : {0, 7, 12345}) {
      char expected[64];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
      std::snprintf(expected, sizeof expected, text, index);
#pragma GCC diagnostic pop
      EXPECT_EQ(pattern->Name(index), expected);
    }
  }
}

TEST(FramePatternTest, RefusesEverythingButOneInteger) {
  for (const char* text : {"", "frame.png", "%s.png", "%d_%d.png", "%n", "%4.2f", "%", "a%", "%99999d", "%ld", "%*d", "%%"}) {
    const Result<FramePattern> pattern = FramePattern::Parse("-o", text);
    ASSERT_FALSE(pattern.ok()) << text;
    EXPECT_THAT(pattern.status().message(), HasSubstr("-o")) << text;
  }
}

TEST(Values, ATurntablesOutputIsPicturesOrOneMovie) {
  EXPECT_EQ(ParseTurntableOutput("-o", "f%02d.png")->pictures.Name(7), "f07.png");
  EXPECT_EQ(ParseTurntableOutput("-o", "f%02d.png")->movie, "");
  for (const char* movie : {"a.mp4", "a.b/c.WEBM", "100%.gif", "%s.mp4"}) EXPECT_EQ(ParseTurntableOutput("-o", movie)->movie, movie);
  EXPECT_THAT(ParseTurntableOutput("-o", "%d.gif").status().message(), HasSubstr("a movie is one file"));
  for (const char* neither : {"", "mp4", "a.mp4.png", "a.png", ".mp4/x"}) {
    EXPECT_THAT(ParseTurntableOutput("-o", neither).status().message(), HasSubstr("or the ending of a movie: .mp4, .webm or .gif"))
        << neither;
  }
}

TEST(ParsePlane, TakesAPlaneAndItsLook) {
  const auto parse = [](const char* text) { return ParsePlane("--plane", text); };
  EXPECT_EQ(*parse("axial"), (PlaneChoice{.slab = {.normal = {0, 0, 1}}}));
  EXPECT_EQ(*parse("coronal:y=-4.5"), (PlaneChoice{.slab = {.normal = {0, 1, 0}, .through = Vec3{0, -4.5, 0}}}));
  EXPECT_EQ(*parse("x:index=7,opacity=0.5,map=plasma,range=-10:250"),
            (PlaneChoice{.slab = {.normal = {1, 0, 0}, .index = 7}, .opacity = 0.5, .map = "plasma", .range = ScalarRange{-10, 250}}));
  EXPECT_EQ(*parse("1/0/-2:at=3/4/5,range=2%:98%"),
            (PlaneChoice{.slab = {.normal = {1, 0, -2}, .through = Vec3{3, 4, 5}}, .range = ScalarRange{2, 98, true}}));
  for (const char* text : {"axial", "x:index=7,opacity=0.5,map=plasma,range=-10:250", "1/0/-2:at=3/4/5,range=2%:98%", "y:at=1/2/3",
                           "sagittal:x=2.25", "z:z=0"}) {
    const PlaneChoice plane = *parse(text);
    EXPECT_EQ(*parse(TextOf(plane).c_str()), plane) << text << " is written as " << TextOf(plane);
  }
}

TEST(ParsePlane, SaysWhatIsWrong) {
  const auto message = [](const char* text) { return ParsePlane("--plane", text).status().message(); };
  for (const char* text : {"", ":", ",opacity=1", "oblique", "1/0", "0/0/0", "1/0/x"}) {
    EXPECT_THAT(message(text), HasSubstr("or a normal X/Y/Z")) << text;
  }
  EXPECT_THAT(message("axial:x=3"), HasSubstr("has 'x=3', but must have one of: z=N, index=N, at=X/Y/Z"));
  EXPECT_THAT(message("1/1/0:x=3"), HasSubstr("must have one of: index=N, at=X/Y/Z"));
  EXPECT_THAT(message("axial:at=3"), HasSubstr("at '3' is not X/Y/Z"));
  EXPECT_THAT(message("axial:index=-1"), HasSubstr("index"));
  EXPECT_THAT(message("axial:z=far"), HasSubstr("far"));
  EXPECT_THAT(message("axial,color=red"), HasSubstr("has 'color', but must have one of: opacity, map, range"));
  EXPECT_THAT(message("axial,opacity=0"), HasSubstr("must lie in (0, 1]"));
  EXPECT_THAT(message("axial,range=5:1"), HasSubstr("5"));
}

TEST(ParseShape, TakesATime) {
  EXPECT_EQ(ParseShape("--shape", "surf,time=3")->time, 3);
  EXPECT_EQ(TextOf(*ParseShape("--shape", "surf,time=3")), "surf,time=3");
  EXPECT_FALSE(ParseShape("--shape", "surf,time=last").ok());
}

}  // namespace
}  // namespace slabstream
