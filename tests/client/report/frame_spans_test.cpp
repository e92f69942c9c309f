#include "client/report/frame_spans.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "tests/client/report/frame_of_two.h"

namespace slabstream {
namespace {

using testing::ElementsAre;

std::vector<std::pair<std::int64_t, std::int64_t>> TimesOf(const FrameStatistics& statistics, std::uint32_t worker) {
  std::vector<std::pair<std::int64_t, std::int64_t>> times;
  for (const StageSpan& span : StageSpans(statistics)) {
    if (span.worker == worker) times.emplace_back((span.begin_ns - statistics.begin_ns) / kMs, (span.end_ns - statistics.begin_ns) / kMs);
  }
  return times;
}

TEST(StageSpansTest, KeepsTimesOfTheCoordinatorsHost) {
  const FrameStatistics frame = FrameAt(100 * kMs);
  EXPECT_THAT(TimesOf(frame, 4), ElementsAre(std::pair(-2, 1), std::pair(1, 9), std::pair(9, 10)));
  const std::vector<StageSpan> spans = StageSpans(frame);
  ASSERT_EQ(spans.size(), 6U);
  EXPECT_EQ(spans[4].worker, 5U);
  EXPECT_EQ(spans[4].rank, 1U);
  EXPECT_EQ(spans[4].box, 8U);
  EXPECT_EQ(spans[4].stage, Stage::kRender);
}

TEST(StageSpansTest, MovesThoseOfAHostWithAnotherClock) {
  for (const std::int64_t clock : {-90'000'000 * kMs, -5 * kMs, 25 * kMs, 40 * kMs, 90'000'000 * kMs}) {
    const FrameStatistics frame = FrameAt(100 * kMs, 0, clock);
    EXPECT_THAT(TimesOf(frame, 4), ElementsAre(std::pair(-2, 1), std::pair(1, 9), std::pair(9, 10))) << "is not moved";
    EXPECT_THAT(TimesOf(frame, 5), ElementsAre(std::pair(-3, 0), std::pair(0, 8), std::pair(8, 9))) << clock;
  }
}

}  // namespace
}  // namespace slabstream
