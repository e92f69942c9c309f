// What the coordinator does with owners as time goes by: silence, requests that wait, requests that nobody answers, and lies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/wire/payload.h"
#include "coordinator/service/owners.h"
#include "data/sources/volume_source.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::MatchesRegex;

constexpr Epoch kEpoch = 9;
constexpr Index3 kSides = {512, 512, 32};  // eight times what an owner is asked for at once

RegisterOwner Registration(std::uint32_t owner, std::uint64_t incarnation, bool on_demand = false) {
  RegisterOwner m{.incarnation = incarnation, .dataset = "rho", .owner = owner, .owners = 2, .samples = "uint8"};
  m.description.geometry.size = kSides;
  m.on_demand = on_demand;
  m.boxes = {{{0, 0, std::int32_t(owner) * 16}, {512, 512, std::int32_t(owner) * 16 + 16}}};
  return m;
}

template <class Message>
std::vector<std::pair<PeerToken, Message>> Of(const Owners::News& news) {
  std::vector<std::pair<PeerToken, Message>> found;
  for (const auto& [to, message] : news.messages) {
    if (const auto* each = std::get_if<Message>(&message)) found.emplace_back(to, *each);
  }
  return found;
}

class OwnerRulesTest : public testing::Test {
 protected:
  Owners::News Hear(PeerToken from, OwnerToCoordinator message, const Bytes& payload = {}) {
    return owners_->Hear(from, std::move(message), payload, now_);
  }
  // Both owners, at time 5.
  void Register(bool on_demand = false) {
    for (const std::uint32_t owner : {0U, 1U}) {
      EXPECT_EQ(Of<OwnerWelcome>(Hear(owner + 1, Registration(owner, owner + 100, on_demand))).size(), 1U);
      const Owners::News news = Hear(owner + 1, OwnerTime{kEpoch, 5, 0});
      ASSERT_EQ(news.datasets.size(), owner);
      if (owner == 1) open_ = news.datasets[0].came->open;
    }
  }
  // Opens the volume. Once both owners have heard that somebody looks, they say what they have overwritten.
  Result<std::shared_ptr<VolumeSource>> Open(std::uint64_t gone_0 = 0, std::uint64_t gone_1 = 0) {
    woken_ = false;
    std::future<Result<std::shared_ptr<VolumeSource>>> opened = std::async(std::launch::async, source_);
    woken_.wait(false);
    Hold(gone_0, gone_1);
    return opened.get();
  }
  void Hold(std::uint64_t gone_0, std::uint64_t gone_1) {
    for (const auto& [peer, pong] : Of<OwnerPong>(owners_->Tend(now_))) {
      Hear(peer, OwnerPing{kEpoch, 0, pong.hold, peer == 1 ? gone_0 : gone_1});
    }
  }
  // Time passes, in which nobody says anything.
  Owners::News Pass(int times) {
    Owners::News news;
    for (int i = 0; i < times; ++i) {
      now_ += seconds(1);
      news = owners_->Tend(now_);
    }
    return news;
  }
  // The volume, of this thread; what it is asked for is out after the next Tend.
  void Read() {
    opened_ = opened_ == nullptr ? Open().value() : source_().value();
    samples_.assign(std::size_t(CountIn(kSides)), std::byte{0});
    opened_->Read(0, {{0, 0, 0}, kSides}, BoxRoom::Dense({{0, 0, 0}, kSides}, samples_.data(), false), {}, [this](const Status& status) {
      read_ = status;
      done_ = true;
      done_.notify_all();
    });
  }
  Status AwaitRead() {
    done_.wait(false);
    return read_;
  }

  Time now_ = MonotonicNow();
  std::atomic<bool> woken_ = false;
  std::unique_ptr<Owners> owners_ = std::make_unique<Owners>(
      kEpoch, [](const std::string&) { return Status::Ok(); },
      [this] {
        woken_ = true;
        woken_.notify_all();
      });
  std::function<Result<std::shared_ptr<VolumeSource>>(Missing)> open_;
  const std::function<Result<std::shared_ptr<VolumeSource>>()> source_ = [this] { return open_(Missing::kFail); };
  std::shared_ptr<VolumeSource> opened_;
  std::vector<std::byte> samples_;
  std::atomic<bool> done_ = false;
  Status read_;
};

TEST_F(OwnerRulesTest, AnOwnerWhoseConnectionEndsIsLostAtOnce) {
  Register();
  opened_ = Open().value();
  owners_->Tend(now_);
  now_ += kOwnerHeartbeat;
  EXPECT_EQ(Of<OwnerPong>(owners_->Tend(now_)).size(), 2U) << "somebody looks, so each is sent something every second";
  owners_->Gone(2, now_);
  EXPECT_EQ(source_().status().message(), "\"rho\": owner 1 of 2 has ended");
  owners_->Gone(2, now_);
}

TEST_F(OwnerRulesTest, SilenceLosesAnOwnerAndThenTheDataset) {
  Register();
  now_ += seconds(4);
  Hear(1, OwnerPing{kEpoch, 7});
  EXPECT_TRUE(Pass(2).datasets.empty());
  EXPECT_EQ(source_().status().message(), "\"rho\": owner 1 of 2 is silent");
  EXPECT_EQ(Of<Retire>(Hear(2, OwnerPing{kEpoch, 8})).size(), 1U) << "it registers again";
  const Owners::News news = Pass(3);
  ASSERT_EQ(news.datasets.size(), 1U);
  EXPECT_TRUE(news.datasets[0].left);
  EXPECT_EQ(source_().status().message(), "\"rho\": its owners have left");
}

TEST_F(OwnerRulesTest, ACoordinatorThatStoodStillBlamesNobody) {
  Register();
  owners_->Tend(now_);
  now_ += std::chrono::minutes(1);
  EXPECT_TRUE(owners_->Tend(now_).datasets.empty());
  EXPECT_TRUE(Pass(3).datasets.empty());
  EXPECT_EQ(Pass(1).datasets.size(), 1U) << "now they are silent";
}

TEST_F(OwnerRulesTest, TimesOfSourcesAreToldAndGivenUp) {
  Register();
  opened_ = Open().value();
  for (const PeerToken peer : {1, 2}) Hear(peer, OwnerTime{kEpoch, 6, 0});
  const Owners::News news = owners_->Tend(now_);
  const auto pongs = Of<OwnerPong>(news);
  ASSERT_EQ(pongs.size(), 2U);
  EXPECT_EQ(pongs[0].second.used, (std::vector<std::uint64_t>{5, 6}));
  ASSERT_EQ(news.datasets.size(), 1U) << "time 5 may be given up";
  EXPECT_FALSE(news.datasets[0].left);
  EXPECT_TRUE(opened_->info().growth->ask(now_));
  opened_.reset();
  EXPECT_EQ(Of<OwnerPong>(owners_->Tend(now_))[0].second.used, (std::vector<std::uint64_t>{6}));
}

// The owners are at time 5, and the first one has overwritten times up to 6.
TEST_F(OwnerRulesTest, ATimeIsShownOnceAllHoldIt) {
  Register();
  woken_ = false;
  std::future<Result<std::shared_ptr<VolumeSource>>> opened = std::async(std::launch::async, source_);
  woken_.wait(false);
  Hold(6, 0);
  Hear(1, OwnerTime{kEpoch, 8, 0});
  for (const std::uint64_t time : {6, 7}) {
    const auto pongs = Of<OwnerPong>(Hear(1, OwnerPing{kEpoch, 0, 1, 6}));
    EXPECT_THAT(pongs.at(0).second.used, ElementsAre(time - 1));
    EXPECT_EQ(pongs[0].second.hold, 1U);
    Hear(2, OwnerTime{kEpoch, time, 0});
  }
  EXPECT_THAT(opened.get().value()->info().owned, HasSubstr(":7:")) << "in hexadecimal";
  Hear(2, OwnerPing{kEpoch, 1, 99, 0});
  EXPECT_THAT(source_().value()->info().owned, HasSubstr(":7:")) << "nobody has told it to overwrite anything";
}

TEST_F(OwnerRulesTest, NobodyWaitsForAnotherForLong) {
  Register();
  opened_ = Open().value();
  Hear(1, OwnerTime{kEpoch, 6, 0});
  const auto pong = [&](Duration later) {
    now_ += later;
    for (const PeerToken peer : {1, 2}) Hear(peer, OwnerPing{kEpoch, 0, 1, 0});
    owners_->Tend(now_);
    (void)opened_->info().growth->ask(now_);  // somebody looks
    return Of<OwnerPong>(Hear(1, OwnerPing{kEpoch, 0, 1, 0})).at(0).second;
  };
  EXPECT_NE(pong(seconds(4)).hold, 0U);
  EXPECT_NE(pong(seconds(4)).hold, 0U);
  EXPECT_FALSE(opened_->info().growth->ask(now_));
  const OwnerPong let_go = pong(seconds(3));
  EXPECT_EQ(let_go.hold, 0U);
  EXPECT_TRUE(let_go.looked_at);
  EXPECT_THAT(let_go.used, ElementsAre(5));
  EXPECT_TRUE(opened_->info().growth->ask(now_)) << "it is opened anew, to say so";
  opened_ = source_().value();
  EXPECT_FALSE(opened_->info().growth->ask(now_));

  Hear(2, OwnerTime{kEpoch, 6, 0});
  const auto held = Of<OwnerPong>(owners_->Tend(now_));
  ASSERT_EQ(held.size(), 2U);
  EXPECT_GT(held[0].second.hold, 1U);
  EXPECT_THAT(held[0].second.used, ElementsAre(5, 6));
  EXPECT_THAT(source_().value()->info().owned, HasSubstr(":5:")) << "time 6 may be gone";
  for (const PeerToken peer : {1, 2}) Hear(peer, OwnerPing{kEpoch, 0, held[0].second.hold, 0});
  EXPECT_THAT(source_().value()->info().owned, HasSubstr(":6:"));
}

// The second owner has two slots, with times 5 and 6, and the first one has overwritten time 6.
TEST_F(OwnerRulesTest, ATimeIsNotShownForEverWhileTheSlowestOwnerCannotGoOn) {
  Register();
  opened_ = Open().value();
  Hear(1, OwnerTime{kEpoch, 8, 0});
  Hear(2, OwnerTime{kEpoch, 6, 0});
  const auto used_later = [&](int times) {
    OwnerPong pong;
    for (int i = 0; i < times; ++i) {
      Pass(1);
      (void)opened_->info().growth->ask(now_);  // somebody looks
      for (const PeerToken peer : {1, 2}) pong = Of<OwnerPong>(Hear(peer, OwnerPing{kEpoch, 0, 1, peer == 1 ? 7U : 0U})).at(0).second;
    }
    return pong.used;
  };
  EXPECT_THAT(used_later(5), ElementsAre(5, 6));
  (void)used_later(6);
  EXPECT_TRUE(opened_->info().growth->ask(now_)) << "it is opened anew";
  opened_.reset();
  EXPECT_THAT(Of<OwnerPong>(owners_->Tend(now_)).at(0).second.used, ElementsAre(6));
}

TEST_F(OwnerRulesTest, WithoutAnOwnerThereIsThePictureOfTheOthersOrTheLastOne) {
  Register();
  opened_ = Open().value();
  for (const PeerToken peer : {1, 2}) Hear(peer, OwnerTime{kEpoch, 6, 0});
  EXPECT_EQ(Of<OwnerPong>(owners_->Tend(now_)).size(), 2U);
  Hear(2, OwnerLeave{kEpoch});
  EXPECT_EQ(open_(Missing::kFail).status().message(), "\"rho\": owner 1 of 2 has left");
  const auto last = open_(Missing::kLast).value();
  EXPECT_THAT(last->info().owned, HasSubstr(":6:"));
  EXPECT_THAT(last->info().notes, ElementsAre("\"rho\": owner 1 of 2 has left: this is the last time before"));

  Hold(0, 0);
  Hear(1, OwnerTime{kEpoch, 7, 0});
  const auto skipped = open_(Missing::kSkip).value();
  EXPECT_THAT(skipped->info().owned, HasSubstr(":7:"));
  EXPECT_THAT(skipped->info().notes, ElementsAre("\"rho\": owner 1 of 2 has left: its voxels show nothing"));
  const OwnedBoxes& boxes = *skipped->info().levels[0].owned;
  ASSERT_EQ(boxes.size(), 2U);
  EXPECT_EQ(boxes[1], (OwnedBox{{{0, 0, 16}, {512, 512, 32}}, kNoOwner}));
  EXPECT_FALSE(skipped->info().growth->ask(now_));
  EXPECT_THAT(Of<OwnerPong>(Hear(1, OwnerPing{kEpoch, 1, 2, 0})).at(0).second.used, ElementsAre(5, 6, 7)) << "the last time is kept";

  EXPECT_EQ(Of<OwnerWelcome>(Hear(4, Registration(1, 8))).size(), 1U);
  EXPECT_EQ(open_(Missing::kFail).status().message(), "\"rho\": owner 1 of 2 has no time yet");
  Hear(4, OwnerTime{kEpoch, 7, 0});
  EXPECT_TRUE(skipped->info().growth->ask(now_));
  for (const auto& [peer, pong] : Of<OwnerPong>(owners_->Tend(now_))) Hear(peer, OwnerPing{kEpoch, 0, pong.hold, 0});
  EXPECT_TRUE(open_(Missing::kLast).value()->info().notes.empty()) << "all are there";
}

// It may have two slots, and overwrites neither its latest time nor one that is used.
TEST_F(OwnerRulesTest, OnceAllAreThereNoOwnerKeepsTheTimeBefore) {
  Register();
  opened_ = Open().value();
  opened_.reset();
  Hear(2, OwnerLeave{kEpoch});
  Hear(1, OwnerTime{kEpoch, 6, 0});
  const auto used = [&] { return Of<OwnerPong>(Hear(1, OwnerPing{kEpoch, 1, 0, 0})).at(0).second.used; };
  EXPECT_THAT(used(), ElementsAre(5, 6));
  Hear(3, Registration(1, 8));
  EXPECT_THAT(used(), ElementsAre(5, 6)) << "it has no time yet";
  Hear(3, OwnerTime{kEpoch, 9, 0});
  EXPECT_THAT(used(), ElementsAre(6)) << "the other one may have overwritten it, so that there must be another one";
}

TEST_F(OwnerRulesTest, ARequestThatIsLostIsAskedAgainAndThenFails) {
  Register();
  Read();
  const auto asked = Of<ChunkRequest>(owners_->Tend(now_));
  ASSERT_EQ(asked.size(), 8U);
  const auto answer = [&](const std::pair<PeerToken, ChunkRequest>& each) {
    const auto& [peer, request] = each;
    Chunk chunk{.epoch = kEpoch, .dataset = request.dataset, .box = request.box};
    const Bytes payload = PackChunk(Bytes(std::vector<std::byte>(std::size_t(request.box.voxel_count()))), Codec::kZstd, chunk);
    Hear(peer, chunk, payload);
  };
  const auto beat = [&] {
    now_ += seconds(1);
    for (const PeerToken peer : {1, 2}) Hear(peer, OwnerPing{kEpoch, 0, 0, 0});
    return Of<ChunkRequest>(owners_->Tend(now_));
  };
  std::size_t again = 0;
  for (int second = 1; second <= 20; ++second) {
    if (second < 8) answer(asked[std::size_t(second)]);  // the first one is lost
    again += beat().size();
    EXPECT_EQ(again, second < 10 ? 0U : 1U);
  }
  EXPECT_THAT(AwaitRead().message(), MatchesRegex(".*owner [01] of 2 (does not answer a|answers no) request for voxels"));
}

TEST_F(OwnerRulesTest, RequestsWaitAreAskedAgainAndAnswered) {
  Register();
  Read();
  auto asked = Of<ChunkRequest>(owners_->Tend(now_));
  ASSERT_EQ(asked.size(), 8U);
  EXPECT_EQ(Of<ChunkRequest>(Hear(1, Registration(0, 100))).size(), 4U) << "it has forgotten the coordinator";
  const Owners::News again = Hear(3, Registration(0, 100));  // another connection
  EXPECT_EQ(Of<ChunkRequest>(again).size(), 4U);
  EXPECT_TRUE(std::holds_alternative<OwnerWelcome>(again.messages.front().second)) << "else it takes requests for those of another epoch";
  for (auto& [peer, request] : asked) {
    if (peer == 1) peer = 3;
    Chunk chunk{.epoch = kEpoch, .dataset = request.dataset, .box = request.box};
    const Bytes payload =
        PackChunk(Bytes(std::vector<std::byte>(std::size_t(request.box.voxel_count()), std::byte(peer))), Codec::kZstd, chunk);
    Hear(peer, chunk, payload);
  }
  EXPECT_TRUE(AwaitRead().ok()) << read_.message();
  EXPECT_EQ(samples_.front(), std::byte{3});
  EXPECT_EQ(samples_.back(), std::byte{2});
}

TEST_F(OwnerRulesTest, ReadsFailInOneLine) {
  Register();
  Read();
  for (const auto& [peer, request] : Of<ChunkRequest>(owners_->Tend(now_))) {
    Hear(peer, ChunkRefused{kEpoch, request.dataset, request.box, 0, Status::Unavailable("time 5 is not held any more")});
  }
  EXPECT_THAT(AwaitRead().message(), MatchesRegex("\"rho\": owner [01] of 2: time 5 is not held any more"));
  done_ = false;
  Read();
  for (int i = 0; i < 11; ++i) {  // nobody answers, but both are alive
    now_ += seconds(1);
    for (const PeerToken peer : {1, 2}) Hear(peer, OwnerPing{kEpoch, 1});
    owners_->Tend(now_);
  }
  EXPECT_THAT(AwaitRead().message(), MatchesRegex("\"rho\": owner [01] of 2 answers no request for voxels"));
}

TEST_F(OwnerRulesTest, AnOwnerThatMakesABoxIsWaitedFor) {
  Register(true);
  EXPECT_EQ(Of<OwnerRefused>(Hear(3, Registration(1, 300))).size(), 1U) << "all owners or none make boxes on demand";
  opened_ = Open().value();
  EXPECT_TRUE(opened_->info().on_demand);
  EXPECT_EQ(opened_->info().levels[0].block, (Index3{512, 512, 16}));
  int ended = 0;
  Status made;
  const auto done = [&](const Status& status) {
    ++ended;
    made = status;
  };
  opened_->Make({{0, 0, 0}, kSides}, done);
  opened_->Make({{0, 0, 0}, {8, 8, 8}}, done);
  const auto asked = Of<ChunkRequest>(owners_->Tend(now_));
  ASSERT_EQ(asked.size(), 2U) << "each box once";
  for (int i = 0; i < 60; ++i) {
    now_ += seconds(1);
    for (const PeerToken peer : {1, 2}) Hear(peer, OwnerPing{.epoch = kEpoch, .making = true});
    owners_->Tend(now_);
  }
  EXPECT_EQ(ended, 0);
  for (const auto& [peer, request] : asked) {
    EXPECT_TRUE(request.in_place);
    if (peer == 1) {
      Chunk chunk{.epoch = kEpoch, .dataset = request.dataset, .box = request.box};
      const Bytes payload = PackChunk(Bytes(), Codec::kRaw, chunk);
      Hear(peer, chunk, payload);
      EXPECT_EQ(ended, 1);
      EXPECT_TRUE(made.ok()) << made.message();
    } else {
      Hear(peer, ChunkRefused{kEpoch, request.dataset, request.box, 0, Status::InvalidArgument("the sea is rough")});
      EXPECT_EQ(made.message(), "\"rho\": owner 1 of 2: the sea is rough");
    }
  }
  EXPECT_EQ(ended, 2);
}

TEST_F(OwnerRulesTest, ReadsEndWithTheCoordinator) {
  Register();
  Read();
  owners_.reset();
  EXPECT_EQ(AwaitRead().message(), "the coordinator ends");
}

TEST_F(OwnerRulesTest, ParametersAreSteeredAllOrNone) {
  RegisterOwner first = Registration(0, 100);
  first.steered = {{"feed", 0, 0.1, 0.03}, {"kill", 0, 1, 0.5}};
  const auto values = [](const Owners::News& news) { return Of<OwnerSteered>(news).at(0).second.values; };
  EXPECT_EQ(values(Hear(1, first)), (std::vector<double>{0.03, 0.5}));
  EXPECT_TRUE(Of<OwnerSteered>(Hear(2, Registration(1, 101))).empty());
  for (const PeerToken peer : {1, 2}) Hear(peer, OwnerTime{kEpoch, 5, 0.25});
  const SimulationStatus steered = owners_->Steer({.dataset = "rho", .values = {{"kill", 1}, {"feed", 0}}}).value();
  EXPECT_EQ(steered, (SimulationStatus{5, 0.25, {{"feed", 0, 0.1, 0}, {"kill", 0, 1, 1}}}));
  EXPECT_EQ(values(owners_->Tend(now_)), (std::vector<double>{0, 1}));

  const auto refusal = [&](const std::string& dataset, std::vector<SteeredValue> wanted) {
    return owners_->Steer({.dataset = dataset, .values = std::move(wanted)}).status().message();
  };
  EXPECT_EQ(refusal("rho", {{"kill", 0}, {"feed", 0.2}}), "\"rho\": feed is 0.2, must be in [0, 0.1]");
  EXPECT_EQ(refusal("rho", {{"kil\nl", 0}}), "\"rho\" has no parameter 'kil?l', must be one of: feed, kill");
  EXPECT_EQ(refusal("eta", {}), "no dataset \"eta\"");
  EXPECT_TRUE(Of<OwnerSteered>(owners_->Tend(now_)).empty());
  std::vector<DatasetStatus> datasets = {{.name = "eta"}, {.name = "rho"}};
  owners_->Describe(datasets);
  EXPECT_FALSE(datasets[0].simulation);
  EXPECT_EQ(datasets[1].simulation, steered);
}

TEST_F(OwnerRulesTest, SteeredValuesOutliveOwnerZero) {
  RegisterOwner first = Registration(0, 100);
  first.steered = {{"feed", 0, 0.1, 0.03}, {"kill", 0, 1, 0.5}};
  Hear(1, first);
  Hear(2, Registration(1, 101));
  EXPECT_TRUE(owners_->Steer({.dataset = "rho", .values = {{"feed", 0.1}, {"kill", 0.75}}}).ok());
  Hear(1, OwnerLeave{kEpoch});
  EXPECT_TRUE(owners_->Steer({.dataset = "rho", .values = {{"kill", 0.25}}}).ok()) << "for the one that comes";
  first.incarnation = 102;
  first.steered[0].most = 0.05;
  const auto values = [](const Owners::News& news) { return Of<OwnerSteered>(news).at(0).second.values; };
  EXPECT_EQ(values(Hear(3, first)), (std::vector<double>{0.05, 0.25}));
  Hear(3, OwnerLeave{kEpoch});
  first.steered[0].name = "fed";
  EXPECT_EQ(values(Hear(4, first)), (std::vector<double>{0.03, 0.5})) << "others begin as they are declared";
  Hear(4, OwnerLeave{kEpoch});
  first.steered.clear();
  Hear(5, first);
  EXPECT_EQ(owners_->Steer({.dataset = "rho", .values = {{"feed", 0}}}).status().message(), "\"rho\" has no parameters");
}

TEST_F(OwnerRulesTest, OthersAreRefused) {
  Register();
  const auto refusal = [&](PeerToken from, const RegisterOwner& m) {
    return Of<OwnerRefused>(Hear(from, m)).at(0).second.status.message();
  };
  EXPECT_THAT(refusal(3, Registration(1, 7)), HasSubstr("another process is this owner"));
  EXPECT_THAT(refusal(1, Registration(1, 101)), HasSubstr("this connection is that of another owner"));
  Hear(2, OwnerLeave{kEpoch});
  RegisterOwner other = Registration(1, 8);
  other.boxes[0].begin.z = 15;
  EXPECT_THAT(refusal(4, other), HasSubstr("\"rho\": owner 1 of 2: boxes of all owners overlap, or leave voxels out"));
  other.boxes[0].begin.z = 17;
  EXPECT_THAT(refusal(4, other), HasSubstr("overlap, or leave voxels out"));
  other.boxes = {{{0, 0, 15}, {512, 512, 31}}};  // as many voxels as are missing
  EXPECT_THAT(refusal(4, other), HasSubstr("overlap, or leave voxels out"));
  other = Registration(1, 8);
  other.description.mapping.scale = 2;
  EXPECT_THAT(refusal(4, other), HasSubstr("owners, description, samples, on_demand or fields differ from those of owner 0"));
  EXPECT_EQ(Of<OwnerWelcome>(Hear(4, Registration(1, 8))).size(), 1U);
  RegisterOwner wrong = Registration(0, 3);
  wrong.dataset = "other";
  wrong.samples = "int7";
  EXPECT_THAT(refusal(3, wrong), HasSubstr("samples is 'int7', must be one of: int8"));
  wrong.samples = "float32";
  EXPECT_THAT(refusal(3, wrong), HasSubstr("description.type is uint8, must be float32 for samples of float32"));
  wrong.samples = "int8";
  wrong.boxes[0].end.z = 33;
  EXPECT_THAT(refusal(3, wrong), HasSubstr("boxes[0] is empty, or not inside the volume"));
  EXPECT_EQ(Of<Retire>(Hear(3, OwnerPing{kEpoch, 1})).size(), 1U);
  EXPECT_EQ(Of<Retire>(Hear(1, OwnerPing{kEpoch + 1, 1})).size(), 1U) << "of another life of the coordinator";
}

TEST_F(OwnerRulesTest, LiesHurtNobodyElse) {
  Register();
  RegisterOwner grown = Registration(0, 100);
  grown.boxes[0].end.z = 17;
  EXPECT_THAT(Of<OwnerRefused>(Hear(1, grown)).at(0).second.status.message(), HasSubstr("overlap, or leave voxels out"));
  grown = Registration(0, 100);
  grown.description.geometry.size.x = 513;
  EXPECT_THAT(Of<OwnerRefused>(Hear(1, grown)).at(0).second.status.message(), HasSubstr("differ from those of owner 0"));
  opened_ = Open().value();
  for (const PeerToken peer : {1, 2}) Hear(peer, OwnerTime{kEpoch, 3, 0});
  EXPECT_EQ(Of<OwnerPong>(Hear(1, OwnerPing{kEpoch, 1})).at(0).second.used, (std::vector<std::uint64_t>{5})) << "times rise";

  Read();
  const auto asked = Of<ChunkRequest>(owners_->Tend(now_));
  const auto answer = [&](PeerToken from, const ChunkRequest& request, std::size_t bytes, std::uint64_t wrong = 0) {
    Chunk chunk{.epoch = kEpoch, .dataset = request.dataset, .box = request.box};
    const Bytes payload = PackChunk(Bytes(std::vector<std::byte>(bytes)), Codec::kRaw, chunk);
    chunk.digest += wrong;
    return Hear(from, chunk, payload);
  };
  const auto whole = [](const ChunkRequest& request) { return std::size_t(request.box.voxel_count()); };
  for (auto [peer, request] : asked) {
    answer(3 - peer, request, whole(request));  // of another owner's voxels
    answer(3, request, whole(request));
    request.dataset = 4;  // of a time that nobody asked for
    answer(peer, request, whole(request));
    request.box.end.z -= 1;
    answer(peer, request, whole(request));
  }
  EXPECT_FALSE(done_);
  for (const auto& [peer, request] : asked) answer(peer, request, peer == 1 ? whole(request) : 7);
  EXPECT_EQ(AwaitRead().message(), "\"rho\": an owner sent 7 bytes for a box");
  done_ = false;
  Read();
  for (const auto& [peer, request] : Of<ChunkRequest>(owners_->Tend(now_))) answer(peer, request, whole(request), 1);
  EXPECT_THAT(AwaitRead().message(), MatchesRegex("\"rho\": owner [01] of 2: payload: digest .*"));

  done_ = false;
  Read();
  const auto late = Of<ChunkRequest>(owners_->Tend(now_));
  Hear(2, OwnerLeave{kEpoch});
  for (const auto& [peer, request] : late) {
    EXPECT_EQ(Of<Retire>(answer(peer, request, whole(request))).size(), peer == 1 ? 0U : 1U) << "after its loss";
  }
  EXPECT_EQ(AwaitRead().message(), "\"rho\": owner 1 of 2 has left");
}

TEST_F(OwnerRulesTest, AnyMessagesInAnyOrderEndWell) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  constexpr Box kRead = {{0, 0, 8}, {8, 8, 24}};  // of both owners
  std::vector<std::pair<PeerToken, ChunkRequest>> asked;
  std::atomic<int> reads = 0, ended = 0;
  int datasets = 0, welcomes = 0;
  std::function<Result<std::shared_ptr<VolumeSource>>(Missing)> open;
  std::uint64_t hold = 0, later = 20;
  const auto count = [&](const Owners::News& news) {
    for (const OwnedData& data : news.datasets) {
      datasets += data.left ? -1 : data.came ? 1 : 0;
      if (data.came) open = data.came->open;
    }
  };
  // Whoever opens the volume waits until all owners say that they hold a time, or one is not there.
  const auto open_now = [&] {
    const Time in_test = std::exchange(now_, MonotonicNow());  // who opens it takes the time from the clock
    std::future<Result<std::shared_ptr<VolumeSource>>> opened = std::async(std::launch::async, open, Missing::kFail);
    for (int spins = 1; opened.wait_for(Duration::zero()) != std::future_status::ready; ++spins) {
      for (const PeerToken peer : {1, 2, 3, 4}) {
        for (const auto& [to, pong] : Of<OwnerPong>(Hear(peer, OwnerPing{kEpoch, 1, hold, 0}))) hold = pong.hold;
        if (spins % 100 == 0) count(Hear(peer, OwnerTime{kEpoch, later, 0}));
      }
      if (spins % 100 == 0) ++later;
      std::this_thread::yield();
    }
    now_ = in_test;
    return opened.get();
  };
  for (int i = 0; i < 20000; ++i) {
    const auto from = PeerToken(random.Integer(1, 4));
    const Epoch epoch = kEpoch + (random.Chance(0.05) ? 1 : 0);
    now_ += std::chrono::milliseconds(random.Integer(0, 400));
    Owners::News news;
    const int kind = random.Integer(0, 6);
    if (kind <= 1) {
      RegisterOwner m = Registration(random.Integer(0U, 1U), random.Integer<std::uint64_t>(100, 101));
      if (random.Chance(0.2)) m.boxes[0].end.z += random.Integer(-1, 17);
      news = Hear(from, m);
    } else if (kind == 2) {
      news = Hear(from, OwnerTime{epoch, random.Integer<std::uint64_t>(1, 20), 0});
    } else if (kind == 3) {
      news = random.Chance(0.05) ? Hear(from, OwnerLeave{epoch}) : Hear(from, OwnerPing{epoch, 1});
    } else if (kind == 4 && !asked.empty()) {
      const auto& [peer, request] = asked[random.Integer<std::size_t>(0, asked.size() - 1)];
      Chunk chunk{.epoch = epoch, .dataset = request.dataset, .box = request.box};
      const auto bytes = random.Chance(0.8) ? std::size_t(request.box.voxel_count()) : random.Integer<std::size_t>(1, 9);
      const Bytes payload = PackChunk(Bytes(std::vector<std::byte>(bytes)), Codec::kRaw, chunk);
      news = Hear(random.Chance(0.8) ? peer : from, chunk, payload);
    } else if (kind == 5 && open) {
      if (const auto opened = open_now(); opened.ok()) {
        ++reads;
        const auto samples = std::make_shared<std::vector<std::byte>>(std::size_t(kRead.voxel_count()));
        (*opened)->Read(0, kRead, BoxRoom::Dense(kRead, samples->data(), false), {}, [&ended, samples](const Status& status) {
          EXPECT_EQ(status.message().find('\n'), std::string::npos);
          ++ended;
          ended.notify_all();
        });
      }
    } else {
      news = owners_->Tend(now_);
    }
    for (const auto& each : Of<ChunkRequest>(news)) asked.push_back(each);
    if (asked.size() > 8) asked.erase(asked.begin(), asked.end() - 8);
    for (const auto& [to, refused] : Of<OwnerRefused>(news)) EXPECT_EQ(refused.status.message().find('\n'), std::string::npos);
    welcomes += int(Of<OwnerWelcome>(news).size());
    count(news);
    ASSERT_TRUE(datasets == 0 || datasets == 1) << "step " << i;
  }
  EXPECT_GT(welcomes, 100);
  EXPECT_GT(reads, 100);
  owners_.reset();
  for (int now = ended; now < reads; now = ended) ended.wait(now);
}

}  // namespace
}  // namespace slabstream
