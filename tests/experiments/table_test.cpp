#include "laboratory/report/table.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "laboratory/report/base64.h"
#include "tests/support/well_formed.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

Table Example() {
  const Estimate e = MedianOf({1, 2, 3});
  return {"t", "A table", {"what", "time (ms)", "N"}, {{"a, \"b\"", Measured(e), Chosen(7)}, {"c", FromPaper(0.1), {}}}};
}

TEST(Table, CsvTellsIntervalAndOrigin) {
  EXPECT_EQ(TableCsv(Example()),
            "what,time (ms),time low,time high,time origin,N\r\n"
            "\"a, \"\"b\"\"\",2,1,3,measured,7\r\n"
            "c,0.1,,,paper,\r\n");
}

TEST(Table, JsonTellsThemToo) {
  const auto json = TableJson(Example());
  EXPECT_EQ(json["columns"][1]["unit"], "ms");
  EXPECT_EQ(json["rows"][0]["time"], (nlohmann::ordered_json{{"value", 2.0}, {"origin", "measured"}, {"low", 1.0}, {"high", 3.0}}));
  EXPECT_EQ(json["rows"][0]["N"], 7.0);
  EXPECT_TRUE(json["rows"][1]["N"].is_null());
}

TEST(Table, PageHoldsTheCsv) {
  const std::string html = TableHtml(Example()), before = "href=\"data:text/csv;charset=utf-8;base64,";
  const std::size_t begin = html.find(before);
  ASSERT_NE(begin, std::string::npos);
  EXPECT_EQ(html.compare(begin + before.size(), Base64(TableCsv(Example())).size(), Base64(TableCsv(Example()))), 0);
  EXPECT_THAT(html, HasSubstr("download=\"t.csv\""));
}

TEST(Table, LongOnesAreFolded) {
  Table table = Example();
  EXPECT_THAT(TableHtml(table), testing::Not(HasSubstr("<details>")));
  table.rows.resize(500, table.rows.front());
  EXPECT_EQ(WhyNotWellFormed(TableHtml(table)), "");
  EXPECT_THAT(TableHtml(table), HasSubstr("<details><summary>A table (500 rows)</summary>"));
}

TEST(Table, HtmlTellsThemInWords) {
  const std::string html = TableHtml(Example());
  EXPECT_EQ(WhyNotWellFormed(html), "");
  for (const char* part : {"(1 … 3)", "class=\"measured\"", "class=\"paper\"", "grey: from the paper"}) EXPECT_THAT(html, HasSubstr(part));
}

}  // namespace
}  // namespace slabstream
