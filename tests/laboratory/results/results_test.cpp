// Results: what is written can be read, and the document names every column and metric.
#include "laboratory/results/results.h"

#include <gmock/gmock.h>

#include <regex>

#include "common/files/files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using ::testing::HasSubstr;

Results Some() {
  Results results({"streaming", "c0ffee", "a machine, 2 cores"});
  results.Add({{"volume", "say \"ball\", twice"}, {"workers", 2}}, "latency", Estimate{0.5, 0.4, 0.7, 0.9, 3}, Origin::kMeasured);
  results.Add({{"volume", "ball"}}, "memory", 12.0, Origin::kPaper);
  results.Add({{"volume", "ball"}}, "latency", std::vector{0.5, 0.25, 1.0}, Origin::kSimulated);
  results.Add({{"volume", "nothing"}}, "memory", std::numeric_limits<double>::quiet_NaN(), Origin::kMeasured);
  return results;
}

TEST(Results, RowsHoldCaseValueAndWhoFoundIt) {
  const Results results = Some();
  ASSERT_EQ(results.rows().size(), 3U) << "what is not a number is left out";
  const Json& row = results.rows().front();
  EXPECT_EQ(row["experiment"], "streaming");
  EXPECT_EQ(row["workers"], 2);
  EXPECT_EQ(row["unit"], "s");
  EXPECT_EQ(row["repeats"], 3);
  EXPECT_EQ(row["noise"], "wide");
  EXPECT_EQ(row["origin"], "measured");
  EXPECT_FALSE(row.contains("each")) << "only the interval was given";
  EXPECT_EQ(results.rows()[1]["repeats"], 0);
  EXPECT_FALSE(results.rows()[1].contains("each"));
}

TEST(Results, RepeatsStandInTheirOrderBesideTheirMedian) {
  const Json row = Some().rows().back();
  EXPECT_EQ(row["value"], 0.5);
  EXPECT_EQ(row["low"], 0.25);
  EXPECT_EQ(row["high"], 1.0);
  EXPECT_EQ(row["repeats"], 3);
  EXPECT_EQ(row["each"], Json({0.5, 0.25, 1.0})) << "repeat i of two cases is a pair";
}

TEST(Results, FilesHoldTheSameRows) {
  const TemporaryDirectory folder;
  Results results = Some();
  results.Attach("boxes", {{{"box", 1}, {"seconds", 0.5}}});
  ASSERT_TRUE(results.Write(folder.path()).ok());
  const std::string csv = ReadTextFile(folder.path() + "/results.csv", 1 << 20).value();
  EXPECT_THAT(csv, HasSubstr("1,streaming,,\"say \"\"ball\"\", twice\","));
  EXPECT_THAT(csv, HasSubstr("latency,s,0.5,0.4,0.7,3,wide,measured,c0ffee,\"a machine, 2 cores\",\n"));
  EXPECT_THAT(csv, HasSubstr("simulated,c0ffee,\"a machine, 2 cores\",0.5 0.25 1.0\n"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  const std::string lines = ReadTextFile(folder.path() + "/results.jsonl", 1 << 20).value();
  EXPECT_EQ(Json::Parse(lines.substr(0, lines.find('\n'))).value(), results.rows().front());
  EXPECT_EQ(ReadTextFile(folder.path() + "/boxes.csv", 1 << 20).value(), "box,seconds\n1,0.5\n");
}

TEST(ResultsDeathTest, UnknownNamesAndSecondValuesAreMistakes) {
  Results results = Some();
  EXPECT_DEATH(results.Add({{"colour", "red"}}, "memory", 1.0, Origin::kMeasured), "colour");
  EXPECT_DEATH(results.Add({{"volume", "x"}}, "beauty", 1.0, Origin::kMeasured), "beauty");
  EXPECT_DEATH(results.Add({{"volume", "ball"}}, "memory", 13.0, Origin::kPaper), "memory");
}

TEST(Results, TheDocumentNamesEveryColumnAndMetric) {
  const std::string document = ReadTextFile(SLABSTREAM_SOURCE_DIRECTORY "/docs/reference/results.md", 1 << 20).value();
  std::vector<std::string> listed, known;
  const std::regex row("\\| `([a-z_]+)` \\| ([^\\n]*) \\|\\n");
  for (std::sregex_iterator i(document.begin(), document.end(), row); i != std::sregex_iterator(); ++i) {
    listed.push_back((*i)[1].str() + ": " + (*i)[2].str());
  }
  for (const auto& columns : {RunColumns(), CaseColumns(), ValueColumns()}) {
    for (const Column& column : columns) known.push_back(std::string(column.name) + ": " + std::string(column.meaning));
  }
  for (const Metric& metric : Metrics()) {
    known.push_back(std::string(metric.name) + ": " + std::string(metric.unit) + " | " + std::string(metric.meaning));
  }
  EXPECT_EQ(listed, known);
}

TEST(Estimate, TellsTwoHeaps) {
  EXPECT_TRUE(MedianOf({1, 1.01, 1.02, 2, 2.02, 2.01}).two_modes);
  EXPECT_FALSE(MedianOf({1, 1.1, 1.2, 1.3, 1.4, 1.5}).two_modes);
  EXPECT_FALSE(MedianOf({1, 1, 1, 1, 1, 9}).two_modes) << "one outlier is no heap";
  EXPECT_FALSE(MedianOf({1, 2}).two_modes);
  EXPECT_FALSE(MedianOf({1, 1, 1.05, 1.05}).two_modes) << "heaps as near as a twentieth are one";
}

}  // namespace
}  // namespace slabstream
