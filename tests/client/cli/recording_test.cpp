#include "client/cli/recording.h"
#include "common/json/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/laboratory/measure/recorded.h"

namespace slabstream {
namespace {

using ::testing::HasSubstr;

Json TraceOf(const std::vector<RecordedFrame>& frames) { return {{"traceEvents", Json::array()}, {kRecordingKey, RecordingJson(frames)}}; }

TEST(Recording, IsReadBackAsItWasWritten) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 20; ++i) {
    const std::vector<RecordedFrame> written = RandomRecording(random, random.Integer(1, 4), random.Integer(1U, 6U));
    const std::vector<RecordedFrame> read = ParseRecording(TraceOf(written).dump()).value();
    ASSERT_EQ(read.size(), written.size());
    for (std::size_t f = 0; f < read.size(); ++f) {
      EXPECT_EQ(read[f].renderer, written[f].renderer);
      EXPECT_EQ(read[f].grid, written[f].grid);
      EXPECT_EQ(read[f].workers, written[f].workers);
      EXPECT_EQ(read[f].display, written[f].display);
      EXPECT_EQ(read[f].combine, written[f].combine);
      EXPECT_NEAR(read[f].arrived, written[f].arrived, 1e-9);
      EXPECT_NEAR(read[f].end, written[f].end, 1e-9);
      EXPECT_NEAR(read[f].latency, written[f].latency, 1e-9);
      EXPECT_NEAR(read[f].picture_seconds, written[f].picture_seconds, 1e-9);
      EXPECT_EQ(read[f].image_bytes, written[f].image_bytes);
      ASSERT_EQ(read[f].groups.size(), written[f].groups.size());
      for (std::size_t g = 0; g < read[f].groups.size(); ++g) {
        ASSERT_EQ(read[f].groups[g].size(), written[f].groups[g].size());
        for (std::size_t rank = 0; rank < read[f].groups[g].size(); ++rank) {
          const RecordedRank &a = read[f].groups[g][rank], &b = written[f].groups[g][rank];
          EXPECT_EQ(a.box, b.box);
          EXPECT_EQ(a.worker, b.worker);
          EXPECT_NEAR(a.render_seconds, b.render_seconds, 1e-9);
          EXPECT_EQ(a.bounds, b.bounds);
          EXPECT_EQ(a.pixels, b.pixels);
        }
      }
    }
  }
}

TEST(Recording, WhatIsWrongIsNamed) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  const Json good = TraceOf(RandomRecording(random, 2, 3));
  ASSERT_TRUE(ParseRecording(good.dump()).ok());
  struct Case {
    const char* named;
    std::function<void(Json& recording, Json& frame, Json& rank)> spoil;
  };
  const std::vector<Case> cases = {
      {"version", [](Json& r, Json&, Json&) { r["version"] = 2; }},
      {"frames", [](Json& r, Json&, Json&) { r["frames"] = Json::array(); }},
      {"slabstream.frames", [](Json& r, Json&, Json&) { r.erase("frames"); }},
      {"frames[1]: 3 must be an object", [](Json&, Json& f, Json&) { f = 3; }},
      {"frames[1].renderer", [](Json&, Json& f, Json&) { f["renderer"] = "rays"; }},
      {"frames[1].grid",
       [](Json&, Json& f, Json&) {
         f["grid"] = {1, 2, 3};
       }},
      {"frames[1].grid",
       [](Json&, Json& f, Json&) {
         f["grid"] = {0, 0};
       }},
      {"frames[1].grid",
       [](Json&, Json& f, Json&) {
         f["grid"] = {1e9, 2};
       }},
      {"frames[1].workers", [](Json&, Json& f, Json&) { f["workers"] = 0; }},
      {"frames[1].display", [](Json&, Json& f, Json&) { f.erase("display"); }},
      {"frames[1].combine", [](Json&, Json& f, Json&) { f["combine"] = "stirring"; }},
      {"frames[1].latency_us", [](Json&, Json& f, Json&) { f["latency_us"] = -1; }},
      {"frames[1].groups", [](Json&, Json& f, Json&) { f["groups"] = Json::array(); }},
      {"groups[0]: 3 must be a list", [](Json&, Json& f, Json&) { f["groups"] = {3}; }},
      {"groups[0][1].box", [](Json&, Json&, Json& k) { k["box"] = "first"; }},
      {"groups[0][1].render_us", [](Json&, Json&, Json& k) { k["render_us"] = nullptr; }},
      {"groups[0][1].bounds",
       [](Json&, Json&, Json& k) {
         k["bounds"] = {0, 0, 100000, 1};
       }},
      {"groups[0][1].bounds",
       [](Json&, Json&, Json& k) {
         k["bounds"] = {0, 0, 0.5, 1};
       }},
      {"groups[0][1].pixels", [](Json&, Json&, Json& k) { k["pixels"] = 1e9; }},
  };
  for (const Case& c : cases) {
    Json spoilt = good;
    Json& recording = spoilt[kRecordingKey];
    Json& frame = recording["frames"][1];
    c.spoil(recording, frame, frame["groups"][0][1]);
    const auto parsed = ParseRecording(spoilt.dump());
    ASSERT_FALSE(parsed.ok()) << c.named;
    EXPECT_EQ(parsed.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(parsed.status().message(), HasSubstr(c.named));
  }
  for (const char* text : {"", "{", "[]", "3", "{\"traceEvents\":[]}", "{\"slabstream\":1}"})
    EXPECT_FALSE(ParseRecording(text).ok()) << text;
}

TEST(Recording, AnErrorIsOneLineHoweverTheFileIsMade) {
  const auto error_of = [](const std::string& frames) {
    return ParseRecording("{\"slabstream\": {\"version\": 1, \"frames\": " + frames + "}}").status().message();
  };
  // Values that nest as deep as the file is long: neither reading them nor writing them out may use up the stack.
  constexpr std::size_t kDepth = 1'000'000;
  const std::string deep = error_of("[" + std::string(kDepth, '[') + std::string(kDepth, ']') + "]");
  EXPECT_THAT(deep, HasSubstr("values nest more than 64 deep"));
  const std::string text = error_of("[\"" + std::string(100, '[') + "\\\"[\"]");
  EXPECT_THAT(text, HasSubstr("frames[0]: \"[[[")) << "brackets in a text are none";
  const std::string broken = error_of(R"([{"renderer": "splat", "grid": [4, 4], "workers": 1, "display": 1, "combine": "a\nb"}])");
  EXPECT_THAT(broken, HasSubstr("combine: 'a?b' is not one of"));
  EXPECT_EQ(broken.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace slabstream
