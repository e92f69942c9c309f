// Charts are well-formed XML whatever they are given, keep texts as texts, and put everything that they draw inside the drawing.
#include "laboratory/report/charts.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <regex>
#include <set>

#include "laboratory/report/document.h"
#include "laboratory/report/svg.h"
#include "laboratory/report/text.h"
#include "tests/support/random.h"
#include "tests/support/well_formed.h"

namespace slabstream {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
const std::string kNasty = "<a href=\"x\">'&'</a>\x01";

// Of every x, y, cx, cy, x1, ... in the drawing.
void ExpectInside(const std::string& svg) {
  std::smatch size;
  ASSERT_TRUE(std::regex_search(svg, size, std::regex("viewBox=\"0 0 ([0-9]+) ([0-9]+)\"")));
  const double width = std::stod(size[1]), height = std::stod(size[2]);
  const std::regex place(" (x|cx|x1|x2|y|cy|y1|y2)=\"([^\"]*)\"");
  for (auto match = std::sregex_iterator(svg.begin(), svg.end(), place); match != std::sregex_iterator(); ++match) {
    const double value = std::stod((*match)[2]);
    EXPECT_GE(value, -1) << match->str();
    EXPECT_LE(value, ((*match)[1].str()[0] == 'x' || (*match)[1] == "cx" ? width : height) + 1) << match->str();
  }
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf\"")));
}

void ExpectGood(const std::string& svg) {
  EXPECT_EQ(WhyNotWellFormed(svg), "") << svg;
  EXPECT_THAT(svg, Not(HasSubstr("<a href")));
  ExpectInside(svg);
}

TEST(WellFormed, FindsWhatIsWrong) {
  EXPECT_EQ(WhyNotWellFormed("<a b=\"1\"><c/>x &amp; y</a>\n"), "");
  for (const char* wrong :
       {"<a>", "<a></b>", "<a b=1/>", "<a>&</a>", "<a b=\"&\"/>", "<a/><b/>", "x<a/>", "<a b=\"1\" b=\"2\"/>", "<a b=\"<\"/>", ""})
    EXPECT_NE(WhyNotWellFormed(wrong), "") << wrong;
}

TEST(Charts, LinesWithAnyValues) {
  ExpectGood(DrawLines({kNasty, {kNasty, kNasty}, {kNasty, kNasty}, {}}));
  for (const AxisScale scale : {AxisScale::kLinear, AxisScale::kLog}) {
    LineChart chart{kNasty, {"x", "", scale}, {"y", "s", scale}, {}};
    for (const Origin origin : kOrigins) {
      chart.series.push_back({kNasty, origin, {{0, 0}, {1, 5, 4, 6}, {2, kNan}, {3, kInfinity}, {4, -1}, {1000, 1e6}}});
    }
    chart.series.push_back({"empty", Origin::kMeasured, {}});
    chart.series.push_back({"one point", Origin::kMeasured, {{3, 3}}});
    ExpectGood(DrawLines(chart));
  }
}

TEST(Charts, OriginsAreToldApartByStrokeAndInWords) {
  LineChart chart{"t", {"x", ""}, {"y", ""}, {}};
  for (const Origin origin : kOrigins) chart.series.push_back({"a", origin, {{1, 1}, {2, 2}}});
  const std::string svg = DrawLines(chart);
  for (const char* words : {"measured here", "simulated", "from the paper", "curve measured", "curve simulated", "curve paper"}) {
    EXPECT_THAT(svg, HasSubstr(words));
  }
  chart.series.resize(1);
  EXPECT_THAT(DrawLines(chart), Not(HasSubstr("from the paper"))) << "only what occurs is explained";
}

// The path that draws a marker, without its place.
std::set<std::string> MarkersOf(const std::string& svg) {
  std::set<std::string> markers;
  const std::regex marker("<path class=\"(c[0-9])[^\"]*\" d=\"M[0-9.-]+ [0-9.-]+(m[^\"]*)\"");
  for (auto match = std::sregex_iterator(svg.begin(), svg.end(), marker); match != std::sregex_iterator(); ++match)
    markers.insert((*match)[2]);
  return markers;
}

TEST(Charts, SeriesAreToldApartByMarkerToo) {
  LineChart chart{"t", {"x", ""}, {"y", ""}, {}};
  for (int i = 0; i < kPaletteSize; ++i) chart.series.push_back({fmt::format("series {}", i), Origin::kMeasured, {{1, 1}, {2, double(i)}}});
  EXPECT_EQ(MarkersOf(DrawLines(chart)).size(), std::size_t(kPaletteSize));
}

TEST(Charts, WhatDataIsComparedWithIsNoData) {
  LineChart chart{
      "t", {"x", ""}, {"y", ""}, {{"data", Origin::kSimulated, {{1, 1}, {2, 3}}}, {"ideal", Origin::kMeasured, {{1, 1}, {2, 2}}, true}}};
  const std::string svg = DrawLines(chart);
  EXPECT_THAT(svg, HasSubstr(">ideal</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("measured here")));
  EXPECT_THAT(svg, Not(HasSubstr("curve measured")));
}

TEST(Charts, PlainBarsAreNamedByTheLegend) {
  const std::string svg = DrawBars({"t",
                                    "g",
                                    {"y", ""},
                                    {},
                                    {{"1", {{"one", Origin::kMeasured, {1}}, {"two", Origin::kMeasured, {2}}}},
                                     {"2", {{"one", Origin::kMeasured, {3}}, {"two", Origin::kMeasured, {4}}}}}});
  ExpectGood(svg);
  const auto count = [&](const std::string& what) {
    std::size_t found = 0;
    for (std::size_t at = svg.find(what); at != std::string::npos; at = svg.find(what, at + 1)) ++found;
    return found;
  };
  for (const char* name : {"one", "two"}) EXPECT_EQ(count(fmt::format(">{}</text>", name)), 1U);
  EXPECT_EQ(count("class=\"c0 bar"), 3U) << "two and the legend's";
  EXPECT_EQ(count("class=\"c1 bar"), 3U);
}

TEST(Charts, BarsGanttAndHeatMap) {
  ExpectGood(DrawBars({kNasty, kNasty, {kNasty, "%"}, {}, {}}));
  ExpectGood(DrawBars({kNasty,
                       kNasty,
                       {"share", "%"},
                       {"a", kNasty},
                       {{"1", {{kNasty, Origin::kMeasured, {0, 0}}, {"p", Origin::kPaper, {30, 70}}}}, {"2", {}}}}));
  ExpectGood(DrawGantt({kNasty, {kNasty}, {}}));
  ExpectGood(DrawGantt({kNasty, {"a", "b"}, {{kNasty, {{0, 1, 0, kNasty, kNasty}, {1, 1, 1, "", ""}}}, {"empty", {}}}}));
  ExpectGood(DrawHeatMap({kNasty, kNasty, {}}));
  ExpectGood(DrawHeatMap({kNasty, "ms", {{"cut", "x", "y", 10, 5, {{0, 0, 10, 5, 0, ""}, {2, 2, 3, 3, 7, kNasty}}}}}));
}

TEST(ChartAxis, CoversItsValuesAndHasAFewMarks) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int repeat = 0; repeat < 500; ++repeat) {
    const AxisScale scale = random.Chance(0.5) ? AxisScale::kLog : AxisScale::kLinear;
    std::vector<double> values(std::size_t(random.Integer(1, 9)));
    const double decades = random.Real(0, 9);
    for (double& value : values)
      value = std::pow(10, random.Real(-decades, decades)) * (scale == AxisScale::kLinear && random.Chance(0.3) ? -1 : 1);
    const ChartAxis axis({"v", "", scale, random.Chance(0.3)}, values);
    EXPECT_GE(axis.marks().size(), 2U);
    EXPECT_LE(axis.marks().size(), 13U);
    EXPECT_TRUE(std::is_sorted(axis.marks().begin(), axis.marks().end()));
    std::sort(values.begin(), values.end());
    double before = 0;
    for (const double value : values) {
      EXPECT_GE(axis.At(value), before) << "monotonic";
      before = axis.At(value);
    }
    // Nothing is clamped: the marks at the ends enclose all values, up to what nobody could see.
    const double unseen = scale == AxisScale::kLog ? 0 : 1e-6 * (axis.marks().back() - axis.marks().front());
    EXPECT_LE(axis.marks().front(), values.front() * (1 + (values.front() < 0 ? -1e-6 : 1e-6)) + unseen);
    EXPECT_GE(axis.marks().back(), values.back() * (1 - (values.back() < 0 ? -1e-6 : 1e-6)) - unseen);
  }
}

TEST(ChartAxis, MarksMayStandAtTheValues) {
  for (const AxisScale scale : {AxisScale::kLog, AxisScale::kLinear}) {
    AxisSpec spec{"p", "", scale};
    spec.at_values = true;
    const ChartAxis axis(spec, {2, 16, 5, 16, 1024});
    EXPECT_THAT(axis.marks(), testing::ElementsAre(2, 5, 16, 1024));
    EXPECT_EQ(axis.At(2), 0);
    EXPECT_EQ(axis.At(1024), 1);
    std::vector<double> many(100);
    std::iota(many.begin(), many.end(), 1);
    EXPECT_LE(ChartAxis(spec, many).marks().size(), 13U) << "not at that many";
    EXPECT_GE(ChartAxis(spec, {3, 3}).marks().size(), 2U) << "one value makes no axis";
  }
}

TEST(Text, NumbersAndEscapes) {
  EXPECT_EQ(FormatNumber(0), "0");
  EXPECT_EQ(FormatNumber(12.3), "12.3");
  EXPECT_EQ(FormatNumber(0.0123456), "0.01235");
  EXPECT_EQ(FormatNumber(45678.4), "45678");
  EXPECT_EQ(FormatNumber(1.25e9), "1.25e+09");
  EXPECT_EQ(FormatNumber(kNan), "–");
  EXPECT_EQ(FormatAbout(16357), "16000");
  EXPECT_EQ(FormatAbout(0.01251), "0.013");
  EXPECT_EQ(FormatAbout(0), "0");
  EXPECT_EQ(FormatSpeed(2.14), "2.1 times as fast");
  EXPECT_EQ(FormatSpeed(0.8), "1.2 times as slow");
  EXPECT_EQ(FormatSpeed(1.01), "as fast");
  EXPECT_EQ(FormatSpeed(0.99), "as fast");
  EXPECT_EQ(Escape("a<b & \"c\" 'd'"), "a&lt;b &amp; &quot;c&quot; &#39;d&#39;");
  EXPECT_EQ(Slug("Figure 10a: N³, p"), "figure-10a-n-p");
  EXPECT_EQ(Slug("..."), "a");
}

TEST(Report, PageIsWellFormedAndSelfContained) {
  Report report{kNasty, kNasty, {}};
  for (int i = 0; i < 4; ++i) {
    report.sections.push_back(
        {kNasty + std::to_string(i),
         kNasty,
         kNasty,
         kNasty,
         {Figure{fmt::format("f{}", i), DrawLines({"t", {"x", ""}, {"y", ""}, {}}), kNasty},
          Table{fmt::format("t{}", i), kNasty, {kNasty}, {{kNasty}, {FromPaper(1)}, {Cell()}}}, Photo{"\x89PNG", kNasty}}});
  }
  const std::string page = ReportHtml(report, {kNasty, kNasty, kNasty, kNasty, kNasty, kNasty, 2, 1, 1, kNasty});
  EXPECT_EQ(WhyNotWellFormed(page), "");
  for (const char* loads : {"<script", "<link", "@import", "url(", "src=\"http", "href=\"http"}) EXPECT_THAT(page, Not(HasSubstr(loads)));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORw=="));
}

}  // namespace
}  // namespace slabstream
