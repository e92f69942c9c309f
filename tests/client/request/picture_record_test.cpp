// The command line that `info` prints of a picture asks for the same picture.
#include "client/request/picture_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "client/cli/option_groups.h"
#include "tests/support/json_at.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;
using testing::Not;

// What `slabstream` makes of the arguments of render.
FrameOptions Parse(std::vector<std::string> arguments) {
  FrameOptions options;
  const Program app;
  std::string output;
  app.AddText("-o,--output", output).Required();
  AddFrameOptions(app, options);
  app.AddFlag("--previews", options.request.previews);
  EXPECT_EQ(app.Parse(std::move(arguments)).message, "");
  return options;
}

PictureGeometry SomeGeometry() {
  PictureGeometry geometry;
  geometry.world = World::kPatient;
  geometry.unit = LengthUnit::kMillimetre;
  geometry.pixel_size = 0.1;
  return geometry;
}

PictureRecord RecordOf(const FrameOptions& options) {
  Result<PictureRecord> record = ParseRecord(RecordText(options.source, options.request, options.format, SomeGeometry(), options.layers));
  EXPECT_TRUE(record.ok()) << record.status().message();
  return *std::move(record);
}

// `asked`, a record or options, asks for the picture that was typed; not for the dataset, which the connection decides.
template <class Asked>
void ExpectSamePicture(const Asked& asked, const FrameOptions& typed) {
  FrameRequest request = asked.request, expected = typed.request;
  request.dataset = typed.request.dataset;
  for (FrameRequest* each : {&request, &expected}) std::ranges::sort(each->fields, {}, &FieldChoice::field);  // their order says nothing
  EXPECT_EQ(request, expected);
  EXPECT_EQ(asked.format.background, typed.format.background);
  EXPECT_EQ(asked.format.png_bits, typed.format.png_bits);
  EXPECT_EQ(asked.format.quality, typed.format.quality);
  EXPECT_EQ(asked.format.dots_per_inch, typed.format.dots_per_inch);
  EXPECT_EQ(asked.format.annotations, typed.format.annotations);
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

const std::vector<std::vector<std::string>> kOptions = {
    {},
    {"--size", "300x200"},
    {"--size", "64", "--projection", "perspective", "--fov", "12.5", "--distance", "1e3"},
    {"--azimuth", "-30.1", "--elevation", "0.1", "--roll", "-0.30000000000000004", "--zoom", "1e-3"},
    {"--view", "anterior"},
    {"--view", "superior", "--fit"},
    {"--view", "back"},
    {"--azimuth", "0", "--elevation", "0", "--no-fit"},
    {"--look-at", "1,2,3", "--no-fit"},
    {"--eye", "1,2,3", "--fit"},
    {"--look-at", "-1,2.5,1e-7", "--eye", "-100,-200,3"},
    {"--eye", "1,2,3", "--up", "0,-1,0", "--projection", "perspective"},
    {"--renderer", "mip", "--projection-mode", "minimum"},
    {"--renderer", "raycast", "--sampling-rate", "2"},
    {"--renderer", "zbuffer", "--shading", "depth-gradient"},
    {"--transfer", "opaque", "--opacity-distance", "0.25"},
    {"--scalar-range", "0.1:1e30"},
    {"--scalar-range", "0.30000000000000004%:98%"},
    {"--renderer", "raycast", "--isovalue", "300:#804020:0.1,-120.5:1,0.9,0.8,1e30"},
    {"--renderer", "zbuffer", "--isovalue=-5,7:white", "--transfer", "auto"},
    {"--renderer", "raycast", "--gradient-opacity", "0:0,0.1:0.30000000000000004,1e9:1", "--transfer", "none"},
    {"--transfer", "gray-ramp", "--scalar-range=-5.5:100"},
    {"--renderer", "raycast", "--label-mode", "tint"},
    {"--renderer", "raycast", "--label-mode", "surface", "--label-opacity", "3=0.30000000000000004,7=0", "--labels-shown", "1,5-9"},
    {"--renderer", "raycast", "--label-mode", "surface", "--label-surface", "smooth"},
    {"--renderer", "raycast", "--label-mode", "highlight", "--labels-shown", "Temporal_*,7,H\xC3\xB6hle ?"},
    {"--renderer", "raycast", "--label-tint", "0.1", "--overlay-transfer", "gray-ramp", "--overlay-range=-3:1e-3", "--overlay-weight",
     "0.5"},
    {"--renderer", "raycast", "--labels", "atlas.nii", "--overlay", "map.nii"},
    {"--renderer", "raycast", "--overlay-range", "2%:98.5%"},
    {"--channel", "0,2", "--time", "3.5s", "--blend", "over"},
    {"--channel", "DAPI", "--channel-color", "DAPI=0.1,0.2,0.3,1=#0f0", "--channel-range", "DAPI=2%:99.5%", "--channel-gamma", "1=0.1",
     "--channel-opacity", "1=0.30000000000000004", "--channel-transfer", "7=viridis"},
    {"--clip-box", ":,:,20:"},
    {"--clip-box=-1.5:0.1,5:6,0:1v", "--clip-mode", "cut-away"},
    {"--clip-box", "0:50,:,:%", "--clip-plane", "0.1,0,-1e-3,-7", "--clip-plane=-1,2,3,4e8"},
    {"--shading", "none", "--light", "-1,0,0", "--light", "0,1e-3,5"},
    {"--background", "0.2,0.4,0.6"},
    {"--background", "0,0,0,0.1", "--depth", "16"},
    {"--termination", "0"},
    {"--decomposition", "kd-tree", "--axis", "view", "--balance-by", "cost", "--assignment", "greedy", "--balance", "dynamic"},
    {"--groups", "3", "--teams", "2", "--combine", "radix-k:2x2", "--pixel-error", "1e-4"},
    {"--axes", "grid"},
    {"--scale-bar", "--orientation-marker", "--title", "It's \"B\xC3\xBCro\" \xE2\x86\x92 $x"},
    {"--title=-x"},
    {"--color-bar", "--legend"},
    {"--color-bar=velocity (m/s)"},
    {"--title", "x", "--font-size", "9.5", "--dpi", "300", "--quality", "75"},
    {"--previews"},
};

TEST(PictureRecordTest, TheCommandLineAsksForTheSamePicture) {
  Random random(94);
  SCOPED_TRACE(random.trace());
  for (const std::string source : {"brain", "scans/head.nii.gz", "-odd"}) {
    for (const std::vector<std::string>& more : kOptions) {
      std::vector<std::string> arguments = {"-o", "a.png"};
      arguments.insert(arguments.end(), more.begin(), more.end());
      arguments.insert(arguments.end(), {"--", source});
      const FrameOptions typed = Parse(arguments);
      const PictureRecord record = RecordOf(typed);
      EXPECT_EQ(record.source, source);
      ExpectSamePicture(record, typed);

      std::vector<std::string> again = RenderArguments(record, "b.png");
      SCOPED_TRACE(Joined(again));
      ASSERT_EQ(again.front(), "render");
      again.erase(again.begin());
      const FrameOptions parsed = Parse(again);
      EXPECT_EQ(parsed.source, source);
      EXPECT_EQ(parsed.layers, typed.layers);
      EXPECT_EQ(parsed.connection.local_workers > 0, source == "scans/head.nii.gz");
      ExpectSamePicture(parsed, typed);
    }
  }
}

TEST(PictureRecordTest, TheCommandLineHoldsWhatDiffersFromTheDefaults) {
  EXPECT_EQ(Joined(RenderArguments(RecordOf(Parse({"-o", "a.png", "brain"})), "b.png")), "render brain -o b.png");
  EXPECT_EQ(Joined(RenderArguments(RecordOf(Parse({"-o", "a.png", "./b.nrrd", "--local=3", "--view", "left", "--zoom", "2"})), "b.png")),
            "render ./b.nrrd --local --azimuth 270 --elevation 0 --zoom 2 -o b.png");
}

TEST(PictureRecordTest, ATransferFunctionOfAFileIsKeptWhole) {
  const TemporaryDirectory directory;
  const std::string map = directory / "map.json";
  std::ofstream(map) << R"([{"RGBPoints": [0, 0.1, 0.2, 0.3, 255, 1, 1, 1], "Points": [0, 0, 0.5, 0, 255, 0.7, 0.25, 1]}])";
  const FrameOptions typed = Parse({"-o", "a.png", "brain", "--transfer", map});
  const PictureRecord record = RecordOf(typed);
  ExpectSamePicture(record, typed);
  EXPECT_EQ(Joined(RenderArguments(record, "b.png")), "render brain --transfer color-map.json -o b.png");
}

TEST(PictureRecordTest, OfSlabstream01LayersAreFields) {
  const PictureRecord record = RecordOf(Parse(
      {"-o", "a.png", "brain", "--renderer", "raycast", "--overlay-range", "3:8", "--channel-gamma", "0=2", "--labels-shown", "5-9"}));
  Json old = record.json;
  old["request"]["fields"] = Json::array();
  for (Json look : record.json["request"]["fields"]) {
    const bool overlay = look["field"] == "overlay", labels = look["field"] == "labels";
    if (overlay) look.erase("field");
    if (overlay) old["request"]["overlay"] = look;
    if (labels) old["request"]["labels"] = look["labels"];
    if (!overlay && !labels) old["request"]["fields"].push_back(look);
  }
  ASSERT_TRUE(old["request"].contains("overlay") && old["request"].contains("labels"));
  const Result<PictureRecord> read = ParseRecord(old.dump());
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_THAT(read->request.fields, testing::UnorderedElementsAreArray(record.request.fields));
  for (const char* wrong : {"7", "[]", R"({"weight": "x"})"}) {
    old["request"]["overlay"] = Json::Parse(wrong).value();
    EXPECT_FALSE(ParseRecord(old.dump()).ok()) << wrong;
  }
}

TEST(PictureRecordTest, TheTextIsAsciiAndNamesNoPlace) {
  FrameOptions options = Parse({"-o", "a.png", "B\xC3\xBCro.nrrd", "--local=7", "--threads", "3", "--title", "\xC3\xA4"});
  const std::string text = RecordText(options.source, options.request, options.format, SomeGeometry());
  for (const char c : text) ASSERT_TRUE(c >= 0x20 && c < 0x7F) << text;
  EXPECT_THAT(text, HasSubstr("B\\u00fcro.nrrd"));
  // The same at a service: neither how many workers nor which dataset is told.
  options.connection = {};
  options.connection.service.endpoint = "tcp://127.0.0.1:7420";
  options.request.dataset = "volume";
  EXPECT_EQ(RecordText(options.source, options.request, options.format, SomeGeometry()), text);
  for (const char* place : {"7420", "127.0.0.1", "dataset", "a.png", "threads"}) EXPECT_THAT(text, Not(HasSubstr(place)));
}

TEST(PictureRecordTest, CoarseLevelsAreNamed) {
  const FrameOptions options = Parse({"-o", "a.png", "brain"});
  const auto text = [&](const std::vector<LevelUse>& levels) {
    return RecordText("brain", options.request, options.format, SomeGeometry(), {}, levels);
  };
  EXPECT_EQ(text({{.level = 0}}), text({})) << "most volumes have no other one";
  const Result<PictureRecord> record = ParseRecord(text({{.level = 0}, {.level = 2}}));
  ASSERT_TRUE(record.ok()) << record.status().message();
  EXPECT_EQ(record->json["levels"], Json::array({0, 2}));
  EXPECT_EQ(Joined(RenderArguments(*record, "b.png")), "render brain -o b.png") << "the same level follows from the same request";
}

TEST(PictureRecordTest, BadRecordsAreNamed) {
  const FrameOptions options = Parse({"-o", "a.png", "brain"});
  const Json good = Json::Parse(RecordText("brain", options.request, options.format, SomeGeometry())).value();
  EXPECT_TRUE(ParseRecord(good.dump()).ok());
  const auto with = [&](const char* pointer, const Json& value) {
    Json bad = good;
    JsonAt(bad, pointer) = value;
    return bad.dump();
  };
  const auto without = [&](const char* field) {
    Json bad = good;
    bad.erase(field);
    return bad.dump();
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "not JSON"},
      {"[]", "must be an object"},
      {std::string(100000, '['), "nest"},
      {without("source"), "record.source: is missing"},
      {without("request"), "record.request: is missing"},
      {without("picture"), "record.picture: is missing"},
      {without("geometry"), "record.geometry: is missing"},
      {with("/more", 1), "'more' is no field"},
      {with("/source", 1), "record.source"},
      {with("/geometry", 1), "record.geometry"},
      {with("/picture/depth", 12), "depth 12"},
      {with("/picture/background", {1, 2, 3, 4}), "record.picture.background[1]: 2"},
      {with("/picture/background", {1, 1, 1, 1, 1}), "must be four numbers"},
      {with("/picture/title", "a\nb"), "control character"},
      {with("/picture/scale_bar", "yes"), "true or false"},
      {with("/request", "splat"), "FrameRequest"},
      {with("/request/zoom", 1), "zoom"},
      {with("/request/view/zoom", 1e9), "view.zoom"},
      {with("/request/view/zoom", "big"), "zoom"},
      {with("/request/renderer", "toaster"), "toaster"},
      {with("/request/size/width", -1), "width"},
      {with("/request/view/projection", "FISHEYE"), "projection"},
      {with("/request/view/projection", 7), "projection"},
  };
  for (const auto& [text, message] : cases) {
    const Result<PictureRecord> record = ParseRecord(text);
    ASSERT_FALSE(record.ok()) << message;
    EXPECT_EQ(record.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(record.status().message(), HasSubstr(message));
    EXPECT_EQ(record.status().message().find('\n'), std::string::npos);
  }
}

// Whatever the request left to the service.
TEST(PictureRecordTest, TheRecordHasTheViewAndTheRendererThatWereUsed) {
  const FrameRequest asked = Parse({"-o", "a.png", "brain"}).request;
  FrameStatistics statistics;
  statistics.renderer = "mip";
  statistics.view = ViewParameters{.azimuth_degrees = 180, .zoom = 1.1, .look_at = Vec3{0.1, 2, -3}};
  const FrameRequest made = AsMade(asked, statistics);
  EXPECT_EQ(made.view, *statistics.view);
  const Result<PictureRecord> record = ParseRecord(RecordText("brain", made, {}, SomeGeometry()));
  ASSERT_TRUE(record.ok()) << record.status().message();
  EXPECT_EQ(Joined(RenderArguments(*record, "b.png")),
            "render brain --azimuth 180 --elevation 0 --look-at 0.1,2,-3 --no-fit --zoom 1.1 --renderer mip -o b.png");
}

// Records of version 0.1 state every number of the view: those pictures had no default view.
TEST(PictureRecordTest, OlderRecordsKeepTheirView) {
  FrameRequest plain;
  plain.dataset = "brain";
  const Result<PictureRecord> record = ParseRecord(RecordText("brain", plain, {}, SomeGeometry()));
  ASSERT_TRUE(record.ok()) << record.status().message();
  EXPECT_EQ(Joined(RenderArguments(*record, "b.png")), "render brain --azimuth 0 --elevation 0 --no-fit -o b.png");
}

}  // namespace
}  // namespace slabstream
