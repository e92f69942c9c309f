#include "laboratory/bench/bench_report.h"
#include "common/json/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

TEST(Spread, OfKnownValues) {
  const Spread odd = SpreadOf({30, 10, 20});
  EXPECT_EQ(odd.count, 3);
  EXPECT_EQ(odd.median, 20);
  EXPECT_EQ(odd.min, 10);
  EXPECT_EQ(odd.max, 30);
  EXPECT_EQ(SpreadOf({1, 2, 3, 10}).median, 2.5);
  EXPECT_EQ(SpreadOf({7}).p05, 7);
  EXPECT_EQ(SpreadOf({7}).p95, 7);
  EXPECT_EQ(SpreadOf({}).count, 0);

  std::vector<double> hundred;
  for (int i = 100; i >= 1; --i) hundred.push_back(i);
  EXPECT_EQ(SpreadOf(hundred).p05, 5);
  EXPECT_EQ(SpreadOf(hundred).p95, 95);
}

TEST(Spread, IsOrderedAndForgetsTheOrderOfItsValues) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (int repeat = 0; repeat < 200; ++repeat) {
    std::vector<double> values(std::size_t(random.Integer(1, 60)));
    for (double& value : values) value = random.Real(0, 100);
    const Spread spread = SpreadOf(values);
    EXPECT_LE(spread.min, spread.p05);
    EXPECT_LE(spread.p05, spread.median);
    EXPECT_LE(spread.median, spread.p95);
    EXPECT_LE(spread.p95, spread.max);
    std::reverse(values.begin(), values.end());
    EXPECT_EQ(SpreadOf(values).median, spread.median);
  }
}

// Three orthographic frames and two under perspective; frame i takes 10 (i + 1) ms, of which a tenth is splatting.
BenchResult FiveFrames() {
  std::vector<FrameJob> jobs(5);
  std::vector<FrameRecord> records(5);
  for (std::size_t i = 0; i < 5; ++i) {
    jobs[i].request.view = BenchView(i < 3 ? Projection::kOrthographic : Projection::kPerspective, 0, 12);
    records[i].latency = std::chrono::milliseconds(10 * (i + 1));
    RankReport report;
    report.stage_ns[std::size_t(Stage::kSplat)] = std::int64_t(i + 1) * 1'000'000;
    records[i].statistics.reports = {report};
  }
  BenchResult result;
  result.bench_case = StandardBenchCases().front();
  result.description.geometry.size = {4, 5, 6};
  result.first_frame_ms = 99;
  result.peak_rss_bytes = 3 << 20;
  SetFrames(result, jobs, records);
  return result;
}

BenchRun EmbeddedRun() {
  BenchRun run{{"a processor", "AVX2", 2}, {}};
  run.options.connection.local_workers = 2;
  run.options.command = "slabstream bench class1-256";
  return run;
}

TEST(BenchReport, JsonHasThePromisedFields) {
  BenchResult skipped;
  skipped.bench_case = StandardBenchCases().back();
  skipped.skipped = "no file";
  const Json report = Json::Parse(BenchJson(EmbeddedRun(), {FiveFrames(), skipped})).value();
  EXPECT_EQ(report["machine"], (Json{{"cpu", "a processor"}, {"cores", 2}, {"simd", "AVX2"}}));
  EXPECT_EQ(report["command"], "slabstream bench class1-256");
  EXPECT_EQ(report["size"], 512);
  EXPECT_EQ(report["workers"], 2);
  EXPECT_NE(report["version"], "");
  ASSERT_EQ(report["cases"].size(), 2U);

  const Json& first = report["cases"][0];
  EXPECT_EQ(first["case"], "class1-256");
  EXPECT_EQ(first["volume"]["size"], (Json{4, 5, 6}));
  EXPECT_EQ(first["volume"]["raw_bytes"], 120);
  EXPECT_EQ(first["renderer"], "splat");
  EXPECT_EQ(first["opacity"], 0.05);
  EXPECT_EQ(first["first_frame_ms"], 99);
  EXPECT_EQ(first["latency_ms"]["orthographic"]["median"], 20);
  EXPECT_EQ(first["latency_ms"]["perspective"]["all"], (Json{40, 50}));
  EXPECT_EQ(first["latency_ms"]["both"]["frames"], 5);
  EXPECT_EQ(first["latency_ms"]["both"]["median"], 30);
  EXPECT_EQ(first["stage_median_ms"]["splat"], 3);
  EXPECT_EQ(first["stage_median_ms"].size(), std::size_t(kStageCount));
  EXPECT_EQ(first["peak_rss_bytes"], 3 << 20);
  EXPECT_EQ(report["cases"][1], (Json{{"case", "brain"}, {"skipped", "no file"}}));
}

TEST(BenchReport, RowsStandUnderTheirHeader) {
  const std::string header = BenchHeader(EmbeddedRun(), 20), row = BenchRow(FiveFrames(), 20);
  EXPECT_THAT(header, HasSubstr("2 cores, a processor, AVX2"));
  const std::string columns = header.substr(header.rfind('\n', header.size() - 2) + 1);
  EXPECT_EQ(columns.size(), row.size());
  for (const char* part : {"class1-256 ", "4x5x6", "splat", " 20.00 ", " 45.00 ", " 30.00 ", " 99.0 ", " 3.0"})
    EXPECT_THAT(row, HasSubstr(part));
}

TEST(BenchMachine, IsKnown) {
  const MachineInfo machine = DescribeMachine();
  EXPECT_GE(machine.cores, 1);
  EXPECT_NE(machine.simd, "");
  EXPECT_THAT(machine.kernel, testing::StartsWith("Linux "));
  EXPECT_THAT(machine.compiler, testing::AnyOf(HasSubstr("GCC "), HasSubstr("lang ")));
  EXPECT_NE(machine.flags, "");
  EXPECT_GE(machine.load, 0);
}

TEST(BenchMachine, PeakMemoryGrowsWithWhatIsTouched) {
  ResetPeakMemory();
  const std::int64_t before = PeakMemoryBytes();
  constexpr std::size_t kBytes = std::size_t{64} << 20;
  {
    const std::vector<char> touched(kBytes, 'x');
    EXPECT_EQ(touched[kBytes / 2], 'x');
  }
  EXPECT_GE(PeakMemoryBytes(), before + std::int64_t(kBytes / 2));
}

}  // namespace
}  // namespace slabstream
