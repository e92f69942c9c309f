// What is chosen where a policy leaves a choice.
#include "coordinator/tuning/choose_policy.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/policy_names.h"
#include "coordinator/tuning/service_machine.h"
#include "tests/common/planning/support.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

struct NamedSummary {
  std::string name;
  VolumeSummary summary;
};

// SomeRequest() shows what is above 100.
VolumeSummary SummaryWith(const Index3& size, auto&& shows) {
  VolumeSummary summary = FullSummary(size);
  std::size_t brick = 0;
  for (Index3 b; b.z < summary.brick_counts.z; ++b.z) {
    for (b.y = 0; b.y < summary.brick_counts.y; ++b.y) {
      for (b.x = 0; b.x < summary.brick_counts.x; ++b.x) summary.bricks[brick++] = shows(b) ? ValueRange{0, 255} : ValueRange{0, 50};
    }
  }
  return summary;
}

std::vector<NamedSummary> OddVolumes() {
  return {{"all occupied", FullSummary({48, 56, 40})},
          {"empty", SummaryWith({48, 48, 48}, [](const Index3&) { return false; })},
          {"one voxel thick", FullSummary({70, 1, 33})},
          {"one voxel", FullSummary({1, 1, 1})},
          {"a corner", SummaryWith({96, 96, 96}, [](const Index3& b) { return b.x + b.y + b.z < 3; })}};
}

Policy Automatic() {
  Policy policy;
  policy.decomposition = policy.balance_by = policy.assignment = policy.combine = kAutomatic;
  return policy;
}

struct Question {
  FrameRequest request = SomeRequest();
  VolumeSummary summary;
  MachineModel machine = ServiceMachine({}, {});
  std::int64_t box_bytes_target = kBoxBytesTarget;
  std::uint32_t slots = 1;

  PolicyChoice Choose(const Policy& policy, const ResolvedPolicy* now = nullptr, double least_gain = 0) const {
    const ResolvedRequest resolved = Resolved(request, summary);
    const FrameSetup setup = MakeFrameSetup(resolved).value();
    return ChoosePolicy({.open = &policy,
                         .resolved = &resolved,
                         .setup = &setup,
                         .slots = slots,
                         .machine = &machine,
                         .box_bytes_target = box_bytes_target,
                         .now = now,
                         .least_gain = least_gain});
  }
};

bool SameChoice(const PolicyChoice& a, const PolicyChoice& b) {
  return a.policy == b.policy && a.prediction == b.prediction && a.predicted == b.predicted;
}

class ChoosePolicyTest : public testing::TestWithParam<int> {};

TEST_P(ChoosePolicyTest, MakesPlansOfAnyVolumeAndKeepsWhatIsFixed) {
  Random random(std::uint64_t(GetParam()) + 99);
  SCOPED_TRACE(random.trace());
  const auto one_of = [&](const auto& entries) { return std::string(entries[random.Integer<std::size_t>(0, entries.size() - 1)].name); };
  const int step = GetParam() > 100 ? 6 : 1;  // of many workers only two: a choice takes seconds
  for (const NamedSummary& volume : OddVolumes()) {
    for (int left_open = 1; left_open < 8; left_open += step) {
      Question question{.summary = volume.summary, .slots = std::uint32_t(GetParam())};
      question.request.renderer = (random.Chance(0.5) ? Splatting() : ZBuffer())->name();
      question.request.view = RandomView(random);
      Policy asked;
      asked.decomposition = (left_open & 1) != 0 ? std::string(kAutomatic) : one_of(Decompositions());
      asked.assignment = (left_open & 2) != 0 ? std::string(kAutomatic) : one_of(Assignments());
      asked.combine = (left_open & 4) != 0 ? std::string(kAutomatic) : std::string("fan-in");
      asked.balance_by = one_of(BalanceByChoices());
      asked.groups = random.Integer(0, 3);
      asked.balance = one_of(Balances());
      SCOPED_TRACE(testing::Message() << volume.name << ", p = " << GetParam() << ", " << asked.decomposition << ", " << asked.balance_by
                                      << ", " << asked.assignment << ", " << asked.combine << ", " << asked.groups << " groups");
      const PolicyChoice choice = question.Choose(asked);
      const Policy got = AskFor(choice.policy);
      EXPECT_TRUE(CheckNames(got).ok() && !LeavesChoice(got)) << CheckNames(got).message();
      EXPECT_NE(got.balance_by, kAutomatic);
      EXPECT_GE(choice.policy.groups, 1);
      EXPECT_LE(choice.policy.groups, kMaxGroups);
      if (asked.decomposition != kAutomatic) {
        EXPECT_EQ(got.decomposition, asked.decomposition);
      }
      if (asked.assignment != kAutomatic) {
        EXPECT_EQ(got.assignment, asked.assignment);
      }
      if (asked.combine != kAutomatic) {
        EXPECT_EQ(got.combine, asked.combine);
      }
      if (asked.balance_by != kAutomatic) {
        EXPECT_EQ(got.balance_by, asked.balance_by);
      }
      if (asked.groups > 0) {
        EXPECT_EQ(got.groups, asked.groups);
      }
      EXPECT_EQ(got.balance, asked.balance);

      question.request.policy = got;
      EXPECT_TRUE(PlanFrame(question.request, 1, question.summary, FullRoster(GetParam())).ok());
      EXPECT_TRUE(SameChoice(choice, question.Choose(asked))) << "chosen otherwise the second time";

      // What would hold without choosing is one of the candidates.
      const PolicyChoice fixed = question.Choose(FixedPolicy(asked));
      ASSERT_TRUE(choice.prediction && fixed.prediction);
      EXPECT_LE(choice.prediction->latency_seconds, fixed.prediction->latency_seconds);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Workers, ChoosePolicyTest, testing::Values(1, 2, 3, 5, 8, 13, 64, 1024));

TEST(ChoosePolicy, DividesWhatLiesInACornerByWork) {
  Question question{.summary = SummaryWith({192, 192, 192}, [](const Index3& b) { return b.z < 3 && b.x < 6; }), .slots = 8};
  const PolicyChoice fixed = question.Choose(Policy{}), chosen = question.Choose(Automatic());
  EXPECT_LT(chosen.prediction->render_seconds, 0.7 * fixed.prediction->render_seconds) << chosen.policy.decomposition->name;
  EXPECT_LT(chosen.prediction->imbalance, 1.5);
}

// Partitions are judged under several schemes and numbers of groups: none of these is left out for doing badly under another.
TEST(ChoosePolicy, NoPartitionWithAFewSchemesAndGroupsIsMuchBetter) {
  for (const std::uint32_t slots : {2U, 8U, 13U}) {
    Question question{.summary = SummaryWith({96, 96, 96}, [](const Index3& b) { return b.x + b.y + b.z < 5; }), .slots = slots};
    question.machine.link = {Contention::kSwitched, 50e-6, 125e6};
    const double chosen = question.Choose(Automatic()).prediction->latency_seconds;
    for (const DecompositionEntry& entry : Decompositions()) {
      for (const char* split : {"voxels", "occupied"}) {
        for (const char* scheme : {"fan-in", "radix-k", "direct-send"}) {
          for (const int groups : {1, 2}) {
            const Policy policy{.decomposition = std::string(entry.name), .balance_by = split, .groups = groups, .combine = scheme};
            EXPECT_LE((1 - kLeastGain) * chosen, question.Choose(policy).prediction->latency_seconds)
                << entry.name << " by " << split << ", " << scheme << ", " << groups << ", p = " << slots;
          }
        }
      }
    }
  }
}

// Across hosts a group may be combined while the next one renders; on one host there is little to hide.
TEST(ChoosePolicy, TakesMoreGroupsWhereLinksMakeThemPay) {
  const Index3 size = {256, 256, 256};
  const Index3 bricks = FullSummary(size).brick_counts;
  const VolumeSummary ball = SummaryWith(size, [&](const Index3& b) {
    const Vec3 place = (ToVec3(b) + Vec3{0.5, 0.5, 0.5}) / ToVec3(bricks) - Vec3{0.5, 0.5, 0.5};
    return Length(place) < 0.5;
  });
  Question question{.summary = ball, .slots = 8};
  question.request.size = {512, 512};
  TransferFunction fog;
  fog.colors = {{0, {1, 1, 1}}};
  fog.opacities = {{100, 0}, {200, 0.02}};
  question.request.transfer.choice = fog;
  question.request.view.azimuth_degrees = 30;
  question.request.view.elevation_degrees = 5;  // slabs lie one above the other: thinner ones make smaller images
  question.machine = ServiceMachine(std::vector<HostedWorker>(question.slots), {.link = ParseLink("link", "1gbit").value()});
  Policy open;  // but for the groups, which are 0, nothing
  EXPECT_FALSE(LeavesChoice(open));
  EXPECT_TRUE(LeavesChoice(open, question.machine, question.slots));
  const PolicyChoice slow = question.Choose(open);
  EXPECT_GT(slow.policy.groups, 1);
  Policy one = open;
  one.groups = 1;
  EXPECT_FALSE(LeavesChoice(one, question.machine, question.slots));
  const PolicyChoice alone = question.Choose(one);
  EXPECT_EQ(alone.policy.groups, 1);
  ASSERT_TRUE(slow.prediction && alone.prediction);
  EXPECT_LT(slow.prediction->latency_seconds, (1 - kLeastGain) * alone.prediction->latency_seconds);

  const std::vector<HostedWorker> here(question.slots, {.memory_scope = 7, .lends_memory = true, .threads = 1});
  question.machine = ServiceMachine(here, {.memory_scope = 7, .cores = 8});
  EXPECT_FALSE(LeavesChoice(open, question.machine, question.slots));
  EXPECT_EQ(question.Choose(open).policy.groups, 1);
}

TEST(ChoosePolicy, KeepsWhatHoldsUnlessEnoughIsGained) {
  Question question{.summary = SummaryWith({192, 192, 192}, [](const Index3& b) { return b.z < 3 && b.x < 6; }), .slots = 8};
  const ResolvedPolicy now = ResolvePolicy({.balance_by = "voxels", .groups = 1}, question.summary.description.geometry);
  EXPECT_EQ(question.Choose(Automatic(), &now, 0.95).policy.decomposition, now.decomposition);
  EXPECT_NE(question.Choose(Automatic(), &now, 0.05).policy.decomposition, now.decomposition);
}

TEST(ChoosePolicy, SlabsOfAllCandidatesFitTheBudget) {
  Question question{.summary = FullSummary({256, 256, 256}), .slots = 2};
  question.box_bytes_target = 3 << 20;
  for (const DecompositionEntry& entry : Decompositions()) {
    Policy asked = Automatic();
    asked.decomposition = entry.name;
    const PolicyChoice choice = question.Choose(asked);
    const ResolvedRequest resolved = Resolved(question.request, question.summary);
    const Layout layout =
        MakeLayout({.summary = &question.summary, .volume = &resolved.volume, .policy = &choice.policy, .slots = question.slots});
    for (const Box& box : layout.partition.boxes()) {
      EXPECT_LE(Grown(box, kHalo, layout.partition.bounds()).voxel_count(), question.box_bytes_target)
          << entry.name << ", " << choice.policy.groups << " groups";
    }
  }
}

TEST(ChoosePolicy, ASlowerLinkNeverMakesFramesFaster) {
  Question question{.summary = FullSummary({96, 96, 96}), .slots = 13};
  for (const Contention contention : {Contention::kSwitched, Contention::kSharedBus, Contention::kFatTree}) {
    double before = 0;
    for (const double bytes_per_second : {1e10, 1e9, 1e8, 1e7}) {
      question.machine.link = {contention, 20e-6, bytes_per_second};
      Policy asked;
      asked.combine = kAutomatic;
      const PolicyChoice choice = question.Choose(asked);
      // Of two that differ by less than kLeastGain either may be taken.
      EXPECT_GE(choice.prediction->latency_seconds, (1 - kLeastGain) * before) << bytes_per_second << ", " << choice.policy.combine;
      before = choice.prediction->latency_seconds;
    }
  }
}

TEST(ChoosePolicy, ASchemeOfTooManyStepsIsNotTriedAndNotPredicted) {
  Question question{.summary = FullSummary({64, 64, 64}), .slots = 1024};
  Policy asked = Automatic();
  asked.groups = 1;
  EXPECT_NE(question.Choose(asked).policy.combine, "direct-send");
  asked.combine = "direct-send";
  const PolicyChoice choice = question.Choose(asked);
  EXPECT_EQ(choice.policy.combine, "direct-send");
}

}  // namespace
}  // namespace slabstream
