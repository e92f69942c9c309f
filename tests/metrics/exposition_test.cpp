#include "common/metrics/exposition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "common/metrics/metrics_listener.h"
#include "common/metrics/snapshot.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

TEST(Exposition, WritesFamiliesAndTheirValues) {
  Exposition out;
  out.Single("frames_total", MetricType::kCounter, "Frames.", std::uint64_t{3});
  out.Family("workers", MetricType::kGauge, "Workers by state.");
  out.Value(std::uint64_t{2}, {{"state", "ready"}});
  out.Value(0.5, {{"state", "leaving"}, {"host", "a"}});
  EXPECT_EQ(out.Take(),
            "# HELP slabstream_frames_total Frames.\n# TYPE slabstream_frames_total counter\nslabstream_frames_total 3\n"
            "# HELP slabstream_workers Workers by state.\n# TYPE slabstream_workers gauge\nslabstream_workers{state=\"ready\"} 2\n"
            "slabstream_workers{state=\"leaving\",host=\"a\"} 0.5\n");
}

TEST(Exposition, EscapesLabels) {
  Exposition out;
  out.Family("x", MetricType::kGauge, "X.");
  out.Value(std::uint64_t{1}, {{"name", "a\"b\\c\nd"}});
  EXPECT_THAT(out.Take(), HasSubstr("slabstream_x{name=\"a\\\"b\\\\c\\nd\"} 1\n"));
}

TEST(Exposition, BucketsOfAHistogramAreCumulative) {
  TimeHistogram times;
  for (const int ms : {1, 3, 30, 20000}) times.Add(milliseconds(ms));
  Exposition out;
  out.Family("t_seconds", MetricType::kHistogram, "T.");
  out.Histogram(times, {{"stage", "s"}});
  const std::string text = out.Take();
  EXPECT_THAT(text, HasSubstr("slabstream_t_seconds_bucket{stage=\"s\",le=\"0.001\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("slabstream_t_seconds_bucket{stage=\"s\",le=\"0.005\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("slabstream_t_seconds_bucket{stage=\"s\",le=\"10\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("slabstream_t_seconds_bucket{stage=\"s\",le=\"+Inf\"} 4\n"));
  EXPECT_THAT(text, HasSubstr("slabstream_t_seconds_sum{stage=\"s\"} 20.034\nslabstream_t_seconds_count{stage=\"s\"} 4\n"));
}

TEST(Snapshot, AsksTheOtherThread) {
  Snapshot<int> snapshot;
  std::atomic<bool> awake = false;
  std::thread owner([&] {
    awake.wait(false);
    EXPECT_TRUE(snapshot.wanted());
    snapshot.Set(7);
  });
  const auto wake = [&] {
    awake = true;
    awake.notify_all();
  };
  EXPECT_EQ(snapshot.Get(wake), 7);
  EXPECT_FALSE(snapshot.wanted());
  owner.join();
}

TEST(Snapshot, GivesTheLastValueIfTheOtherThreadIsHeldUp) {
  Snapshot<int> snapshot;
  snapshot.Set(5);
  std::this_thread::sleep_for(milliseconds(60));
  EXPECT_EQ(snapshot.Get([] {}), 5);
}

TEST(MetricsAddress, IsAPortOrAnAddressWithOne) {
  const auto parsed = [](const char* text) { return ParseMetricsAddress("--metrics", text); };
  EXPECT_EQ(parsed("9464")->host, "127.0.0.1");
  EXPECT_EQ(parsed("9464")->port, 9464);
  EXPECT_TRUE(parsed("0")->loopback);
  EXPECT_EQ(parsed("192.168.1.7:80")->host, "192.168.1.7");
  EXPECT_FALSE(parsed("192.168.1.7:80")->loopback);
  EXPECT_FALSE(parsed("0.0.0.0:80")->loopback);
  EXPECT_EQ(parsed("[::1]:80")->host, "::1");
  EXPECT_TRUE(parsed("[::1]:80")->loopback);
  for (const char* text : {"", "x", "65536", "-1", "99999999999999999999", "127.0.0.1", "[::1]", "a.example:80", "127.0.0.1:x", ":80"}) {
    EXPECT_EQ(parsed(text).status().code(), StatusCode::kInvalidArgument) << text;
  }
}

}  // namespace
}  // namespace slabstream
