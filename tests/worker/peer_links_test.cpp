// The worker machine and the other workers: whom it lends images to, whose links it times, what it answers, and whose keys it admits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/memory/shared_arena.h"
#include "tests/worker/worker_machine_fixture.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kHere = 7, kElsewhere = 8;  // memory scopes

class PeerLinksTest : public WorkerMachineTest {
 protected:
  static WorkerConfig OnNetwork() {
    WorkerConfig config = Config();
    config.images_endpoint = "tcp://127.0.0.1:1";
    config.memory_scope = kHere;
    config.lends_memory = true;
    return config;
  }
  static Peer PeerAt(std::uint64_t scope, WorkerId worker = kPeer, const std::string& key = "") {
    return {worker, "tcp://127.0.0.1:2", scope, key};
  }
  // This worker renders rank 1 of the frame, and sends it to `peer`.
  SendPartial SendTo(const Peer& peer, FrameId frame) {
    GroupAssignment assignment = Assignment(frame, {peer.worker, kSelf});
    assignment.display = peer.worker;
    assignment.peers[1] = peer;
    const auto renders = All<StartRender>(Feed(Tell(assignment)));
    return All<SendPartial>(Rendered(renders.at(0))).at(0);
  }
  Actions Name(const std::vector<Peer>& peers, FrameId frame = 1) {
    GroupAssignment assignment = Assignment(frame, {});
    assignment.peers = peers;
    return Tell(assignment);
  }
  Actions RegisterAgain(Epoch epoch) {
    Tell(Retire{epoch});
    return Tell(WelcomeTo(++incarnation_, epoch));
  }
  static PartialImage Lent(const GroupKey& key) {
    PartialImage partial = FromPeer(key);
    partial.shared = SharedImage{{5, 1, 3}, {0, 0, 4, 2}, 4, 0, {{65536, 1, 0}}};
    return partial;
  }

  Incarnation incarnation_ = Config().incarnation;
};

TEST_F(PeerLinksTest, LendsToWorkersOfThisHostUntilTheyRefuse) {
  Start(OnNetwork());
  const SendPartial lent = SendTo(PeerAt(kHere), 1);
  EXPECT_TRUE(lent.delivery.lend);
  EXPECT_FALSE(SendTo(PeerAt(kElsewhere), 2).delivery.lend);

  const ImageRefused refused = {kEpoch, kPeer, lent.message.key, lent.message.step, lent.message.pixels};
  EXPECT_THAT(Tell(ImageRefused{kEpoch + 1, kPeer, refused.key}), IsEmpty()) << "of another epoch";
  const auto first = All<ResendImage>(Tell(refused)), second = All<ResendImage>(Tell(refused));
  ASSERT_THAT(first, SizeIs(1));
  EXPECT_EQ(first[0].refused, refused);
  EXPECT_TRUE(first[0].first);
  ASSERT_THAT(second, SizeIs(1));
  EXPECT_FALSE(second[0].first);
  const SendPartial next = SendTo(PeerAt(kHere), 3);
  EXPECT_FALSE(next.delivery.lend);
  EXPECT_FALSE(next.delivery.timed) << "within a host";
  EXPECT_TRUE(SendTo(PeerAt(kHere, kPeer + 1), 4).delivery.lend) << "another worker may read it";

  RegisterAgain(kEpoch);
  EXPECT_FALSE(SendTo(PeerAt(kHere), 5).delivery.lend);
  RegisterAgain(kEpoch + 1);
  RegisterAgain(kEpoch);
  EXPECT_TRUE(SendTo(PeerAt(kHere), 6).delivery.lend) << "another coordinator's workers may be others";
}

TEST_F(PeerLinksTest, LendsNothingUnlessBothCan) {
  WorkerConfig config = OnNetwork();
  config.lends_memory = false;
  Start(config);
  EXPECT_FALSE(SendTo(PeerAt(kHere), 1).delivery.lend);
  config = OnNetwork();
  config.memory_scope = 0;
  Start(config);
  EXPECT_FALSE(SendTo(PeerAt(0), 1).delivery.lend) << "neither knows its host";
}

TEST_F(PeerLinksTest, TimesLinksToOtherHostsOneMessageAtATime) {
  Start(OnNetwork());
  constexpr std::size_t kBytes = 1'000'000;
  std::uint64_t asked = 0;
  FrameId frame = 0;
  for (int answers = 0; answers < 2; ++answers) {
    const SendPartial send = SendTo(PeerAt(kElsewhere), ++frame);
    EXPECT_TRUE(send.delivery.timed);
    EXPECT_EQ(send.delivery.bytes_per_second, LinkRates::kUnknown);
    EXPECT_GT(send.message.acknowledge, asked);
    asked = send.message.acknowledge;
    EXPECT_THAT(Tell(PartialSent{kPeer, asked, kBytes}), IsEmpty());
    EXPECT_EQ(SendTo(PeerAt(kElsewhere), ++frame).message.acknowledge, 0U) << "the other has no answer yet";
    now += milliseconds(100);
    Tell(ImageReceived{kEpoch + 1, kPeer, asked});
    Tell(ImageReceived{kEpoch, kPeer, asked});
  }
  EXPECT_NEAR(SendTo(PeerAt(kElsewhere), ++frame).delivery.bytes_per_second, 1e7, 1e6);
}

TEST_F(PeerLinksTest, TimesNothingThatIsPackedAnywayOrNever) {
  for (const auto& [compression, rate] : {std::pair(LinkCompression::kOn, 0.0), std::pair(LinkCompression::kOff, LinkRates::kUnknown)}) {
    WorkerConfig config = OnNetwork();
    config.compression = compression;
    Start(config);
    const SendPartial send = SendTo(PeerAt(kElsewhere), 1);
    EXPECT_FALSE(send.delivery.timed);
    EXPECT_EQ(send.message.acknowledge, 0U);
    EXPECT_EQ(send.delivery.bytes_per_second, rate);
  }
}

TEST_F(PeerLinksTest, AnswersLargeImagesOfThoseWhoAsk) {
  Start(OnNetwork());
  Name({PeerAt(kElsewhere)});
  PartialImage partial = FromPeer({2, 1, 0});
  const Bytes large{std::vector<std::byte>(kLeastAcknowledgedBytes)}, small{std::vector<std::byte>(kLeastAcknowledgedBytes - 1)};
  EXPECT_THAT(All<AnswerPeer>(Tell(partial, large)), IsEmpty()) << "it did not ask";
  partial.acknowledge = 5;
  EXPECT_THAT(All<AnswerPeer>(Tell(partial, small)), IsEmpty());
  const auto answers = All<AnswerPeer>(Tell(partial, large));
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].to, PeerAt(kElsewhere));
  EXPECT_EQ(std::get<ImageReceived>(answers[0].message), (ImageReceived{kEpoch, kSelf, 5}));
  partial.from_worker = kPeer + 1;
  EXPECT_THAT(All<AnswerPeer>(Tell(partial, large)), IsEmpty()) << "nobody has named that worker";
}

TEST_F(PeerLinksTest, RefusesAnUnreadableImageOnceItsSenderIsNamed) {
  Start(OnNetwork(), false);
  const GroupKey key = {1, 1, 0};
  EXPECT_THAT(All<AnswerPeer>(Tell(ImageUnreadable{Lent(key)})), IsEmpty()) << "it has overtaken the Welcome";
  PartialImage of_another = Lent(key);
  of_another.epoch = kEpoch + 1;
  Tell(ImageUnreadable{of_another});
  Tell(WelcomeTo(Config().incarnation));
  Tell(ImageUnreadable{of_another});
  const auto answers = All<AnswerPeer>(Name({PeerAt(kHere)}));
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].to, PeerAt(kHere));
  EXPECT_EQ(std::get<ImageRefused>(answers[0].message), (ImageRefused{kEpoch, kSelf, key, 0, Lent(key).pixels}));
  EXPECT_THAT(All<AnswerPeer>(Name({PeerAt(kHere)}, 2)), IsEmpty()) << "once";
  EXPECT_THAT(All<AnswerPeer>(Tell(ImageUnreadable{Lent(key)})), SizeIs(1)) << "it is named already";
}

TEST_F(PeerLinksTest, ForgetsWhatIsLentForGroupsThatAreOver) {
  const auto forgets = [](const Actions& actions, const GroupKey& key) {
    const auto all = All<ForgetGroups>(actions);
    return std::ranges::any_of(all, [&](const ForgetGroups& forget) { return forget.Over(key); });
  };
  const Actions pinged = Tell(Ping{kEpoch, 5, {7}});
  EXPECT_TRUE(forgets(pinged, {4, 3, 2}));
  EXPECT_TRUE(forgets(pinged, {7, 1, 0}));
  EXPECT_FALSE(forgets(pinged, {5, 1, 0}));
  EXPECT_FALSE(forgets(pinged, {8, 1, 0}));

  GroupAssignment assignment = Assignment(8, {kSelf}, 4, 5, 2);
  assignment.finished_before = 6;
  assignment.groups_done = 3;
  const Actions assigned = Tell(assignment);
  EXPECT_TRUE(forgets(assigned, {5, 9, 9}));
  EXPECT_TRUE(forgets(assigned, {8, 2, 2})) << "accumulated";
  EXPECT_TRUE(forgets(assigned, {8, 1, 3})) << "an older attempt";
  EXPECT_FALSE(forgets(assigned, {8, 2, 3}));
  EXPECT_FALSE(forgets(assigned, {9, 1, 0}));

  EXPECT_FALSE(forgets(RegisterAgain(kEpoch), {9, 1, 0})) << "the same coordinator's frames go on";
  EXPECT_TRUE(forgets(RegisterAgain(kEpoch + 1), {9, 1, 0}));
}

class AdmittedKeysTest : public PeerLinksTest {
 protected:
  void SetUp() override {
    WorkerConfig config = OnNetwork();
    config.images_key = "own";
    Start(config);
  }
  // The plane's keys after these actions, and those whose connections end.
  static AdmitKeys Last(const Actions& actions) {
    const auto all = All<AdmitKeys>(actions);
    return all.empty() ? AdmitKeys{{"nothing changes"}, {}} : all.back();
  }
};

TEST_F(AdmittedKeysTest, ThoseOfNamedWorkersUntilTheyHaveGone) {
  const std::vector<Peer> both = {PeerAt(kHere, 1, "one"), PeerAt(kHere, 2, "other")};
  EXPECT_THAT(Last(Name(both)).keys, ElementsAre("one", "other"));
  EXPECT_THAT(All<AdmitKeys>(Name(both, 2)), IsEmpty()) << "named before";
  ASSERT_NE(machine->FindPeer(1), nullptr);
  EXPECT_EQ(machine->FindPeer(1)->images_key, "one");
  const AdmitKeys left = Last(Tell(Ping{kEpoch, 0, {}, {}, {1, 77}}));
  EXPECT_THAT(left.keys, ElementsAre("other"));
  EXPECT_THAT(left.ended, ElementsAre("one"));
  EXPECT_EQ(machine->FindPeer(1), nullptr);
  EXPECT_NE(machine->FindPeer(2), nullptr);
  EXPECT_THAT(All<AdmitKeys>(Tell(Ping{kEpoch, 0, {}, {}, {1, 77}})), IsEmpty());
}

TEST_F(AdmittedKeysTest, AProcessThatIsAnotherWorkerByNowKeepsItsConnection) {
  Name({PeerAt(kHere, 1, "one"), PeerAt(kHere, 3, "one")});
  const AdmitKeys left = Last(Tell(Ping{kEpoch, 0, {}, {}, {1}}));
  EXPECT_THAT(left.keys, ElementsAre("one"));
  EXPECT_THAT(left.ended, IsEmpty());
}

TEST_F(AdmittedKeysTest, AfterAnotherRegistrationOnlyThoseNamedSince) {
  Name({PeerAt(kHere, 1, "one"), PeerAt(kHere, 2, "other")});
  EXPECT_THAT(Last(RegisterAgain(kEpoch)).keys, IsEmpty());
  EXPECT_THAT(Last(Name({PeerAt(kHere, 2, "other")}, 2)).keys, ElementsAre("other"));
}

TEST_F(AdmittedKeysTest, WithoutKeysNothingIsAdmitted) {
  Start(OnNetwork());
  EXPECT_THAT(All<AdmitKeys>(Name({PeerAt(kHere, 1, "")})), IsEmpty());
}

}  // namespace
}  // namespace slabstream
