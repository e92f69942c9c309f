// The client against a service that the test plays: silent, forgetful, hostile.
#include "client/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "tests/client/fake_service.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

TEST_F(ClientTest, NobodyAnswers) {
  Socket silent = Socket::Router(context_).value();
  const std::string endpoint = silent.Bind("tcp://127.0.0.1:*").value();
  const Result<Client> client = Client::Connect(context_, endpoint, milliseconds(200));
  EXPECT_EQ(client.status().code(), StatusCode::kUnavailable);
  EXPECT_THAT(client.status().message(), testing::AllOf(HasSubstr(endpoint), HasSubstr("200 ms")));
}

// A service of another release answers with its version alone.
TEST_F(ClientTest, AServiceOfAnotherVersionIsNamed) {
  FakeService service(context_, "inproc://client-test", [](const AnyMessage&) -> std::vector<Answer> { return {}; });
  service.SpeakAnotherVersion();
  const Result<Client> client = Client::Connect(context_, service.endpoint(), seconds(30));
  EXPECT_EQ(client.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(client.status().message(),
              testing::AllOf(HasSubstr(service.endpoint()), HasSubstr(TextOfOtherVersion(FakeService::kAnotherVersion))));
}

TEST_F(ClientTest, AServiceThatIsReplacedByAnotherVersionEndsWhatIsOpen) {
  FakeService service(context_, "tcp://127.0.0.1:*", Answering([](const AnyMessage&) -> std::vector<Answer> { return {}; }));
  Client client = Client::Connect(context_, service.endpoint(), seconds(30)).value();
  service.SpeakAnotherVersion();
  const RequestId request = client.Submit(SmallRequest());
  const std::optional<ClientEvent> event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<Status>(event->what));
  EXPECT_EQ(event->request, request);
  EXPECT_THAT(std::get<Status>(event->what).message(), HasSubstr(TextOfOtherVersion(FakeService::kAnotherVersion)));
}

TEST_F(ClientTest, BadEndpointIsRefusedAtOnce) {
  EXPECT_EQ(Client::Connect(context_, "tcp://8.8.8.8:7420").status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Client::Connect(context_, "here").status().code(), StatusCode::kInvalidArgument);
}

TEST_F(ClientTest, ProgressPreviewAndPicture) {
  FakeService service(context_, "inproc://client-test", [](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message)) return {{PongTo(*ping), {}}};
    const auto* submit = std::get_if<SubmitFrame>(&message);
    if (submit == nullptr) return {};
    return {{FrameProgress{.request = submit->request, .phase = FramePhase::kRunning, .group_count = 2}, {}},
            ReplyTo(submit->request, 1, 2, Codec::kRaw),
            ReplyTo(submit->request, 2, 2)};
  });
  Client client = Client::Connect(context_, service.endpoint()).value();
  const RequestId id = client.Submit(SmallRequest());
  std::optional<ClientEvent> event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<FrameProgress>(event->what));
  event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<Picture>(event->what));
  EXPECT_FALSE(std::get<Picture>(event->what).final);
  event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<Picture>(event->what));
  const auto& picture = std::get<Picture>(event->what);
  EXPECT_EQ(event->request, id);
  EXPECT_TRUE(picture.final);
  EXPECT_GT(picture.latency, Duration::zero());
  EXPECT_EQ(picture.image.bounds(), (PixelBounds{4, 6, 20, 18}));
  EXPECT_EQ(picture.image.floats()->rgba[3], 0.5F);
  EXPECT_FALSE(client.Next(Duration::zero()).has_value());
}

TEST_F(ClientTest, SilentServiceEndsEveryOpenRequest) {
  std::atomic<bool> answer = true;
  FakeService service(context_, "tcp://127.0.0.1:*", [&](const AnyMessage& message) -> std::vector<Answer> {
    const auto* ping = std::get_if<ClientPing>(&message);
    if (ping == nullptr || !answer) return {};
    return {{PongTo(*ping), {}}};
  });
  Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
  answer = false;
  std::set<RequestId> open = {client.Submit(SmallRequest()), client.Submit(SmallRequest())};
  while (!open.empty()) {
    const std::optional<ClientEvent> event = client.Next(seconds(30));
    ASSERT_TRUE(event.has_value());
    const auto* status = std::get_if<Status>(&event->what);
    ASSERT_NE(status, nullptr);
    EXPECT_EQ(status->code(), StatusCode::kUnavailable);
    EXPECT_THAT(status->message(), HasSubstr(service.endpoint()));
    EXPECT_EQ(open.erase(event->request), 1U);
  }
}

// However long its threads wait for a processor.
TEST_F(ClientTest, AServiceOfThisProcessIsNeverTooSlow) {
  std::atomic<RequestId> request = 0;
  std::atomic<int> unanswered = 0;
  FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* submit = std::get_if<SubmitFrame>(&message)) request = submit->request;
    const auto* ping = std::get_if<ClientPing>(&message);
    if (ping == nullptr) return {};
    if (request == 0) return {{PongTo(*ping), {}}};
    if (++unanswered < 5) return {};
    return {ReplyTo(request)};
  });
  // No answer to a ping is quick enough.
  const ClientTiming none = {.ping = milliseconds(20), .silence = Duration::zero()};
  Client client = Client::Connect(context_, service.endpoint(), seconds(5), none).value();
  const Result<Picture> picture = client.Render(SmallRequest());
  EXPECT_TRUE(picture.ok()) << picture.status().message();
}

TEST_F(ClientTest, AServiceOfThisProcessThatHasEndedEndsEveryRequest) {
  std::optional<FakeService> service(std::in_place, context_, "inproc://client-test",
                                     Answering([](const AnyMessage&) -> std::vector<Answer> { return {}; }));
  Client client = Client::Connect(context_, service->endpoint(), seconds(5), quick_).value();
  const RequestId request = client.Submit(SmallRequest());
  service.reset();
  const std::optional<ClientEvent> event = client.Next(seconds(60));
  ASSERT_TRUE(event && std::holds_alternative<Status>(event->what));
  EXPECT_EQ(event->request, request);
  EXPECT_EQ(std::get<Status>(event->what).code(), StatusCode::kUnavailable);
  EXPECT_THAT(std::get<Status>(event->what).message(), HasSubstr("inproc://client-test has ended"));
}

TEST_F(ClientTest, RequestThatTheServiceForgotIsSubmittedAgain) {
  std::atomic<int> submits = 0;
  FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message)) return {{ClientPong{.epoch = 1, .nonce = ping->nonce}, {}}};
    const auto* submit = std::get_if<SubmitFrame>(&message);
    if (submit == nullptr || ++submits < 3) return {};  // forgets it twice
    return {ReplyTo(submit->request)};
  });
  Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
  const Result<Picture> picture = client.Render(SmallRequest());
  EXPECT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_EQ(submits, 3);
}

// A service that says in every pong that it has no request.
auto ForgetsAndCounts(std::atomic<int>& submits) {
  return [&submits](const AnyMessage& message) -> std::vector<Answer> {
    if (std::holds_alternative<SubmitFrame>(message)) ++submits;
    const auto* ping = std::get_if<ClientPing>(&message);
    if (ping == nullptr) return {};
    return {{ClientPong{.epoch = 1, .nonce = ping->nonce}, {}}};
  };
}

TEST_F(ClientTest, RequestThatTheServiceAlwaysForgetsFails) {
  std::atomic<int> submits = 0;
  FakeService service(context_, "inproc://client-test", ForgetsAndCounts(submits));
  Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
  EXPECT_EQ(client.Render(SmallRequest()).status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(submits, 4);  // once, and three times again
}

TEST_F(ClientTest, RequestThatWasCancelledIsNotSubmittedToTheNextCoordinator) {
  std::atomic<int> submits = 0;
  FakeService service(context_, "inproc://client-test", ForgetsAndCounts(submits));
  Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
  const RequestId id = client.Submit(SmallRequest());
  client.Cancel(id);  // which the first coordinator took with it
  const std::optional<ClientEvent> event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<Status>(event->what));
  EXPECT_EQ(std::get<Status>(event->what).code(), StatusCode::kCancelled);
  EXPECT_EQ(submits, 1);
}

// Its deadline is a promise: it does not begin anew.
TEST_F(ClientTest, RequestThatWasLostKeepsItsDeadline) {
  std::vector<std::uint32_t> deadlines;  // written by the service's thread, read when that has ended
  {
    FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
      if (const auto* submit = std::get_if<SubmitFrame>(&message)) deadlines.push_back(submit->deadline_ms);
      const auto* ping = std::get_if<ClientPing>(&message);
      if (ping == nullptr) return {};
      return {{ClientPong{.epoch = 1, .nonce = ping->nonce}, {}}};
    });
    Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
    EXPECT_EQ(client.Render(SmallRequest(), seconds(600)).status().code(), StatusCode::kUnavailable);
    EXPECT_EQ(client.Render(SmallRequest(), milliseconds(1)).status().code(), StatusCode::kDeadlineExceeded);
  }
  ASSERT_EQ(deadlines.size(), 5U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(deadlines[i], deadlines[i - 1]) << i;
}

SummaryReply AnySummary(std::uint64_t nonce) {
  SummaryReply reply{.nonce = nonce};
  reply.description.geometry.size = {1, 1, 1};
  reply.transfer = {.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.5}}};
  return reply;
}

// A service that has lost what it was asked, `times` times each, and then answers questions. It counts what it was asked.
auto LosesAndCounts(int times, std::map<std::string, int>& asked) {
  return [times, &asked](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message))
      return {{ClientPong{.epoch = 1, .nonce = ping->nonce, .known = ping->open, .lost = ping->asked}, {}}};
    if (const auto* query = std::get_if<SummaryQuery>(&message)) {
      if (++asked["question"] <= times) return {};
      return {{AnySummary(query->nonce), {}}};
    }
    if (const auto* query = std::get_if<StatusQuery>(&message)) {
      if (++asked["status"] <= times) return {};
      return {{StatusReply{.nonce = query->nonce}, {}}};
    }
    if (const auto* order = std::get_if<DataOrder>(&message)) {
      if (++asked[order->action == DataAction::kList ? "list" : "order"] <= times) return {};
      return {{DataReply{.nonce = order->nonce}, {}}};
    }
    if (const auto* order = std::get_if<SteerDataset>(&message)) ++asked[order->values.empty() ? "parameters" : "steer"];
    if (std::holds_alternative<ShutDown>(message)) ++asked["end"];
    return {};
  };
}

TEST_F(ClientTest, QuestionsThatTheServiceForgotAreAskedAgain) {
  std::map<std::string, int> asked;
  {
    FakeService service(context_, "inproc://client-test", LosesAndCounts(3, asked));
    Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
    EXPECT_TRUE(client.Summarize({.dataset = "ball"}).ok());
    EXPECT_TRUE(client.QueryStatus(seconds(60)).ok());
    EXPECT_TRUE(client.OrderData({}, seconds(60)).ok());
  }
  EXPECT_EQ(asked, (std::map<std::string, int>{{"question", 4}, {"status", 4}, {"list", 4}}));
}

TEST_F(ClientTest, QuestionsThatTheServiceAlwaysForgetsFail) {
  std::map<std::string, int> asked;
  {
    FakeService service(context_, "inproc://client-test", LosesAndCounts(1000, asked));
    Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
    const Status failed = client.Summarize({.dataset = "ball"}).status();
    EXPECT_EQ(failed.code(), StatusCode::kUnavailable);
    EXPECT_THAT(failed.message(), testing::AllOf(HasSubstr(service.endpoint()), HasSubstr("lost the request 4 times")));
    EXPECT_EQ(client.Summarize({.dataset = "ball"}, milliseconds(1)).status().code(), StatusCode::kDeadlineExceeded);
    EXPECT_EQ(client.Steer({.dataset = "ball"}, seconds(60)).status().code(), StatusCode::kUnavailable);
  }
  EXPECT_EQ(asked, (std::map<std::string, int>{{"question", 5}, {"parameters", 4}}));
}

// They may have been carried out before.
TEST_F(ClientTest, OrdersThatTheServiceForgotFailAndAreNotSentAgain) {
  std::map<std::string, int> asked;
  {
    FakeService service(context_, "inproc://client-test", LosesAndCounts(1000, asked));
    Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
    for (const DataAction action : {DataAction::kAdd, DataAction::kRemove, DataAction::kReload}) {
      const Status failed = client.OrderData({.action = action, .items = {"/ball.nrrd"}}, seconds(60)).status();
      EXPECT_EQ(failed.code(), StatusCode::kUnavailable);
      EXPECT_THAT(failed.message(), HasSubstr("the order may have been carried out or not"));
    }
    EXPECT_EQ(client.Steer({.dataset = "ball", .values = {{"feed", 1}}}, seconds(60)).status().code(), StatusCode::kUnavailable);
    EXPECT_EQ(client.ShutDownService(seconds(60)).code(), StatusCode::kUnavailable);
  }
  EXPECT_EQ(asked, (std::map<std::string, int>{{"order", 3}, {"steer", 1}, {"end", 1}}));
}

TEST_F(ClientTest, AQuestionThatWasCancelledIsNotAskedAgain) {
  std::map<std::string, int> asked;
  {
    FakeService service(context_, "inproc://client-test", LosesAndCounts(1000, asked));
    Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
    client.Cancel(client.Submit(SummaryQuery{.dataset = "ball"}));
    EXPECT_EQ(client.Steer({.dataset = "ball"}, seconds(60)).status().code(), StatusCode::kUnavailable);
  }
  EXPECT_EQ(asked, (std::map<std::string, int>{{"question", 1}, {"parameters", 4}}));
}

// However many pings it takes.
TEST_F(ClientTest, AQuestionThatTheServiceKnowsIsAskedOnce) {
  std::atomic<int> asked = 0, pings = 0;
  std::atomic<std::uint64_t> nonce = 0;
  FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* query = std::get_if<SummaryQuery>(&message)) {
      ++asked;
      nonce = query->nonce;
    }
    const auto* ping = std::get_if<ClientPing>(&message);
    if (ping == nullptr) return {};
    if (nonce != 0) {
      EXPECT_THAT(ping->asked, testing::ElementsAre(nonce.load()));
    }
    if (++pings < 10) return {{PongTo(*ping), {}}};
    return {{AnySummary(nonce), {}}};
  });
  Client client = Client::Connect(context_, service.endpoint(), seconds(5), quick_).value();
  EXPECT_TRUE(client.Summarize({.dataset = "ball"}).ok());
  EXPECT_EQ(asked, 1);
}

TEST_F(ClientTest, BadRequestFailsBeforeItIsSent) {
  FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
    EXPECT_FALSE(std::holds_alternative<SubmitFrame>(message));
    const auto* ping = std::get_if<ClientPing>(&message);
    if (ping == nullptr) return {};
    return {{PongTo(*ping), {}}};
  });
  Client client = Client::Connect(context_, service.endpoint()).value();
  FrameRequest request = SmallRequest();
  request.size.width = 0;
  const Result<Picture> picture = client.Render(request);
  EXPECT_EQ(picture.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(picture.status().message(), HasSubstr("width"));
}

TEST_F(ClientTest, CancelAsksTheServiceAndItsAnswerEndsTheRequest) {
  FakeService service(context_, "inproc://client-test", [](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message)) return {{PongTo(*ping), {}}};
    const auto* cancel = std::get_if<CancelFrame>(&message);
    if (cancel == nullptr) return {};
    return {{FrameFailed{cancel->request, Status::Cancelled("as the client asked")}, {}}, ReplyTo(cancel->request)};
  });
  Client client = Client::Connect(context_, service.endpoint()).value();
  const RequestId id = client.Submit(SmallRequest());
  client.Cancel(id);
  const std::optional<ClientEvent> event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<Status>(event->what));
  EXPECT_EQ(std::get<Status>(event->what).code(), StatusCode::kCancelled);
  EXPECT_TRUE(client.QueryStatus(milliseconds(50)).status().code() == StatusCode::kUnavailable);
  EXPECT_FALSE(client.Next(Duration::zero()).has_value()) << "the late picture of an ended request is dropped";
}

TEST_F(ClientTest, AnAnswerLeavesTheEventsOfOthers) {
  FakeService service(context_, "inproc://client-test", Answering([](const AnyMessage& message) -> std::vector<Answer> {
                        if (const auto* query = std::get_if<StatusQuery>(&message)) return {{StatusReply{.nonce = query->nonce}, {}}};
                        if (const auto* query = std::get_if<SampleQuery>(&message))
                          return {{SampleReply{.nonce = query->nonce, .samples = {VolumeSample{}}}, {}}};
                        const auto* submit = std::get_if<SubmitFrame>(&message);
                        if (submit == nullptr) return {};
                        return {{FrameProgress{.request = submit->request}, {}}, ReplyTo(submit->request)};
                      }));
  Client client = Client::Connect(context_, service.endpoint()).value();
  const RequestId frame = client.Submit(SmallRequest());
  const RequestId question = client.Submit(SampleQuery{.dataset = "ball", .points = {{}}});
  EXPECT_TRUE(client.QueryStatus(seconds(30)).ok());
  EXPECT_EQ(client.SampleAt({.dataset = "ball", .points = {{}}}, seconds(30)).value().size(), 1U);
  EXPECT_TRUE(client.Render(SmallRequest()).ok());
  std::optional<ClientEvent> event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<FrameProgress>(event->what));
  event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<Picture>(event->what));
  EXPECT_EQ(event->request, frame);
  event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<QuestionReply>(event->what));
  EXPECT_EQ(event->request, question);
  EXPECT_FALSE(client.Next(Duration::zero()).has_value());
}

TEST_F(ClientTest, QuestionsAndOrdersThatAreNotAnsweredFail) {
  FakeService service(context_, "inproc://client-test", Answering([](const AnyMessage& message) -> std::vector<Answer> {
                        const auto* query = std::get_if<SummaryQuery>(&message);
                        if (query == nullptr || query->dataset != "confused") return {};
                        return {{StatusReply{.nonce = query->nonce}, {}}, {SummaryReply{.nonce = query->nonce}, {}}};
                      }));
  Client client = Client::Connect(context_, service.endpoint()).value();
  const Status order = client.OrderData({}, milliseconds(30)).status();
  EXPECT_EQ(order.code(), StatusCode::kUnavailable);
  EXPECT_THAT(order.message(), testing::AllOf(HasSubstr(service.endpoint()), HasSubstr("30 ms")));
  const Status question = client.Summarize({.dataset = "ball"}, milliseconds(30)).status();
  EXPECT_EQ(question.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(question.message(), testing::AllOf(HasSubstr(service.endpoint()), HasSubstr("30 ms")));
  EXPECT_EQ(client.Summarize({.dataset = "confused"}, seconds(30)).status().code(), StatusCode::kInternal);

  client.Submit(SummaryQuery{.dataset = "confused"}, seconds(30));
  const std::optional<ClientEvent> event = client.Next(seconds(30));
  ASSERT_TRUE(event && std::holds_alternative<Status>(event->what));
  EXPECT_EQ(std::get<Status>(event->what).code(), StatusCode::kInternal);
  EXPECT_FALSE(client.Next(Duration::zero()).has_value());
}

TEST_F(ClientTest, WakeupGivesUpAnOrder) {
  std::atomic<Client*> notified = nullptr;
  FakeService service(context_, "inproc://client-test", Answering([&](const AnyMessage& message) -> std::vector<Answer> {
                        if (std::holds_alternative<StatusQuery>(message)) notified.load()->wakeup().Notify();
                        return {};
                      }));
  Client client = Client::Connect(context_, service.endpoint()).value();
  notified = &client;
  EXPECT_EQ(client.QueryStatus(std::chrono::hours(1)).status().code(), StatusCode::kUnavailable);
}

TEST_F(ClientTest, WakeupEndsNext) {
  FakeService service(context_, "inproc://client-test", [](const AnyMessage& message) -> std::vector<Answer> {
    const auto* ping = std::get_if<ClientPing>(&message);
    if (ping == nullptr) return {};
    return {{PongTo(*ping), {}}};
  });
  Client client = Client::Connect(context_, service.endpoint()).value();
  const std::jthread other([&] { client.wakeup().Notify(); });
  EXPECT_FALSE(client.Next(std::chrono::hours(1)).has_value());
}

// A message that brings no event must not swallow the notification that comes with it.
TEST_F(ClientTest, WakeupEndsNextAlsoWithAMessage) {
  std::atomic<Client*> notified = nullptr;
  FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message)) return {{PongTo(*ping), {}}};
    if (const auto* cancel = std::get_if<CancelFrame>(&message)) return {{FrameFailed{cancel->request, Status::Cancelled("as asked")}, {}}};
    const auto* submit = std::get_if<SubmitFrame>(&message);
    if (submit == nullptr) return {};
    notified.load()->wakeup().Notify();
    return {{FrameProgress{.request = submit->request + 1000}, {}}};  // of a request that nobody made
  });
  Client client = Client::Connect(context_, service.endpoint()).value();
  notified = &client;
  for (int round = 0; round < 300; ++round) {
    const RequestId request = client.Submit(SmallRequest());
    EXPECT_FALSE(client.Next(std::chrono::hours(1)).has_value());
    client.Cancel(request);
    EXPECT_TRUE(client.Next(std::chrono::hours(1)).has_value());
  }
}

// Replies whose payload or whose header fields do not fit: the request ends in an error, or in a picture if the damage did no harm; nothing
// else.
TEST_F(ClientTest, DamagedRepliesNeverCrash) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  FakeService service(context_, "inproc://client-test", [&](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message)) return {{PongTo(*ping), {}}};
    const auto* submit = std::get_if<SubmitFrame>(&message);
    if (submit == nullptr) return {};
    Answer answer = ReplyTo(submit->request, 1, 1, random.Chance(0.5) ? Codec::kRaw : Codec::kZstd);
    auto& reply = std::get<FrameReply>(answer.message);
    switch (random.Integer(0, 4)) {
      case 0: {  // bytes of the payload, with or without a digest that fits
        std::vector<std::byte> bytes(answer.payload.span().begin(), answer.payload.span().end());
        for (int i = random.Integer(1, 8); i > 0; --i)
          bytes[random.Integer<std::size_t>(0, bytes.size() - 1)] = std::byte(random.Integer(0, 255));
        if (reply.shares.front().runs.codec == Codec::kRaw && random.Chance(0.5)) {
          answer.payload = PackRuns(Bytes(std::move(bytes)), Codec::kRaw, reply.shares.front().runs);
        } else {
          answer.payload = Bytes(std::move(bytes));
        }
        break;
      }
      case 1: reply.size = {32, 25}; break;
      case 2: reply.shares.front().runs.image.bounds.x_end += random.Integer(-3, 30); break;
      case 3: reply.shares.front().runs.image.pixel_count += random.Integer<std::uint64_t>(1, 5); break;
      case 4: reply.shares.front().runs.digest ^= 1; break;
    }
    // What the codec itself would refuse, the client drops; then this failure ends the request.
    return {std::move(answer), {FrameFailed{submit->request, Status::Internal("dropped")}, {}}};
  });
  Client client = Client::Connect(context_, service.endpoint()).value();
  for (int round = 0; round < 500; ++round) {
    const Result<Picture> picture = client.Render(SmallRequest());
    if (!picture.ok()) continue;
    EXPECT_TRUE((PixelBounds{0, 0, 32, 24}).Contains(picture->image.bounds()));
  }
}

}  // namespace
}  // namespace slabstream
