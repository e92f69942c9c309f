#include "laboratory/experiments/sweep_file.h"

#include "client/request/picture_fields.h"
#include "laboratory/experiments/request_json.h"
#include "tests/support/renderers.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr const char* kGood = R"({
  "title": "two", "size": [300, 200],
  "volumes": [{"sphere": {"class": 2, "size": 40, "occupancy": 0.3}, "opacity": 0.2}],
  "renderers": ["splat", {"name": "fine", "renderer": "raycast", "sampling-rate": 2, "shading": "none", "light": [[1, 0, 0.5]], "termination": 0}],
  "views": [{"azimuth": 30}, {"name": "close", "projection": "perspective", "zoom": 2}],
  "policies": [{"combine": "fan-in"}, {"name": "even", "decomposition": "kd-tree", "balance_by": "occupied", "assignment": "greedy", "groups": 2, "combine": "tree:4,strips=8", "balance": "dynamic", "pixel_error": 0.001, "axis": "x", "teams": 2}],
  "workers": [1, 16],
  "links": ["10gbit", "1gbit:30,1"],
  "hosts": {"cores": 1, "traffic": "encrypted"}
})";

TEST(SweepFile, ReadsWhatItSays) {
  const Result<Sweep> sweep = ParseSweep("s.json", kGood);
  ASSERT_TRUE(sweep.ok()) << sweep.status().message();
  EXPECT_EQ(sweep->title, "two");
  EXPECT_EQ(sweep->size, (ImageSize{300, 200}));
  EXPECT_EQ(sweep->volumes[0].opacity, 0.2);
  ASSERT_EQ(sweep->renderers.size(), 2U);
  EXPECT_EQ(sweep->renderers[0].name, "splat");
  EXPECT_EQ(sweep->renderers[1].name, "fine");
  EXPECT_EQ(sweep->renderers[1].kind, FindRenderer("raycast"));
  EXPECT_EQ(sweep->renderers[1].look.parameters, (ParameterTexts{{"sampling-rate", "2"}}));
  EXPECT_EQ(sweep->renderers[1].look.shading.model, ShadingModel::kNone);
  EXPECT_EQ(sweep->renderers[1].look.shading.lights, (std::vector<Vec3>{{1, 0, 0.5}}));
  EXPECT_EQ(sweep->renderers[1].look.termination, 0);
  EXPECT_EQ(sweep->policies[1].policy.axis, AxisChoice::kX);
  EXPECT_EQ(sweep->policies[1].policy.teams, 2);
  EXPECT_EQ(sweep->views[0].name, "view 1");
  EXPECT_EQ(sweep->views[1].view.zoom, 2);
  EXPECT_EQ(sweep->policies[0].name, "kd-tree by bricks, cyclic, static, 1 groups, fan-in");
  EXPECT_EQ(sweep->policies[1].policy.balance_by, "occupied");
  EXPECT_EQ(sweep->policies[1].policy.assignment, "greedy");
  EXPECT_EQ(sweep->policies[1].policy.balance, "dynamic");
  EXPECT_EQ(sweep->policies[1].policy.pixel_error, 0.001);
  EXPECT_EQ(sweep->workers, (std::vector{1, 16}));
  EXPECT_EQ(sweep->host.cores, 1);
  EXPECT_TRUE(sweep->host.encrypted);
  EXPECT_DOUBLE_EQ(sweep->links[1].link.latency_seconds, 30e-6);
}

TEST(SweepFile, FieldsOfAServicesDatasetsAreSaidAsOnTheCommandLine) {
  const std::string text = R"({"volumes": [{"dataset": "cells"}], "policies": [{}], "renderers": ["mip",
    {"renderer": "raycast", "channel": ["0", "Actin"], "channel-color": "0=#ff8000", "channel_range": "Actin=10:200",
     "channel-opacity": "overlay=0.5", "blend": "over", "time": 2, "label-mode": "surface"}]})";
  const Result<Sweep> sweep = ParseSweep("s.json", text, SweepPlace::kAtService);
  ASSERT_TRUE(sweep.ok()) << sweep.status().message();
  const FrameRequest& look = sweep->renderers.at(1).look;
  const RenderRequest typed = ParseRenderFields({{"dataset", "cells"},
                                                 {"channel", "0,Actin"},
                                                 {"channel-color", "0=#ff8000"},
                                                 {"channel-range", "Actin=10:200"},
                                                 {"overlay-weight", "0.5"},
                                                 {"blend", "over"},
                                                 {"time", "2"},
                                                 {"label-mode", "surface"}})
                                  .value();
  EXPECT_EQ(look.channels, typed.frame.channels);
  EXPECT_THAT(look.fields, testing::UnorderedElementsAreArray(typed.frame.fields));
  EXPECT_EQ(look.blend, typed.frame.blend);
  EXPECT_EQ(look.time, typed.frame.time);
  EXPECT_THAT(RequestJson(RequestOf(FramesOf(*sweep).at(1).frame))["channels"].dump(), HasSubstr("Actin")) << "keys of trials tell";
  EXPECT_THAT(ParseSweep("s.json", R"({"volumes": [{"sphere": {}}], "workers": [1], "policies": [{}],
    "renderers": [{"renderer": "raycast", "channel": "1"}]})")
                  .status()
                  .message(),
              HasSubstr("'channel' is of datasets of a service; a file may be one channel at one time"));
}

TEST(SweepFile, LeavesTheSchemeAndTheGroupsToTheService) {
  const Result<Sweep> sweep = ParseSweep("s.json", R"({"volumes": [{"sphere": {}}], "workers": [2],
    "policies": [{"groups": "auto"}]})");
  ASSERT_TRUE(sweep.ok()) << sweep.status().message();
  EXPECT_EQ(sweep->policies[0].name, "kd-tree by bricks, cyclic, static, auto groups, combined as the service does");
  EXPECT_EQ(sweep->policies[0].policy.groups, 0);
}

TEST(SweepFile, HasDefaults) {
  const Result<Sweep> sweep = ParseSweep("s.json", R"({"volumes": [{"sphere": {}}], "policies": [{}], "workers": [2]})");
  ASSERT_TRUE(sweep.ok()) << sweep.status().message();
  ASSERT_EQ(sweep->renderers.size(), 1U);
  EXPECT_EQ(sweep->renderers[0].kind, FindRenderer("splat"));
  EXPECT_EQ(sweep->views.size(), 1U);
  EXPECT_EQ(sweep->links[0].name, "10gbit");
}

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

TEST(SweepFile, TellsWhatIsWrongInOneLineThatNamesFieldValueAndLimit) {
  struct Case {
    std::string what, with, says;
  };
  const std::vector<Case> cases = {
      {"[1, 16]", "[0]", "workers[0]: 0 must be a whole number in [1, 4096]"},
      {"[1, 16]", "[1.5]", "workers[0]: 1.5 must be a whole number in [1, 4096]"},
      {"[1, 16]", "[]", "workers: [] must be a list of at least one"},
      {"[1, 16]", "3", "workers: 3 must be a list"},
      {"\"workers\"", "\"wrokers\"", "'wrokers' is no field; there are title, size"},
      {"\"kd-tree\"", "\"cake\"", "policies[1].decomposition: decomposition 'cake' is not one of slab, "},
      {"\"tree:4,strips=8\"", "\"tree:1\"", "policies[1].combine: "},
      {"\"greedy\"", "\"lots\"", "policies[1].assignment: assignment 'lots' is not one of cyclic"},
      {"\"dynamic\"", "\"always\"", "policies[1].balance: balance 'always' is not one of static, dynamic"},
      {"0.001", "2", "policies[1].pixel_error: pixel-error 2 is out of range [0, 0.1]"},
      {"\"groups\": 2", "\"groups\": -1", "policies[1].groups: groups -1 is out of range [0, 1024]"},
      {"\"teams\": 2", "\"teams\": 3", "policies[1].teams: 3 must divide 16 workers"},
      {"\"teams\": 2", "\"teams\": 0", "policies[1].teams: teams 0 is out of range [1, 1024]"},
      {"\"sampling-rate\": 2", "\"sampling-rate\": 99", "renderers[1]: sampling-rate is '99'"},
      {"\"sampling-rate\": 2", "\"slope\": 2", "renderers[1]: 'slope' is no field; there are "},
      {"\"none\"", "\"flat\"", "renderers[1].shading: shading 'flat' is not one of phong, none, depth-gradient"},
      {"[1, 0, 0.5]", "[0, 0, 0]", "renderers[1].light: light 0,0,0 has no direction"},
      {"[1, 0, 0.5]", "[1, 0]", "renderers[1].light: light '1,0' is not X,Y,Z"},
      {"\"termination\": 0", "\"termination\": 1", "renderers[1].termination: termination 1 is out of range [0, 0.5]"},
      {"\"opacity\": 0.2", "\"transfer\": \"cake\"", "volumes[0].transfer: "},
      {"\"opacity\": 0.2", "\"opacity_distance\": 0", "volumes[0].opacity_distance: 0 must be a number in (0, 1000000]"},
      {"\"opacity\": 0.2", "\"opacity\": 0.2, \"transfer\": \"auto\"", "volumes[0]: 'opacity' is that of a sphere without"},
      {"\"groups\": 2", "\"group\": 2", "policies[1]: 'group' is no field"},
      {"\"1gbit:30,1\"", "\"string\"", "links[1]: "},
      {"\"1gbit:30,1\"", "7", "links[1]: 7 must be a text"},
      {"\"zoom\": 2", "\"zoom\": 0", "views[1].zoom: zoom 0 is out of range ["},
      {"{\"azimuth\": 30}", "30", "views[0]: 30 must be an object"},
      {"\"close\"", "\"view 1\"", "views: two of them are called 'view 1'"},
      {"\"occupancy\": 0.3", "\"occupancy\": 0.9", "volumes[0].sphere.occupancy: 0.9 must be a number in (0, 0.52]"},
      {"\"class\": 2", "\"class\": 3", "volumes[0].sphere.class: 3 must be a whole number in [1, 2]"},
      {"{\"sphere\": {\"class\": 2, \"size\": 40, \"occupancy\": 0.3}, \"opacity\": 0.2}", "{\"file\": \"/no/such.nrrd\"}",
       "volumes[0].file: "},
      {"{\"sphere\": {\"class\": 2, \"size\": 40, \"occupancy\": 0.3}, \"opacity\": 0.2}", "{}", "must have either 'sphere' or 'file'"},
      {"\"cores\": 1", "\"cores\": 0", "hosts.cores: 0 must be a whole number in [1, 1024]"},
      {"\"encrypted\"", "\"secret\"", "hosts.traffic: \"secret\" must be one of plain, encrypted"},
      {"[300, 200]", "[300]", "size: [300] must be [width, height]"},
      {"[300, 200]", "0", "size: 0 must be a whole number in [1, "},
      {"\"title\"", "title", "not JSON: "},
      {"300", "1e999", "not JSON: number overflow parsing '1e999'"},
  };
  for (const Case& c : cases) {
    const Status status = ParseSweep("s.json", Replaced(kGood, c.what, c.with)).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << c.with;
    EXPECT_THAT(status.message(), testing::StartsWith("FILE 's.json'")) << c.with;
    EXPECT_THAT(status.message(), HasSubstr(c.says)) << c.with;
    EXPECT_EQ(status.message().find('\n'), std::string::npos) << status.message();
  }
  for (const char* text : {"", "[]", "3", "{}", "null"}) EXPECT_FALSE(ParseSweep("s.json", text).ok()) << text;
}

TEST(SweepFile, AnErrorIsOneLineHoweverTheFileIsMade) {
  // Values that nest as deep as the file is long: neither reading them nor writing them out may use up the stack.
  const std::string deep = std::string(kMaxSweepBytes / 2, '[') + std::string(kMaxSweepBytes / 2, ']');
  for (const auto& [what, with] : std::vector<std::pair<std::string, std::string>>{{"[300, 200]", deep},
                                                                                   {"{\"combine\": \"fan-in\"}", deep},
                                                                                   {"\"workers\"", "\"wor\\nkers\""},
                                                                                   {"\"workers\"", "\"" + std::string(100'000, 'w') + "\""},
                                                                                   {"\"tree:4,strips=8\"", "\"tree:\\n\""},
                                                                                   {"\"close\"", "\"a\\nb\"}, {\"name\": \"a\\nb\""}}) {
    const Status status = ParseSweep("s.json", Replaced(kGood, what, with)).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << with.substr(0, 40);
    EXPECT_EQ(status.message().find('\n'), std::string::npos) << status.message();
    EXPECT_LE(status.message().size(), 1024U);
  }
}

TEST(SweepFile, AtAServiceVolumesAreDatasets) {
  const char* text = R"({"volumes": [{"dataset": "head", "transfer": "ct-bone"}, {"sphere": {"class": 2, "size": 512, "occupancy": 0.4}}],
    "policies": [{}]})";
  const Result<Sweep> sweep = ParseSweep("s.json", text, SweepPlace::kAtService);
  ASSERT_TRUE(sweep.ok()) << sweep.status().message();
  EXPECT_EQ(sweep->volumes[0].dataset, "head");
  EXPECT_EQ(sweep->volumes[0].name, "head-ct-bone");
  EXPECT_EQ(sweep->volumes[1].dataset, "class2-512");
  EXPECT_THAT(sweep->workers, testing::IsEmpty());
  EXPECT_THAT(sweep->links, testing::IsEmpty());

  const auto refused = [](const std::string& file, SweepPlace place) { return ParseSweep("s.json", file, place).status().message(); };
  EXPECT_THAT(refused(R"({"volumes": [{"file": "head.nrrd"}], "policies": [{}]})", SweepPlace::kAtService),
              HasSubstr("volumes[0]: {\"file\":\"head.nrrd\"} must have either 'sphere' or 'dataset': the service has volumes of its own"));
  for (const char* own : {"workers", "links", "hosts"}) {
    EXPECT_THAT(refused(Replaced(text, "{", std::string("{\"") + own + "\": [1], "), SweepPlace::kAtService),
                HasSubstr(std::string("'") + own + "': a running service has its own"));
  }
  EXPECT_THAT(refused(text, SweepPlace::kHere), HasSubstr("must have either 'sphere' or 'file'"));
}

TEST(SweepFile, FramesAreEveryCombination) {
  const Sweep sweep = ParseSweep("s.json", kGood).value();
  const std::vector<SweepFrame> frames = FramesOf(sweep);
  ASSERT_EQ(frames.size(), 8U);
  EXPECT_EQ(frames[7].frame.volume.renderer, FindRenderer("raycast"));
  EXPECT_EQ(frames[7].frame.policy, sweep.policies[1].policy);
  EXPECT_EQ(frames[7].names["part"], "class2-40-0.3, fine, close");
}

TEST(SweepFile, ALongListIsRefused) {
  std::string workers = "1";
  for (int i = 0; i < 3000; ++i) workers += ", 2";
  const Status status = ParseSweep("s.json", Replaced(kGood, "1, 16", workers)).status();
  EXPECT_THAT(status.message(), HasSubstr("cases are too many: at most 10000"));
}

}  // namespace
}  // namespace slabstream
