// What the coordinator does about questions and about datasets that clients send, told as scripts.
#include "common/volume/memory_budget.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

SampleQuery Question(std::uint64_t nonce, const std::string& dataset = "block") {
  return {.nonce = nonce, .dataset = dataset, .points = {{1, 2, 3}}};
}

std::vector<Status> Refusals(const Actions& actions) {
  std::vector<Status> refused;
  for (const auto& sent : ToClients<OrderRefused>(actions)) refused.push_back(sent.message.status);
  return refused;
}

class QuestionRules : public testing::Test {
 protected:
  Actions Loaded(std::uint64_t bytes = 0, std::shared_ptr<const FileStamp> stamp = nullptr) {
    const LoadDataset& load = script.loads.back();
    return script.Step(DatasetLoaded{load.name, load.load, load.load, BlockSummary(), bytes, std::move(stamp)});
  }
  CoordinatorScript script;
};

TEST_F(QuestionRules, AQuestionLoadsItsDatasetAndIsAskedOfTheExecutorThen) {
  EXPECT_THAT(Of<AnswerQuestion>(script.Client(kClient, Question(5))), IsEmpty());
  ASSERT_THAT(script.loads, SizeIs(1));
  const auto asked = Of<AnswerQuestion>(Loaded());
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].dataset, script.loads[0].load);
  EXPECT_EQ(script.machine.sizes().questions, 1U);
  const auto answers = ToClients<SampleReply>(script.Step(QuestionAnswered{asked[0].id, QuestionReply(SampleReply{.nonce = 5})}));
  ASSERT_THAT(answers, SizeIs(1));
  EXPECT_EQ(answers[0].to, kClient);
  EXPECT_EQ(script.machine.sizes().questions, 0U);
  EXPECT_THAT(Of<AnswerQuestion>(script.Client(kOther, Question(1))), SizeIs(1)) << "it is loaded";
}

TEST_F(QuestionRules, AnAnswerWaitsForALookAtTheFiles) {
  script.Client(kClient, Question(1));
  const auto stamp = std::make_shared<const FileStamp>();
  const auto first = Of<AnswerQuestion>(Loaded(0, stamp));
  EXPECT_THAT(first, SizeIs(1)) << "it was read after the question";
  const Actions second = script.Client(kClient, Question(2));
  EXPECT_THAT(Of<AnswerQuestion>(second), IsEmpty());
  ASSERT_THAT(Of<CheckDatasetFiles>(second), SizeIs(1));
  // The files have changed: the answer is of the new ones.
  const Actions changed = script.Step(DatasetSeen{"block", script.loads.back().load, true});
  EXPECT_THAT(Of<AnswerQuestion>(changed), IsEmpty());
  ASSERT_THAT(script.loads, SizeIs(2));
  const auto asked = Of<AnswerQuestion>(Loaded(0, stamp));
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].dataset, script.loads[1].load);
}

TEST_F(QuestionRules, WhatCannotBeAnsweredIsRefusedWithTheReason) {
  EXPECT_THAT(Refusals(script.Client(kClient, Question(1, "none"))), SizeIs(1));
  script.Client(kClient, Question(2));
  const auto failed = Refusals(script.Step(DatasetFailed{"block", script.loads.back().load, Status::DataLoss("block.nrrd ends early")}));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0], Status::DataLoss("block.nrrd ends early"));
  script.Client(kClient, Question(3));
  EXPECT_THAT(Refusals(script.Client(kOther, DataOrder{.action = DataAction::kRemove, .items = {"block"}})), SizeIs(1));
  EXPECT_EQ(script.machine.sizes().questions, 0U);
}

TEST_F(QuestionRules, AClientHasOnlySoManyAndNoneAfterItHasGone) {
  for (std::size_t i = 0; i < kMaxOpenQuestions; ++i) EXPECT_THAT(Refusals(script.Client(kClient, Question(i))), IsEmpty());
  EXPECT_EQ(Refusals(script.Client(kClient, Question(999))).at(0).code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(Refusals(script.Client(kOther, Question(1))), IsEmpty());
  script.Step(ClientGone{kClient});
  EXPECT_EQ(script.machine.sizes().questions, 1U);
  EXPECT_THAT(Refusals(script.Step(CoordinatorStopRequested{})), SizeIs(1));
}

TEST_F(QuestionRules, APongTellsWhichOnesTheCoordinatorDoesNotKnow) {
  const auto lost = [this](PeerToken from) {
    const auto pongs = ToClients<ClientPong>(script.Client(from, ClientPing{.nonce = 9, .open = {7}, .asked = {1, 2, 3}}));
    EXPECT_THAT(pongs, SizeIs(1));
    EXPECT_EQ(pongs.at(0).message.nonce, 9U);
    EXPECT_EQ(pongs.at(0).message.known, std::vector<RequestId>(from == kClient ? 1 : 0, 7));
    return pongs.at(0).message.lost;
  };
  script.Client(kClient, Frame(7));
  script.Client(kClient, Question(1));
  script.Client(kClient, DataOrder{.nonce = 2, .action = DataAction::kAdd, .items = {"/ball.nrrd"}});
  EXPECT_THAT(lost(kClient), ElementsAre(3U)) << "an order and a question are open";
  EXPECT_THAT(lost(kOther), ElementsAre(1U, 2U, 3U)) << "they are another's, such as the same client's before its connection broke";
  const auto asked = Of<AnswerQuestion>(Loaded());
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_THAT(lost(kClient), ElementsAre(3U)) << "it is being answered";
  script.Step(QuestionAnswered{asked[0].id, QuestionReply(SampleReply{.nonce = 1})});
  EXPECT_THAT(lost(kClient), ElementsAre(1U, 3U)) << "the answer was sent before the pong";
}

TEST_F(QuestionRules, ADatasetThatDoesNotFitIsRefused) {
  ScriptConfig config = TestConfig();
  config.memory_bytes = 400;
  CoordinatorScript small(config);
  small.Client(kClient, Question(1));
  const Actions full = small.Step(DatasetLoaded{"block", small.loads.back().load, 7, BlockSummary(), 301});
  EXPECT_EQ(Refusals(full).at(0).code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(Of<UnloadDataset>(full), SizeIs(1));
  EXPECT_THAT(Of<AnswerQuestion>(full), IsEmpty());
}

// ---------------------------------------------------------------- datasets that clients send

class UploadRules : public testing::Test {
 protected:
  // Of 24 MiB.
  static AddVolume Order(std::uint64_t nonce, const std::string& name = "sent") {
    AddVolume order{.nonce = nonce, .name = name};
    order.description.geometry.size = {512, 512, 96};
    return order;
  }
  static VolumePart Part(std::uint64_t begin, std::uint32_t bytes = kMaxVolumePartBytes, std::uint64_t nonce = 1) {
    return {.nonce = nonce, .begin = begin, .bytes = bytes};
  }
  Actions Send(const VolumePart& part, PeerToken from = kClient) {
    return script.Client(from, part, Bytes(std::vector<std::byte>(part.bytes)));
  }
  UploadId Begin(PeerToken from = kClient, const AddVolume& order = Order(1)) {
    const auto begun = Of<BeginUpload>(script.Client(from, order));
    EXPECT_THAT(begun, SizeIs(1));
    return begun.empty() ? 0 : begun[0].upload;
  }
  // The last credit, after the room was found.
  VolumeCredit Admit(UploadId upload) {
    const auto credits = ToClients<VolumeCredit>(script.Step(UploadBegun{upload, Status::Ok()}));
    EXPECT_THAT(credits, SizeIs(1));
    return credits.at(0).message;
  }
  CoordinatorScript script;
};

TEST_F(UploadRules, BytesComeInOrderWithinTheCreditAndBecomeADataset) {
  const UploadId upload = Begin();
  std::uint64_t allowed = Admit(upload).allowed, sent = 0;
  EXPECT_EQ(allowed, 8 * kMebi);
  int finished = 0;
  while (sent < BytesToSend(Order(1))) {
    ASSERT_LE(sent + kMaxVolumePartBytes, allowed) << "the credit comes before it is used up";
    const Actions actions = Send(Part(sent));
    const auto stored = Of<StoreUpload>(actions);
    ASSERT_THAT(stored, SizeIs(1));
    EXPECT_EQ(stored[0].begin, sent);
    sent += kMaxVolumePartBytes;
    for (const auto& credit : ToClients<VolumeCredit>(actions)) {
      EXPECT_EQ(credit.message.received, sent);
      EXPECT_LE(credit.message.allowed - sent, 8 * kMebi);
      allowed = credit.message.allowed;
    }
    finished += int(Of<FinishUpload>(actions).size());
  }
  EXPECT_EQ(finished, 1);
  DataSource source("", "");
  source.load = [](const TellRead&) -> Result<LoadedData> { return LoadedData{}; };
  source.held_bytes = BytesToSend(Order(1));
  const Actions done = script.Step(UploadFinished{upload, source});
  const auto replies = ToClients<DataReply>(done);
  ASSERT_THAT(replies, SizeIs(1));
  EXPECT_EQ(replies[0].message.nonce, 1U);
  EXPECT_EQ(replies[0].message.datasets.size(), 3U);
  EXPECT_EQ(script.machine.sizes().uploads, 0U);
  // Every client sees it, and it can be removed.
  EXPECT_THAT(script.Submit(kOther, Frame(1, 1, "sent")), testing::Not(IsEmpty()));
  EXPECT_EQ(script.loads.back().name, "sent");
  EXPECT_THAT(Refusals(script.Client(kOther, DataOrder{.action = DataAction::kRemove, .items = {"sent"}})), IsEmpty());
}

TEST_F(UploadRules, OtherBytesThanTheNextOnesEndIt) {
  const std::vector<VolumePart> hostile = {Part(kMaxVolumePartBytes), Part(~std::uint64_t{0}), Part(1)};
  for (const VolumePart& part : hostile) {
    Admit(Begin());
    const Actions ended = Send(part);
    EXPECT_EQ(Refusals(ended).at(0).code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(Of<DropUpload>(ended), SizeIs(1));
    EXPECT_THAT(Of<StoreUpload>(ended), IsEmpty());
    EXPECT_THAT(Send(Part(0)), IsEmpty()) << "late parts are dropped";
  }
  // Before there is any credit, and beyond it.
  const UploadId upload = Begin();
  EXPECT_THAT(Refusals(Send(Part(0))), SizeIs(1));
  Admit(Begin());
  Actions last;
  for (std::uint64_t begin = 0; begin < 9 * kMebi && Refusals(last).empty(); begin += kMaxVolumePartBytes) last = Send(Part(begin));
  EXPECT_EQ(script.machine.sizes().uploads, 1U) << "credit is granted as parts come";
  // Beyond the end of the volume.
  AddVolume tiny = Order(1, "tiny");
  tiny.description.geometry.size = {2, 2, 2};
  Admit(Begin(kClient, tiny));
  EXPECT_THAT(Refusals(Send(Part(0, 9))), SizeIs(1));
  EXPECT_THAT(script.Step(UploadBegun{upload, Status::Ok()}), IsEmpty()) << "of one that has ended";
}

TEST_F(UploadRules, AClientThatFallsSilentLeavesNothing) {
  const UploadId upload = Begin();
  Admit(upload);
  Send(Part(0));
  const Actions silent = script.Pass(seconds(11));
  ASSERT_THAT(Of<DropUpload>(silent), SizeIs(1));
  EXPECT_EQ(Of<DropUpload>(silent)[0].upload, upload);
  EXPECT_EQ(script.machine.sizes().uploads, 0U);
  EXPECT_EQ(script.machine.sizes().clients, 0U);
  EXPECT_THAT(Of<BeginUpload>(script.Client(kOther, Order(1))), SizeIs(1)) << "its name is free";
  script.Step(ClientGone{kOther});
  EXPECT_EQ(script.machine.sizes().uploads, 0U);
}

TEST_F(UploadRules, AClientThatPingsMayTakeItsTime) {
  Admit(Begin());
  script.clients.push_back(kClient);
  EXPECT_THAT(Of<DropUpload>(script.Pass(seconds(60))), IsEmpty());
  EXPECT_THAT(Of<StoreUpload>(Send(Part(0))), SizeIs(1));
}

TEST_F(UploadRules, NamesAreOfOneDatasetOnly) {
  Begin();
  EXPECT_THAT(Refusals(script.Client(kOther, Order(1))).at(0).message(), HasSubstr("on its way from another client"));
  EXPECT_THAT(Refusals(script.Client(kOther, Order(1, "block"))).at(0).message(), HasSubstr("there is already a dataset named \"block\""));
  EXPECT_THAT(Refusals(script.Client(kOther, Order(1, "../etc"))).at(0).message(), HasSubstr("letters, digits"));
  // A client has one at a time.
  const Actions again = script.Client(kClient, Order(2, "second"));
  EXPECT_EQ(Refusals(again).at(0).code(), StatusCode::kCancelled);
  EXPECT_THAT(Of<DropUpload>(again), SizeIs(1));
  EXPECT_EQ(script.machine.sizes().uploads, 1U);
  EXPECT_EQ(Refusals(script.Client(kClient, DropVolume{2})).at(0).code(), StatusCode::kCancelled);
  EXPECT_EQ(script.machine.sizes().uploads, 0U);
}

TEST_F(UploadRules, MemoryAdmitsThem) {
  ScriptConfig config = TestConfig();
  config.memory_bytes = 64 * kMebi;  // 48 of them for datasets
  CoordinatorScript tight(config);
  tight.Client(kClient, Frame(1));
  tight.Step(DatasetLoaded{"block", tight.loads.back().load, 7, BlockSummary(), 20 * kMebi});
  tight.Client(kClient, CancelFrame{1});
  EXPECT_THAT(Of<BeginUpload>(tight.Client(kClient, Order(1))), SizeIs(1));
  // 24 + 24 fit if what nobody uses goes.
  const Actions second = tight.Client(kOther, Order(1, "second"));
  EXPECT_THAT(Of<UnloadDataset>(second), SizeIs(1));
  EXPECT_THAT(Of<BeginUpload>(second), SizeIs(1));
  const Actions third = tight.Client(77, Order(1, "third"));
  EXPECT_EQ(Refusals(third).at(0).code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(Refusals(third).at(0).message(), HasSubstr("--memory"));
  EXPECT_EQ(tight.QueryStatus().refused.too_large, 1U);
}

// A file of 1 MiB that is a dataset.
class FileRules : public UploadRules {
 protected:
  static AddVolume File(std::uint64_t nonce, const std::string& name) {
    return {.nonce = nonce, .name = name, .description = {}, .labels = {}, .file = SentFile{name + ".nii", kMebi}};
  }
  Actions Arrive(PeerToken from, std::uint64_t nonce, const std::string& name) {
    const UploadId upload = Begin(from, File(nonce, name));
    EXPECT_EQ(Admit(upload).allowed, kMebi);
    Send(Part(0, kMaxVolumePartBytes, nonce), from);
    EXPECT_THAT(Of<FinishUpload>(Send(Part(kMaxVolumePartBytes, kMaxVolumePartBytes, nonce), from)), SizeIs(1));
    return script.Step(UploadFinished{upload, DataSource("/somewhere/" + name + ".nii", "")});
  }
};

TEST_F(FileRules, TheClientThatHasSentAFileRemovesIt) {
  EXPECT_THAT(ToClients<DataReply>(Arrive(kClient, 1, "one")), SizeIs(1));
  Arrive(kClient, 2, "two");
  EXPECT_EQ(script.QueryStatus().datasets.size(), 4U);
  EXPECT_THAT(script.Client(kOther, DropVolume{1}), IsEmpty()) << "it is not its own";
  EXPECT_EQ(Refusals(script.Client(kClient, DropVolume{1})).at(0).code(), StatusCode::kCancelled);
  EXPECT_EQ(script.QueryStatus().datasets.size(), 3U);
  EXPECT_THAT(script.Client(kClient, DropVolume{1}), IsEmpty()) << "it is gone already";
  EXPECT_THAT(Of<BeginUpload>(script.Client(kClient, File(3, "one"))), SizeIs(1)) << "its name is free";
}

TEST_F(FileRules, APongTellsWhichOnesTheCoordinatorDoesNotHave) {
  const auto lost = [this](PeerToken from) {
    return ToClients<ClientPong>(script.Client(from, ClientPing{.asked = {1, 2}})).at(0).message.lost;
  };
  Arrive(kClient, 1, "one");
  Begin(kClient, File(2, "two"));
  EXPECT_THAT(lost(kClient), IsEmpty()) << "one is there, one on its way";
  EXPECT_THAT(lost(kOther), ElementsAre(1U, 2U));
  script.Client(kOther, DataOrder{.action = DataAction::kRemove, .items = {"one"}});
  EXPECT_THAT(lost(kClient), ElementsAre(1U)) << "an admin has removed it";
}

TEST_F(FileRules, FilesGoWithTheirClient) {
  Arrive(kClient, 1, "one");
  Arrive(kOther, 1, "two");
  script.clients.push_back(kOther);  // pings
  script.Pass(seconds(11));
  const auto datasets = script.QueryStatus().datasets;
  EXPECT_EQ(std::ranges::count(datasets, "one", &DatasetStatus::name), 0);
  EXPECT_EQ(std::ranges::count(datasets, "two", &DatasetStatus::name), 1);
}

TEST_F(FileRules, FilesTakeMemoryAsLongAsTheyAreThere) {
  ScriptConfig config = TestConfig();
  config.memory_bytes = 2 * kMebi;  // 1.5 of them for datasets
  CoordinatorScript tight(config);
  const UploadId upload = Of<BeginUpload>(tight.Client(kClient, File(1, "one"))).at(0).upload;
  tight.Step(UploadBegun{upload, Status::Ok()});
  tight.Client(kClient, Part(0), Bytes(std::vector<std::byte>(kMaxVolumePartBytes)));
  tight.Client(kClient, Part(kMaxVolumePartBytes), Bytes(std::vector<std::byte>(kMaxVolumePartBytes)));
  tight.Step(UploadFinished{upload, DataSource("/somewhere/one.nii", "")});
  EXPECT_EQ(Refusals(tight.Client(kOther, File(1, "two"))).at(0).code(), StatusCode::kResourceExhausted);
  // An admin may remove it, too.
  EXPECT_THAT(Refusals(tight.Client(kOther, DataOrder{.action = DataAction::kRemove, .items = {"one"}})), IsEmpty());
  EXPECT_THAT(Of<BeginUpload>(tight.Client(kOther, File(2, "two"))), SizeIs(1));
}

TEST_F(UploadRules, AnUndecodablePartEndsIt) {
  Admit(Begin());
  const Status why = Status::InvalidArgument("VolumePart with a payload of 7 bytes");
  const Actions ended = script.Step(BadRequest{kClient, OrderRefused{1, why}, why});
  EXPECT_THAT(Of<DropUpload>(ended), SizeIs(1));
  EXPECT_EQ(Refusals(ended).at(0), why);
  EXPECT_THAT(Refusals(ended), SizeIs(1));
}

}  // namespace
}  // namespace slabstream
