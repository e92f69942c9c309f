// The client against a service that the test plays: silent, forgetful, hostile.
#include "client/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <functional>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "common/transport/authenticator.h"
#include "common/transport/socket.h"
#include "common/wire/any_message.h"
#include "common/wire/payload.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

struct Answer {
  AnyMessage message;
  Bytes payload;
};

// Binds an endpoint of its own and answers what comes by a function, which is called in the service's thread.
class FakeService {
 public:
  using Handler = std::function<std::vector<Answer>(const AnyMessage&)>;

  FakeService(Context& context, const std::string& endpoint, Handler handler, const SocketOptions& options = {})
      : handler_(std::move(handler)), socket_(Socket::Router(context, options).value()) {
    endpoint_ = socket_.Bind(endpoint).value();
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }
  ~FakeService() {
    thread_.request_stop();
    wakeup_.Notify();
  }
  const std::string& endpoint() const { return endpoint_; }

 private:
  void Run(const std::stop_token& stop) {
    const std::array<Socket*, 1> sockets = {&socket_};
    while (!stop.stop_requested()) {
      Wait(sockets, &wakeup_, seconds(60));
      while (const std::optional<Incoming> incoming = socket_.TryReceive()) {
        const Result<AnyMessage> message = Decode(incoming->header());
        ASSERT_TRUE(message.ok()) << message.status().message();
        for (const Answer& answer : handler_(*message)) (void)socket_.Send(incoming->identity, Encode(answer.message), answer.payload);
      }
    }
  }

  Handler handler_;
  Wakeup wakeup_;
  Socket socket_;
  std::string endpoint_;
  std::jthread thread_;
};

// Knows every request that it is asked about.
ClientPong PongTo(const ClientPing& ping) { return {.epoch = 1, .nonce = ping.nonce, .known = ping.open}; }

// Answers pings, and questions and orders by `handler`.
FakeService::Handler Answering(FakeService::Handler handler) {
  return [handler = std::move(handler)](const AnyMessage& message) -> std::vector<Answer> {
    if (const auto* ping = std::get_if<ClientPing>(&message)) return {{PongTo(*ping), {}}};
    return handler(message);
  };
}

FrameRequest SmallRequest() {
  FrameRequest request;
  request.dataset = "ball";
  request.size = {32, 24};
  return request;
}

// A reply whose picture is half transparent on a rectangle.
Answer ReplyTo(RequestId request, std::uint32_t groups_done = 1, std::uint32_t group_count = 1, Codec codec = Codec::kZstd) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {4, 6, 20, 18});
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = i % 4 == 3 ? 0.5F : 0.001F * float(i % 97);
  RunImage runs = EncodeRuns(image, {0, 32 * 24}, 32);
  FrameReply reply{.request = request, .size = {32, 24}, .groups_done = groups_done, .group_count = group_count};
  reply.statistics.renderer = "raycast";
  reply.statistics.decomposition = "slab";
  reply.statistics.axis = "z";
  reply.statistics.combine = "fan-in";
  reply.runs.image = runs.header;
  const Bytes payload = PackRuns(Bytes(std::move(runs.payload)), codec, reply.runs);
  return {reply, payload};
}

class ClientTest : public testing::Test {
 protected:
  Context context_;
  const ClientTiming quick_ = {.ping = milliseconds(20), .silence = milliseconds(400)};
};

// A service with keys, and a worker of it that brings pictures, as the test says, under a key that the service names or under another one.
class DirectPicturesTest : public ClientTest {
 protected:
  enum class Brings { kNothing, kPicture, kPictureOfAnother, kPictureFirst };

  // How often the client has asked for the picture, and what it got.
  struct Outcome {
    Result<Picture> picture;
    int asked = 0, asked_with_door = 0;
  };

  Outcome Render(Brings brings) {
    context_.authenticator().AdmitOnly("clients", {client_.public_key});
    Outcome outcome{Status::Internal(""), 0, 0};
    const auto answer = [&](const AnyMessage& message) -> std::vector<Answer> {
      if (const auto* ping = std::get_if<ClientPing>(&message)) {
        ClientPong pong = PongTo(*ping);
        pong.known.clear();  // the frame is over for the service
        if (ping->senders && *ping->senders != 7) pong.senders = PictureSenders{7, {worker_.public_key}};
        return {{pong, {}}};
      }
      const auto& submit = std::get<SubmitFrame>(message);
      ++outcome.asked;
      Answer reply = ReplyTo(submit.request);
      if (!submit.pictures) return {reply};
      ++outcome.asked_with_door;
      if (brings != Brings::kNothing) {
        const KeyPair& own = brings == Brings::kPictureOfAnother ? stranger_ : worker_;
        SocketOptions options;
        options.client_keys = ClientKeys{.server_key = submit.pictures->key, .own = own, .sealed = true};
        worker_socket_.emplace(Socket::Dealer(context_, options).value());
        EXPECT_TRUE(worker_socket_->Connect("tcp://127.0.0.1:" + std::to_string(submit.pictures->port)).ok());
        EXPECT_TRUE(
            worker_socket_
                ->Send({}, Encode(SentPicture{std::get<FrameReply>(reply.message).runs.digest, reply.payload.size()}), reply.payload)
                .ok());
        while (brings == Brings::kPictureFirst && !worker_socket_->connected()) std::this_thread::yield();
      }
      std::get<FrameReply>(reply.message).direct = true;
      return {{reply.message, {}}};
    };
    const SocketOptions options{.server_keys = ServerKeys{.secret_key = service_.secret_key, .plane = "clients"}};
    const FakeService service(context_, "tcp://127.0.0.1:*", answer, options);
    const ServiceAddress address(service.endpoint(), ClientKeys{.server_key = service_.public_key, .own = client_});
    Client client = Client::Connect(context_, address, seconds(30), {.ping = milliseconds(20), .lost_picture = lost_after_}).value();
    outcome.picture = client.Render(SmallRequest(), seconds(60));
    return outcome;
  }

  Duration lost_after_ = seconds(60);
  const KeyPair service_ = MakeKeyPair(), client_ = MakeKeyPair(), worker_ = MakeKeyPair(), stranger_ = MakeKeyPair();
  std::optional<Socket> worker_socket_;
};

TEST_F(DirectPicturesTest, ComeFromAWorkerThatTheServiceNames) {
  for (const Brings brings : {Brings::kPicture, Brings::kPictureFirst}) {
    const Outcome outcome = Render(brings);
    ASSERT_TRUE(outcome.picture.ok()) << outcome.picture.status().message();
    EXPECT_TRUE(outcome.picture->direct);
    EXPECT_EQ(outcome.picture->image.bounds, (PixelBounds{4, 6, 20, 18}));
    EXPECT_EQ(outcome.picture->image.rgba[5], 0.001F * 5);
    EXPECT_EQ(outcome.asked, 1);
  }
}

TEST_F(DirectPicturesTest, AreAskedForAgainIfTheyAreLost) {
  lost_after_ = milliseconds(50);
  for (const Brings brings : {Brings::kNothing, Brings::kPictureOfAnother}) {
    const Outcome outcome = Render(brings);
    ASSERT_TRUE(outcome.picture.ok()) << outcome.picture.status().message();
    EXPECT_FALSE(outcome.picture->direct);
    EXPECT_EQ(outcome.picture->image.rgba[5], 0.001F * 5);
    EXPECT_EQ(outcome.asked, 2);
    EXPECT_EQ(outcome.asked_with_door, 1) << "the second one comes through the coordinator";
  }
}

TEST_F(ClientTest, NobodyAnswers) {
  Socket silent = Socket::Router(context_).value();
  const std::string endpoint = silent.Bind("tcp://127.0.0.1:*").value();
  const Result<Client> client = Client::Connect(context_, endpoint, milliseconds(200));
  EXPECT_EQ(client.status().code(), StatusCode::kUnavailable);
  EXPECT_THAT(client.status().message(), testing::AllOf(HasSubstr(endpoint), HasSubstr("200 ms")));
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
  EXPECT_EQ(picture.image.bounds, (PixelBounds{4, 6, 20, 18}));
  EXPECT_EQ(picture.image.rgba[3], 0.5F);
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
  EXPECT_EQ(client.SampleAt("ball", {{}}, seconds(30)).value().size(), 1U);
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
  const Status question = client.Summarize("ball", {}, milliseconds(30)).status();
  EXPECT_EQ(question.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(question.message(), testing::AllOf(HasSubstr(service.endpoint()), HasSubstr("30 ms")));
  EXPECT_EQ(client.Summarize("confused", {}, seconds(30)).status().code(), StatusCode::kInternal);

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
        if (reply.runs.codec == Codec::kRaw && random.Chance(0.5)) {
          answer.payload = PackRuns(Bytes(std::move(bytes)), Codec::kRaw, reply.runs);
        } else {
          answer.payload = Bytes(std::move(bytes));
        }
        break;
      }
      case 1: reply.size = {32, 25}; break;
      case 2: reply.runs.image.bounds.x_end += random.Integer(-3, 30); break;
      case 3: reply.runs.image.pixel_count += random.Integer<std::uint64_t>(1, 5); break;
      case 4: reply.runs.digest ^= 1; break;
    }
    // What the codec itself would refuse, the client drops; then this failure ends the request.
    return {std::move(answer), {FrameFailed{submit->request, Status::Internal("dropped")}, {}}};
  });
  Client client = Client::Connect(context_, service.endpoint()).value();
  for (int round = 0; round < 500; ++round) {
    const Result<Picture> picture = client.Render(SmallRequest());
    if (!picture.ok()) continue;
    EXPECT_TRUE((PixelBounds{0, 0, 32, 24}).Contains(picture->image.bounds));
  }
}

}  // namespace
}  // namespace slabstream
