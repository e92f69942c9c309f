// The names of a policy, and what is looked up by them.
#include <gtest/gtest.h>

#include <string>

#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/classified_volume.h"
#include "common/planning/policy_names.h"
#include "tests/common/planning/plan_support.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

TEST(PlanFrame, UsesEveryNameOfAPolicy) {
  const VolumeSummary summary = FullSummary({40, 40, 40});
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (const DecompositionEntry& decomposition : Decompositions()) {
      FrameRequest request = SomeRequest();
      request.policy.combine = scheme.name;
      request.policy.decomposition = decomposition.name;
      for (const AssignmentEntry& assignment : Assignments()) {
        if (assignment.by_owner) continue;  // nobody owns these voxels
        for (const NamedChoice& split : BalanceByChoices()) {
          request.policy.assignment = assignment.name;
          request.policy.balance_by = split.name;
          request.policy.groups = 2;
          const Roster roster = FullRoster(5);
          ExpectSound(Plan(request, summary, roster), roster);
        }
      }
    }
  }
}

TEST(PlanFrame, WithoutAPolicyIsAKdTreeByBricksAndCombinesByWorkersAndPixels) {
  const VolumeSummary summary = FullSummary({40, 40, 40});
  FrameRequest request = SomeRequest();
  request.policy = {};
  EXPECT_FALSE(NeedsOccupancy(request.policy)) << "its frame would wait";
  EXPECT_EQ(BalanceByOf(request.policy), "bricks");
  EXPECT_EQ(BalanceByOf({.balance = std::string(kDynamicBalance)}), "occupied");
  EXPECT_EQ(BalanceByOf({.assignment = "greedy"}), "occupied");
  EXPECT_EQ(BalanceByOf({.decomposition = "slab"}), "voxels");
  request.size = {1024, 1024};
  EXPECT_EQ(Plan(request, summary, FullRoster(7)).combine, "fan-in");
  EXPECT_EQ(Plan(request, summary, FullRoster(8)).combine, "direct-send");
  request.size = {1023, 1024};
  EXPECT_EQ(Plan(request, summary, FullRoster(8)).combine, "fan-in");
  EXPECT_EQ(Plan(request, summary, FullRoster(63)).combine, "fan-in");
  EXPECT_EQ(Plan(request, summary, FullRoster(64)).combine, "radix-k");
  request.policy.combine = "chain";
  EXPECT_EQ(Plan(request, summary, FullRoster(8)).combine, "chain");
}

TEST(ResolvePolicy, FindsWhatIsNamed) {
  const VolumeGeometry geometry = FullSummary({40, 200, 42}).description.geometry;
  FrameRequest request = SomeRequest();
  for (const DecompositionEntry& decomposition : Decompositions()) {
    for (const AssignmentEntry& assignment : Assignments()) {
      for (const NamedChoice& split : BalanceByChoices()) {
        for (const AxisChoice axis : {AxisChoice::kX, AxisChoice::kAuto, AxisChoice::kView}) {
          request.policy = {.decomposition = std::string(decomposition.name),
                            .balance_by = std::string(split.name),
                            .axis = axis,
                            .assignment = std::string(assignment.name),
                            .balance = std::string(kDynamicBalance)};
          const ResolvedPolicy resolved = ResolvePolicy(SettledPolicy(request, geometry), geometry);
          EXPECT_EQ(resolved.decomposition, &decomposition);
          EXPECT_EQ(resolved.assignment, &assignment);
          EXPECT_EQ(NameOf(resolved.balance_by), BalanceByOf(request.policy));
          EXPECT_TRUE(NeedsOccupancy(request.policy)) << "it is dynamic";
        }
      }
    }
  }
}

TEST(ClassifiedVolume, IsAKeyByWhatItIs) {
  const TransferFunction transfer = std::get<TransferFunction>(SomeRequest().transfer.choice);
  const ClassifiedVolume volume(3, transfer, Splatting()), same(3, transfer, Splatting());
  EXPECT_EQ(volume, same);
  TransferFunction other = transfer;
  other.opacities.back().opacity /= 2;
  EXPECT_NE(volume, ClassifiedVolume(4, transfer, Splatting()));
  EXPECT_NE(volume, ClassifiedVolume(3, transfer, ZBuffer()));
  EXPECT_NE(volume, ClassifiedVolume(3, other, Splatting()));
}

TEST(PlanFrame, NamesWhatItDoesNotKnow) {
  const VolumeSummary summary = FullSummary({8, 8, 8});
  const auto status = [&](auto change, const Roster& roster) {
    FrameRequest request = SomeRequest();
    change(request);
    return PlanFrame(request, 7, summary, roster).status();
  };
  EXPECT_EQ(
      status([](auto& r) { r.policy.decomposition = "cake"; }, FullRoster(1)),
      Status::InvalidArgument("policy.decomposition is 'cake', but must be left out or one of: slab, beam, subcube, octree, kd-tree"));
  EXPECT_EQ(status([](auto& r) { r.policy.balance_by = "hairs"; }, FullRoster(1)),
            Status::InvalidArgument("policy.balance_by is 'hairs', but must be left out or one of: auto, voxels, bricks, occupied, cost"));
  EXPECT_EQ(status([](auto& r) { r.policy.assignment = "lots"; }, FullRoster(1)),
            Status::InvalidArgument(
                "policy.assignment is 'lots', but must be left out or one of: cyclic, alternating, contiguous, greedy, owner"));
  EXPECT_EQ(status([](auto& r) { r.policy.balance = "act"; }, FullRoster(1)),
            Status::InvalidArgument("policy.balance is 'act', but must be left out or one of: static, dynamic"));
  EXPECT_EQ(
      status([](auto& r) { r.policy.combine = "mix"; }, FullRoster(1)),
      Status::InvalidArgument("policy.combine 'mix' is not one of fan-in, centralized, chain, tree, radix-k, binary-swap, direct-send"));
  for (std::string Policy::*field : {&Policy::decomposition, &Policy::assignment, &Policy::balance, &Policy::combine}) {
    EXPECT_EQ(status([field](auto& r) { r.policy.*field = kAutomatic; }, FullRoster(1)).code(), StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(status([](auto& r) { r.transfer.choice = "no-such-preset"; }, FullRoster(1)).code(), StatusCode::kNotFound);
  for (const Roster& nobody : {Roster{}, Roster{{0}}, Roster{{0, 0, 0}}}) {
    EXPECT_EQ(status([](auto&) {}, nobody).code(), StatusCode::kUnavailable);
  }
}

}  // namespace
}  // namespace slabstream
