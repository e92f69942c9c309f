#include "simulator/model/link_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulator/model/network.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(LinkModel, PresetsAreParsedByName) {
  for (const LinkPreset& preset : LinkPresets()) {
    const Result<LinkModel> link = ParseLink("--link", preset.name);
    ASSERT_TRUE(link.ok()) << preset.name;
    EXPECT_EQ(*link, preset.link);
    EXPECT_GT(link->bytes_per_second, 0);
  }
}

TEST(LinkModel, NumbersReplaceThoseOfThePreset) {
  const Result<LinkModel> link = ParseLink("--link", "bus:2.5,8");
  ASSERT_TRUE(link.ok());
  EXPECT_EQ(link->contention, Contention::kSharedBus);
  EXPECT_DOUBLE_EQ(link->latency_seconds, 2.5e-6);
  EXPECT_DOUBLE_EQ(link->bytes_per_second, 1e9);
}

TEST(LinkModel, WrongTextsAreNamed) {
  for (const char* text : {"", "ethernet", "10gbit:", "10gbit:1", "10gbit:1,", "10gbit:,1", "10gbit:-1,1", "10gbit:1,0", "10gbit:1,1e7",
                           "10gbit:1e7,1", "10gbit:nan,1", "10gbit:1,nan", "10gbit:1,2,3", "10gbit:1 ,2", "10gbit:inf,1"}) {
    const Result<LinkModel> link = ParseLink("--link", text);
    ASSERT_FALSE(link.ok()) << text;
    EXPECT_EQ(link.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(link.status().message(), AllOf(HasSubstr("--link"), HasSubstr(text)));
  }
}

// Messages of one size, all at once.
double TimeOf(const LinkModel& link, std::uint32_t ends, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& messages) {
  Network network(link, ends);
  double end = 0;
  for (const auto& [from, to] : messages) end = std::max(end, network.Send(from, to, 100, 0).end);
  return end;
}

TEST(Network, MessagesWaitWhereTheirWiresMeet) {
  const auto link = [](Contention contention) { return LinkModel{contention, 0.5, 100, 2, 2}; };  // a message takes 1 s, and half to arrive
  const std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs = {{0, 1}, {2, 3}}, gather = {{1, 0}, {2, 0}, {3, 0}},
                                                             scatter = {{0, 1}, {0, 2}, {0, 3}}, across = {{0, 2}, {1, 3}};
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kNone), 4, gather), 1.5);
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kSharedBus), 4, pairs), 2.5);
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kSharedBus), 4, gather), 3.5);
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kSwitched), 4, pairs), 1.5);
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kSwitched), 4, gather), 3.5);
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kSwitched), 4, scatter), 3.5);
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kSwitched), 4, across), 1.5);
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kFatTree), 4, pairs), 1.5);   // within the groups {0, 1} and {2, 3}
  EXPECT_DOUBLE_EQ(TimeOf(link(Contention::kFatTree), 4, across), 2.5);  // both through an uplink that is as fast as one end
}

TEST(Network, NoWireCarriesTwoMessagesAtATime) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (const Contention contention : {Contention::kSharedBus, Contention::kSwitched, Contention::kFatTree}) {
    Network network({contention, 1e-3, 1000, 3, 4}, 10);
    double now = 0, bytes_to_0 = 0, last = 0;
    for (int i = 0; i < 200; ++i) {
      now += random.Real(0, 0.05);
      const auto from = random.Integer<std::uint32_t>(1, 9);
      const double bytes = random.Real(0, 100);
      const Network::Passage passage = network.Send(from, 0, bytes, now);
      EXPECT_GE(passage.begin, now);
      EXPECT_GE(passage.end - passage.begin, bytes / 1000);
      bytes_to_0 += bytes;
      last = std::max(last, passage.end);
    }
    EXPECT_GE(last, bytes_to_0 / 1000);
  }
}

}  // namespace
}  // namespace slabstream
