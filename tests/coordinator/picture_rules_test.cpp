// Pictures that go straight to clients: only to where the client has connected from, only if it asked, and the coordinator keeps none.
#include "coordinator/clients.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

const std::string kWorkerKey(40, 'w'), kClientKey(40, 'c');

// A client with a pictures plane, and a worker with keys.
struct KeysScript : CoordinatorScript {
  KeysScript() {
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
                     .direct = true};
    image.runs.encoded_bytes = bytes;
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
  EXPECT_TRUE(replies[0].message.direct);
  EXPECT_TRUE(replies[0].payload.empty());
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
