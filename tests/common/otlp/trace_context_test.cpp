#include "common/otlp/trace_context.h"

#include <gtest/gtest.h>

#include <set>

namespace slabstream {
namespace {

constexpr std::string_view kTrace = "4bf92f3577b34da6a3ce929d0e0e4736", kSpan = "00f067aa0ba902b7";

std::string Parent(std::string_view version, std::string_view flags, std::string_view more = "") {
  return std::string(version) + "-" + std::string(kTrace) + "-" + std::string(kSpan) + "-" + std::string(flags) + std::string(more);
}

TEST(TraceContextTest, ReadsTheHeaderOfACaller) {
  const auto parent = ParseTraceParent(Parent("00", "01"));
  ASSERT_TRUE(parent);
  EXPECT_EQ(Hex(parent->trace), kTrace);
  EXPECT_EQ(Hex(parent->span), kSpan);
  EXPECT_TRUE(parent->sampled);
  EXPECT_FALSE(ParseTraceParent(Parent("00", "00"))->sampled);
  EXPECT_TRUE(ParseTraceParent(Parent("00", "03"))->sampled) << "other flags may be there, too";
  EXPECT_FALSE(ParseTraceParent(Parent("00", "02"))->sampled);
}

TEST(TraceContextTest, LaterVersionsMaySayMore) {
  EXPECT_EQ(ParseTraceParent(Parent("01", "01", "-more")), ParseTraceParent(Parent("00", "01")));
  EXPECT_TRUE(ParseTraceParent(Parent("fe", "01")));
  EXPECT_FALSE(ParseTraceParent(Parent("00", "01", "-more")));
  EXPECT_FALSE(ParseTraceParent(Parent("01", "01", "more")));
}

TEST(TraceContextTest, IgnoresWhatIsNoHeader) {
  const std::string good = Parent("00", "01"), zeros(32, '0');
  for (std::size_t size = 0; size < good.size(); ++size) EXPECT_FALSE(ParseTraceParent(good.substr(0, size))) << size;
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (const char wrong : {'g', 'A', ' ', '\0', '_'}) {
      std::string text = good;
      text[at] = wrong;
      EXPECT_FALSE(ParseTraceParent(text)) << text;
    }
  }
  EXPECT_FALSE(ParseTraceParent(Parent("ff", "01")));
  EXPECT_FALSE(ParseTraceParent("00-" + zeros + "-" + std::string(kSpan) + "-01"));
  EXPECT_FALSE(ParseTraceParent("00-" + std::string(kTrace) + "-" + zeros.substr(16) + "-01"));
}

TEST(TraceContextTest, IdsDiffer) {
  std::set<SpanId> spans;
  std::set<TraceId> traces;
  for (int i = 0; i < 1000; ++i) {
    spans.insert(NewSpanId());
    traces.insert(NewTraceId());
  }
  EXPECT_EQ(spans.size(), 1000U);
  EXPECT_EQ(traces.size(), 1000U);
  EXPECT_FALSE(spans.contains(SpanId{}));
}

}  // namespace
}  // namespace slabstream
