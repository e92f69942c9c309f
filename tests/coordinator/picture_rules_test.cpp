// Pictures that go straight to clients: only to where the client has connected from, only if it asked, and the coordinator keeps none.
#include "coordinator/frames/clients.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

using testing::Field;

const std::string kWorkerKey(40, 'w'), kClientKey(40, 'c');

// A client with a pictures plane, and a worker with keys.
struct KeysScript : CoordinatorScript {
  explicit KeysScript(ScriptConfig c = TestConfig()) : CoordinatorScript(std::move(c)) {
    host = "10.1.2.3";
    images_key = kWorkerKey;
    Join(11, 1);
  }
  static SubmitFrame WithDoor(RequestId id, int groups = 1) {
    SubmitFrame submit = Frame(id, groups);
    submit.pictures = PicturesDoor{4711, kClientKey};
    return submit;
  }
  Actions DirectImage(const GroupAssignment& group, std::uint64_t bytes = 100) {
    FrameImage image{.epoch = config.epoch,
                     .worker = group.display,
                     .frame = group.key.frame,
                     .attempt = group.key.attempt,
                     .groups_done = group.group_count,
                     .group_count = group.group_count,
                     .picture = {.direct = true}};
    image.picture.runs.encoded_bytes = bytes;
    return Worker(WorkerOf(group.display), image);
  }
};

TEST(CoordinatorPictures, GoToTheHostThatTheClientHasConnectedFrom) {
  KeysScript script;
  const auto groups = HandedOut(script.Submit(kClient, KeysScript::WithDoor(1)));
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_EQ(groups[0].pictures, (PicturesAddress{"tcp://10.1.2.3:4711", kClientKey}));
  script.Done(groups[0]);
  const auto replies = ToClients<FrameReply>(script.DirectImage(groups[0]));
  ASSERT_THAT(replies, SizeIs(1));
  EXPECT_THAT(replies[0].message.shares, ElementsAre(Field(&PictureShare::direct, true)));
  EXPECT_TRUE(replies[0].payload.empty());
}

struct SharesScript : KeysScript {
  SharesScript() : KeysScript(SmallShares()) { Join(12, 2); }
  static ScriptConfig SmallShares() {
    ScriptConfig config = TestConfig();
    config.share_pixels = 1;
    return config;
  }
  // Of the worker that displays the share.
  Actions ShareDone(const GroupAssignment& group, std::size_t share) {
    const WorkerId worker = DisplaysOf(group.group, group.display)[share];
    return Worker(WorkerOf(worker),
                  GroupDone{.epoch = config.epoch, .worker = worker, .key = group.key, .reports = {{.rank = Rank(share)}}});
  }
  Actions ShareImage(const GroupAssignment& group, std::size_t share, bool direct, Bytes payload = {}) {
    const WorkerId worker = DisplaysOf(group.group, group.display)[share];
    FrameImage image{.epoch = config.epoch,
                     .worker = worker,
                     .frame = group.key.frame,
                     .attempt = group.key.attempt,
                     .groups_done = 1,
                     .group_count = 1,
                     .picture = {.direct = direct},
                     .share = std::uint32_t(share),
                     .share_count = 2};
    image.picture.runs.encoded_bytes = 3;
    return Step(FromWorker{.from = tokens.at(worker), .message = image, .payload = std::move(payload)});
  }
  static Bytes Text(const std::string& text) {
    const auto bytes = std::as_bytes(std::span(text));
    return Bytes(std::vector<std::byte>(bytes.begin(), bytes.end()));
  }
};

TEST(CoordinatorPictures, AreDividedAmongTheWorkersOfAGroupForAClientThatPutsThemTogether) {
  SharesScript script;
  const auto groups = HandedOut(script.Submit(kClient, KeysScript::WithDoor(1)));
  ASSERT_THAT(groups, SizeIs(1));
  ASSERT_THAT(groups[0].group.schedule.roots, SizeIs(2));
  EXPECT_THAT(ToClients<FrameProgress>(script.ShareDone(groups[0], 1)), IsEmpty()) << "the other share is not done";
  EXPECT_THAT(ToClients<FrameReply>(script.ShareImage(groups[0], 1, true)), IsEmpty());
  EXPECT_THAT(ToClients<FrameProgress>(script.ShareDone(groups[0], 0)), SizeIs(1));
  EXPECT_THAT(ToClients<FrameReply>(script.ShareImage(groups[0], 1, false, SharesScript::Text("abc"))), IsEmpty()) << "it has that one";
  const auto replies = ToClients<FrameReply>(script.ShareImage(groups[0], 0, false, SharesScript::Text("xyz")));
  ASSERT_THAT(replies, SizeIs(1));
  const FrameReply& reply = replies[0].message;
  EXPECT_THAT(reply.shares, ElementsAre(Field(&PictureShare::direct, false), Field(&PictureShare::direct, true)));
  EXPECT_EQ(replies[0].payload.size(), 3U);
  EXPECT_THAT(reply.statistics.reports, SizeIs(2)) << "each display tells of other ranks";
}

TEST(CoordinatorPictures, AreNotDividedForOthers) {
  SharesScript script;
  SubmitFrame with_previews = KeysScript::WithDoor(2);
  with_previews.frame.previews = true;
  const auto roots = [&](const SubmitFrame& submit) {
    const auto groups = HandedOut(script.AnswerAll(script.Submit(kClient, submit)));
    return groups.at(0).group.schedule.roots.size();
  };
  EXPECT_EQ(roots(Frame(1)), 1U) << "no door";
  EXPECT_EQ(roots(with_previews), 1U);
  EXPECT_EQ(roots(KeysScript::WithDoor(3, 2)), 1U) << "two groups";
}

TEST(CoordinatorPictures, AreNotDividedIfSmallFramesFollowOneAnother) {
  SharesScript script;
  const auto first = HandedOut(script.Submit(kClient, KeysScript::WithDoor(1)));
  const auto second = HandedOut(script.Submit(kClient, KeysScript::WithDoor(2)));
  EXPECT_THAT(first.at(0).group.schedule.roots, SizeIs(2));
  EXPECT_THAT(second.at(0).group.schedule.roots, SizeIs(1));
  SubmitFrame large = KeysScript::WithDoor(3);
  large.frame.size = {2048, 512};
  SharesScript other;
  other.Submit(kClient, KeysScript::WithDoor(1));
  EXPECT_THAT(HandedOut(other.Submit(kClient, large)).at(0).group.schedule.roots, SizeIs(2));
}

TEST(CoordinatorPictures, AreMadeAnewIfAWorkerWithAShareIsLost) {
  for (const bool picture_was_there : {false, true}) {
    SharesScript script;
    const auto groups = HandedOut(script.Submit(kClient, KeysScript::WithDoor(1)));
    script.ShareDone(groups.at(0), 0);
    script.ShareDone(groups[0], 1);
    if (picture_was_there) script.ShareImage(groups[0], 0, true);
    const WorkerId lost = DisplaysOf(groups[0].group, groups[0].display)[1];
    const auto again = HandedOut(script.Kill(script.WorkerOf(lost)));
    ASSERT_THAT(again, SizeIs(1));
    EXPECT_EQ(again[0].key, (GroupKey{1, 2, 0}));
    EXPECT_THAT(again[0].group.schedule.roots, SizeIs(1)) << "one worker is left";
    EXPECT_THAT(ToClients<FrameReply>(script.ShareImage(groups[0], 0, true)), IsEmpty()) << "a share of the attempt before";
    script.Done(again[0]);
    EXPECT_THAT(ToClients<FrameReply>(script.DirectImage(again[0])), SizeIs(1));
  }
}

TEST(CoordinatorPictures, TellOfTheSharesOfTheirAttemptAlone) {
  SharesScript script;
  script.Join(13, 3);
  const auto groups = HandedOut(script.Submit(kClient, KeysScript::WithDoor(1)));
  ASSERT_THAT(groups.at(0).group.schedule.roots, SizeIs(3));
  script.ShareDone(groups[0], 0);
  script.ShareDone(groups[0], 1);
  const WorkerId lost = DisplaysOf(groups[0].group, groups[0].display)[2];
  const auto again = HandedOut(script.Kill(script.WorkerOf(lost)));
  ASSERT_THAT(again.at(0).group.schedule.roots, SizeIs(2));
  for (const std::size_t share : {0, 1}) script.ShareDone(again[0], share);
  script.ShareImage(again[0], 0, true);
  const auto replies = ToClients<FrameReply>(script.ShareImage(again[0], 1, true));
  ASSERT_THAT(replies, SizeIs(1));
  EXPECT_THAT(replies[0].message.statistics.reports, SizeIs(2));
}

TEST(CoordinatorPictures, ComeThroughTheCoordinatorElse) {
  KeysScript no_door, no_host, no_key;
  no_host.host = "";
  no_key.images_key = "";
  no_key.Mute(no_key.workers.front());
  no_key.Worker(FakeWorker{.token = 11, .incarnation = 1}, Leave{.epoch = no_key.config.epoch, .worker = 1});
  no_key.Join(12, 2);
  EXPECT_EQ(HandedOut(no_door.Submit(kClient, Frame(1))).at(0).pictures, std::nullopt);
  EXPECT_EQ(HandedOut(no_host.Submit(kClient, KeysScript::WithDoor(1))).at(0).pictures, std::nullopt);
  EXPECT_EQ(HandedOut(no_key.Submit(kClient, KeysScript::WithDoor(1))).at(0).pictures, std::nullopt);
}

TEST(CoordinatorPictures, ADirectOneThatNobodyAskedForEndsNothing) {
  KeysScript script;
  const auto groups = HandedOut(script.Submit(kClient, Frame(1)));
  script.Done(groups.at(0));
  EXPECT_THAT(ToClients<FrameReply>(script.DirectImage(groups[0])), IsEmpty());
  EXPECT_THAT(ToClients<FrameReply>(script.Image(groups[0], 1)), SizeIs(1));
}

TEST(CoordinatorPictures, WhoAsksAgainGetsTheFrameAnew) {
  KeysScript script;
  const auto groups = HandedOut(script.Submit(kClient, KeysScript::WithDoor(1)));
  script.Done(groups.at(0));
  ASSERT_THAT(ToClients<FrameReply>(script.DirectImage(groups[0])), SizeIs(1));
  const auto pongs = ToClients<ClientPong>(script.Client(kClient, ClientPing{.nonce = 5, .open = {1}}));
  ASSERT_THAT(pongs, SizeIs(1));
  EXPECT_THAT(pongs[0].message.known, IsEmpty());
  const auto again = HandedOut(script.Submit(kClient, Frame(1)));
  ASSERT_THAT(again, SizeIs(1)) << "nothing is kept";
  EXPECT_EQ(again[0].pictures, std::nullopt);
  script.Done(again[0]);
  EXPECT_THAT(ToClients<FrameReply>(script.Image(again[0], 1)), SizeIs(1));
}

TEST(CoordinatorPictures, CountAsUnreadUntilTheClientHasReadThem) {
  KeysScript script;
  const auto groups = HandedOut(script.Submit(kClient, KeysScript::WithDoor(1)));
  script.Client(kClient, ClientPing{.nonce = 1, .received_bytes = 0});
  script.Done(groups.at(0));
  script.DirectImage(groups[0], kMaxUnreadBytes);
  EXPECT_THAT(HandedOut(script.Submit(kClient, KeysScript::WithDoor(2))), IsEmpty()) << "it is behind";
  EXPECT_THAT(HandedOut(script.Client(kClient, ClientPing{.nonce = 2, .received_bytes = kMaxUnreadBytes})), SizeIs(1));
}

TEST(CoordinatorPictures, ClientsHearWhoSendsThemWhenThatChanges) {
  KeysScript script;
  const auto senders = [&](std::optional<std::uint64_t> known) {
    return ToClients<ClientPong>(script.Client(kClient, ClientPing{.nonce = 1, .senders = known})).at(0).message.senders;
  };
  EXPECT_EQ(senders(std::nullopt), std::nullopt) << "it has no pictures plane";
  const auto first = senders(0);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->keys, std::vector<std::string>{kWorkerKey});
  EXPECT_EQ(senders(first->version), std::nullopt);
  script.images_key = std::string(40, 'x');
  script.Join(12, 2);
  const auto second = senders(first->version);
  ASSERT_TRUE(second.has_value());
  EXPECT_THAT(second->keys, SizeIs(2));
}

}  // namespace
}  // namespace slabstream
