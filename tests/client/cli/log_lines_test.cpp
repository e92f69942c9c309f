#include "client/cli/log_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(LogLines, BeginWithTheirTime) {
  const std::pair<std::string, std::string> cases[] = {
      {"2026-11-22 10:00:00.123 I [coordinator] worker 1 is here", "2026-11-22 10:00:00.123"},
      {"2026-11-22 10:00:00.123", "2026-11-22 10:00:00.123"},
      {"2026-11-22 10:00:00,123 I", ""},
      {"2026-11-22 10:00:00.12", ""},
      {"slabstream-worker: no memory", ""},
      {"", ""},
  };
  for (const auto& [line, time] : cases) EXPECT_EQ(TimeOfLogLine(line), time) << line;
  const std::string then = LogTime(3600), now = LogTime(0);
  EXPECT_EQ(TimeOfLogLine(now + " I"), now);
  EXPECT_LT(then, now);
}

TEST(LogLines, AreMergedByTimeAndKeepTheirOrderWithinAFile) {
  const std::vector<std::string> coordinator = {"2026-11-21 23:59:59.900 a", "2026-11-22 00:00:00.100 c", "2026-11-22 00:00:00.100 d"};
  const std::vector<std::string> worker = {"before any time", "2026-11-22 00:00:00.000 b", "  goes with b", "2026-11-22 00:00:00.200 f",
                                           "2026-11-22 00:00:00.150 g: the clock was set back"};
  EXPECT_THAT(MergeLogLines({coordinator, worker}),
              ElementsAre("before any time", coordinator[0], worker[1], worker[2], coordinator[1], coordinator[2], worker[3], worker[4]));
  EXPECT_THAT(MergeLogLines({coordinator, worker}, "2026-11-22 00:00:00.100"),
              ElementsAre(coordinator[1], coordinator[2], worker[3], worker[4]));
  EXPECT_THAT(MergeLogLines({}), IsEmpty());
}

TEST(LogLines, OfAGrowingFileAreReadWhenTheyAreWhole) {
  const TemporaryDirectory directory;
  const std::string path = std::string(directory.path()) + "/a.log";
  LogFile file(path);
  EXPECT_THAT(file.ReadMore(), IsEmpty()) << "it is not there yet";
  std::ofstream out(path);
  out << "one\ntw" << std::flush;
  EXPECT_THAT(file.ReadMore(), ElementsAre("one"));
  EXPECT_THAT(file.ReadMore(), IsEmpty());
  out << "o\n\nthree\n" << std::flush;
  EXPECT_THAT(file.ReadMore(), ElementsAre("two", "", "three"));
  std::ofstream(path) << "new\n";  // it begins anew
  EXPECT_THAT(file.ReadMore(), ElementsAre("new"));
}

TEST(LogLines, AVeryLongLineDoesNotStopTheReader) {
  const TemporaryDirectory directory;
  const std::string path = std::string(directory.path()) + "/a.log";
  std::ofstream(path) << std::string(std::size_t{9} << 20, 'x') << "\nend\n";
  LogFile file(path);
  std::vector<std::string> all;
  for (std::vector<std::string> lines = file.ReadMore(); !lines.empty(); lines = file.ReadMore())
    all.insert(all.end(), lines.begin(), lines.end());
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.back(), "end");
}

}  // namespace
}  // namespace slabstream
