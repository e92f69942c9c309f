#include <gtest/gtest.h>

#include <map>
#include <set>

#include "client/cli/report_json.h"
#include "common/json/json.h"

namespace slabstream {
namespace {

// Two frames that overlap in time, by workers 4 and 5.
std::vector<FrameRecord> TwoFrames() {
  std::vector<FrameRecord> frames(2);
  for (std::size_t i = 0; i < 2; ++i) {
    FrameRecord& frame = frames[i];
    frame.output = "frame_" + std::to_string(i) + ".png";
    frame.latency = std::chrono::milliseconds(40);
    frame.statistics.workers = 2;
    frame.statistics.groups = 3;
    frame.statistics.attempts = 1;
    frame.statistics.renderer = "shear";
    frame.statistics.decomposition = "slab";
    frame.statistics.balance_by = "occupied";
    frame.statistics.axis = "z";
    frame.statistics.assignment = "greedy";
    frame.statistics.balance = "dynamic";
    frame.statistics.combine = "fan-in";
    frame.statistics.levels = {{1, 3, 4096}, {2, 1, 64}};
    frame.statistics.begin_ns = 5'000'000'000 + std::int64_t(i) * 10'000'000;
    frame.statistics.end_ns = frame.statistics.begin_ns + 30'000'000;
    for (std::uint32_t rank = 0; rank < 2; ++rank) {
      RankReport report;
      report.worker = 4 + rank;
      report.group = 1;
      report.rank = rank;
      report.stage_ns[std::size_t(Stage::kRender)] = 8'000'000;
      report.spans = {{Stage::kRender, frame.statistics.begin_ns, frame.statistics.begin_ns + 8'000'000},
                      {Stage::kCombine, frame.statistics.begin_ns + 8'000'000, frame.statistics.begin_ns + 9'000'000}};
      report.voxel_bytes = i == 0 ? 1000 : 0;
      report.stored_bytes = i == 0 ? 300 : 0;
      report.sent_bytes = i == 0 ? 250 : 0;
      report.image_bytes = 50;
      frame.statistics.reports.push_back(report);
    }
  }
  return frames;
}

TEST(StatsJsonTest, HasThePromisedFields) {
  const FrameOptions options;
  const Json stats = Json::Parse(StatsJson(options, TwoFrames())).value();
  EXPECT_EQ(stats["plan"], (Json{{"workers", 2},
                                 {"groups", 3},
                                 {"decomposition", "slab"},
                                 {"balance_by", "occupied"},
                                 {"axis", "z"},
                                 {"assignment", "greedy"},
                                 {"balance", "dynamic"},
                                 {"combine", "fan-in"}}));
  EXPECT_EQ(stats["renderer"], "shear") << "which the request left to the service";
  EXPECT_EQ(stats["bytes"], (Json{{"voxels", 2000}, {"stored", 600}, {"sent", 500}, {"images", 200}}));
  ASSERT_EQ(stats["frames"].size(), 2U);
  const Json& second = stats["frames"][1];
  EXPECT_EQ(second["latency_ms"], 40.0);
  EXPECT_EQ(second["bytes"]["voxels"], 0);
  EXPECT_EQ(second["levels"], Json::array({{{"level", 1}, {"boxes", 3}, {"voxels", 4096}}, {{"level", 2}, {"boxes", 1}, {"voxels", 64}}}));
  EXPECT_EQ(second["stages_ms"]["render"], 16.0);
  EXPECT_EQ(second["stages_ms"].size(), std::size_t(kStageCount));
  EXPECT_EQ(second["imbalance"], 1.0);
  EXPECT_NEAR(second["idle_share"].get<double>(), 1 - 18.0 / 60.0, 1e-12);
}

TEST(StatsJsonTest, TextThatIsNotUtf8DoesNotBreakIt) {
  FrameOptions options;
  options.source = "\xff\xfe.nii";
  EXPECT_TRUE(Json::Parse(StatsJson(options, TwoFrames())).ok());
}

TEST(TraceJsonTest, HasOneProcessAWorkerAndKeepsThreadsApart) {
  const Json trace = Json::Parse(TraceJson(TwoFrames())).value();
  std::map<std::pair<int, int>, std::set<std::string>> names;  // by process and thread
  std::set<int> named;
  for (const Json& event : trace["traceEvents"]) {
    if (event["ph"] == "M" && event["name"] == "process_name") named.insert(event["pid"].get<int>());
    if (event["ph"] != "X") continue;
    EXPECT_GE(event["ts"].get<double>(), 0.0);
    EXPECT_GT(event["dur"].get<double>(), 0.0);
    names[{event["pid"].get<int>(), event["tid"].get<int>()}].insert(event["name"].get<std::string>());
    if (event["pid"] != 0) {
      EXPECT_EQ(event["args"]["group"], 1);
    }
  }
  EXPECT_EQ(named, (std::set<int>{0, 4, 5}));
  for (const int worker : {4, 5}) {
    EXPECT_EQ((names[{worker, 1}]), std::set<std::string>{"render"});
    EXPECT_EQ((names[{worker, 2}]), std::set<std::string>{"combine"});
  }
  // The two frames were in flight together, so they stand in two tracks.
  EXPECT_EQ((names[{0, 1}]), std::set<std::string>{"frame 0"});
  EXPECT_EQ((names[{0, 2}]), std::set<std::string>{"frame 1"});
}

}  // namespace
}  // namespace slabstream
