#include "client/report/frame_summary.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

RankReport Report(std::uint32_t worker, std::int64_t render_ns, std::vector<Span> spans) {
  RankReport report;
  report.worker = worker;
  report.stage_ns[std::size_t(Stage::kRender)] = render_ns;
  report.spans = std::move(spans);
  report.voxel_bytes = 100;
  report.image_bytes = 10;
  return report;
}

TEST(FrameSummaryTest, AFrameWithoutReportsIsBalancedAndIdle) {
  FrameStatistics statistics;
  statistics.workers = 2;
  statistics.end_ns = 1000;
  const FrameSummary summary = Summarize(statistics);
  EXPECT_EQ(summary.imbalance, 1);
  EXPECT_EQ(summary.idle_share, 1);
  EXPECT_EQ(summary.voxel_bytes, 0U);
}

TEST(FrameSummaryTest, ImbalanceIsMostOverMeanOfAllWorkers) {
  FrameStatistics statistics;
  statistics.workers = 4;  // one of them has nothing to render
  statistics.reports = {Report(1, 100, {}), Report(2, 200, {}), Report(3, 200, {}), Report(3, 300, {})};
  const FrameSummary summary = Summarize(statistics);
  EXPECT_DOUBLE_EQ(summary.imbalance, 500.0 / (800.0 / 4));
  EXPECT_EQ(summary.stage_ns[std::size_t(Stage::kRender)], 800);
  EXPECT_EQ(summary.voxel_bytes, 400U);
  EXPECT_EQ(summary.image_bytes, 40U);
}

TEST(FrameSummaryTest, MakingThePictureIsNoCombining) {
  FrameStatistics statistics;
  statistics.workers = 2;
  statistics.reports = {Report(1, 70, {{Stage::kEncode, 0, 5}}),
                        Report(2, 90, {{Stage::kCombine, 0, 30}, {Stage::kResolve, 30, 50}, {Stage::kEncode, 50, 60}})};
  statistics.reports[0].stage_ns[std::size_t(Stage::kEncode)] = 5;
  statistics.reports[1].stage_ns[std::size_t(Stage::kCombine)] = 30;
  statistics.reports[1].stage_ns[std::size_t(Stage::kResolve)] = 20;
  statistics.reports[1].stage_ns[std::size_t(Stage::kEncode)] = 10;
  const FrameSummary summary = Summarize(statistics);
  EXPECT_EQ(summary.render_ns, 90);
  EXPECT_EQ(summary.finish_ns, 30);
  EXPECT_EQ(summary.combine_ns, 35);
}

TEST(FrameSummaryTest, IdleShareCountsOverlappingWorkOnceAndWaitingNotAtAll) {
  FrameStatistics statistics;
  statistics.workers = 2;
  statistics.begin_ns = 1000;
  statistics.end_ns = 2000;
  statistics.reports = {
      // Busy 1000 ... 1500: what began before the frame, nested and overlapping spans count once.
      Report(1, 0, {{Stage::kRender, 900, 1400}, {Stage::kShade, 1100, 1200}, {Stage::kCombine, 1300, 1500}}),
      // Busy 1900 ... 2000; fetching is waiting.
      Report(2, 0, {{Stage::kFetch, 1000, 1900}, {Stage::kRender, 1900, 2100}}),
  };
  EXPECT_DOUBLE_EQ(Summarize(statistics).idle_share, 1 - (500.0 + 100.0) / 2000.0);
}

}  // namespace
}  // namespace slabstream
