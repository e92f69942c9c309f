#include "client/client.h"

#include <algorithm>
#include <array>
#include <deque>
#include <iterator>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/log.h"
#include "common/wire/any_message.h"
#include "common/wire/payload.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

constexpr int kUnknownPongs = 2;  // in a row, before a request is submitted again
constexpr int kMaxResubmits = 3;  // before it fails
constexpr std::int64_t kMaxDeadlineMs = 86'400'000;

// A request that has not ended.
struct OpenRequest {
  SubmitFrame message;
  Time submitted, deadline;
  int unknown_pongs = 0;  // in a row
  int resubmits = 0;
  bool cancelled = false;  // by the caller; the service has not answered yet
};

// The checked picture of a reply: whoever answers at the endpoint may send anything.
Result<Picture> DecodePicture(FrameReply& reply, const Bytes& payload, ImageSize expected) {
  if (reply.size != expected) {
    return Status::DataLoss("FrameReply.size is " + std::to_string(reply.size.width) + "x" + std::to_string(reply.size.height) +
                            ", asked for was " + std::to_string(expected.width) + "x" + std::to_string(expected.height));
  }
  const Result<Bytes> runs = UnpackRuns(reply.runs, payload);
  if (!runs.ok()) return runs.status();
  const PixelBounds frame = {0, 0, expected.width, expected.height};
  Result<LocalImage> image = ReadRuns(reply.runs.image, runs->span(), frame);
  if (!image.ok()) return Status::DataLoss(image.status().message());
  Picture picture;
  picture.size = reply.size;
  picture.geometry = reply.geometry;
  picture.image = std::move(*image);
  picture.final = reply.groups_done == reply.group_count;
  picture.groups_done = reply.groups_done;
  picture.group_count = reply.group_count;
  picture.statistics = std::move(reply.statistics);
  return picture;
}

// A question that has no answer yet.
struct OpenQuestion {
  Time submitted, deadline;
};

constexpr std::uint64_t kTellBytes = std::uint64_t{1} << 20;

// Of an answer to a question or an order.
std::optional<std::uint64_t> NonceOfAnswer(const CoordinatorToClient& message) {
  if (const auto* status = std::get_if<StatusReply>(&message)) return status->nonce;
  if (const auto* end = std::get_if<ShutDownReply>(&message)) return end->nonce;
  if (const auto* keys = std::get_if<KeysReply>(&message)) return keys->nonce;
  if (const auto* data = std::get_if<DataReply>(&message)) return data->nonce;
  if (const auto* refused = std::get_if<OrderRefused>(&message)) return refused->nonce;
  return std::nullopt;
}

}  // namespace

struct Client::Impl {
  Impl(std::string service_endpoint, Socket service_socket, ClientTiming client_timing)
      : endpoint(std::move(service_endpoint)), socket(std::move(service_socket)), timing(client_timing) {}

  Status Send(MessageView message) { return socket.Send({}, Encode(message)); }

  void Submit(const SubmitFrame& message);

  // Sends due messages, waits for a message, a wakeup, the next due time or `limit`, and handles what has come. True: a wakeup ended the
  // wait.
  bool Pump(Time limit);

  Status NoAnswer(Duration timeout) const {
    if (socket.refused()) return Status::Unavailable("the service at " + endpoint + " refuses the key: it was revoked or is another's");
    return Status::Unavailable("no service answers at " + endpoint + " within " +
                               std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(timeout).count()) + " ms");
  }

  // Pumps until `done()`; false: the time is over. `woken` becomes true once a wakeup has ended a wait.
  template <class Done>
  bool PumpUntil(Duration timeout, Done&& done, bool* woken = nullptr) {
    const Time limit = MonotonicNow() + timeout;
    while (!done()) {
      if (MonotonicNow() >= limit) return false;
      const bool by_wakeup = Pump(limit);
      if (woken != nullptr) *woken = *woken || by_wakeup;
    }
    return true;
  }

  // Sends a message and waits for its answer, of the type Answer. Errors: the service refused it, or did not answer in time.
  template <class Answer, class Question>
  Result<Answer> Ask(Question question_message, Duration timeout);
  void SendPing(Time now);
  bool Receive();  // true: something came
  void Handle(CoordinatorToClient& message, const Bytes& payload);
  void Handle(FrameReply& reply, const Bytes& payload);
  void Handle(const ClientPong& pong);
  void SubmitAgain(OpenRequest& lost);
  // False: nobody waits for it.
  bool EndQuestion(std::uint64_t nonce, std::variant<FrameProgress, Picture, QuestionReply, Status> end);
  void ExpireQuestions(Time now);
  // Waits for the end of a request that was submitted.
  template <class Reply>
  Result<Reply> Await(Client& client, RequestId id);
  void End(RequestId request, Status status);  // with a failure
  void FailAll(const std::string& reason);

  std::string endpoint;
  Socket socket;
  ClientTiming timing;
  Wakeup wakeup;
  std::uint64_t last_id = 0;                         // of requests and nonces
  std::uint64_t received_bytes = 0, told_bytes = 0;  // of payloads; those that the last ping told
  std::map<RequestId, OpenRequest> open;
  std::map<std::uint64_t, OpenQuestion> questions;         // by nonce
  std::map<std::uint64_t, std::vector<RequestId>> pinged;  // requests of each unanswered ping, by nonce
  std::deque<ClientEvent> events;
  std::optional<CoordinatorToClient> answer;  // to the one question or order that waits for it
  std::uint64_t question = 0;                 // its nonce
  Time next_ping;
  std::optional<Time> unanswered_since;  // time of the first ping since the last message
};

void Client::Impl::Submit(const SubmitFrame& message) {
  if (const Status sent = Send(message); !sent.ok()) {
    End(message.request, Status::Unavailable("no service at " + endpoint + ": " + sent.message()));
  }
}

void Client::Impl::SendPing(Time now) {
  ClientPing ping{.nonce = ++last_id, .open = {}, .received_bytes = received_bytes};
  told_bytes = received_bytes;
  for (const auto& [request, unused] : open) {
    if (ping.open.size() < kMaxOpenRequests) ping.open.push_back(request);
  }
  (void)Send(ping);  // a ping that cannot be queued counts as unanswered
  pinged[ping.nonce] = std::move(ping.open);
  if (!unanswered_since) unanswered_since = now;
  next_ping = now + timing.ping;
}

bool Client::Impl::Pump(Time limit) {
  // Messages that have already come are handled before silence is judged: the caller may have been busy elsewhere for long.
  const bool received = Receive();
  Time now = MonotonicNow();
  ExpireQuestions(now);
  if (!open.empty() || !questions.empty()) {
    if (unanswered_since && now - *unanswered_since >= timing.silence) {
      FailAll("the service at " + endpoint + " has not answered for " +
              std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(now - *unanswered_since).count()) + " ms");
      return false;
    }
    if (now >= next_ping) SendPing(now);
    limit = std::min(limit, next_ping);
    if (unanswered_since) limit = std::min(limit, *unanswered_since + timing.silence);
    for (const auto& [nonce, question_asked] : questions) limit = std::min(limit, question_asked.deadline);
  }
  if (received) return false;  // a message may be what the caller waits for
  const std::array<Socket*, 1> sockets = {&socket};
  now = MonotonicNow();
  const bool notified = Wait(sockets, &wakeup, std::max<Duration>(limit - now, Duration::zero()));
  // A message may come together with a notification, which is told all the same: nobody notifies twice. Without both it was a signal.
  const bool came = Receive();
  return notified || (!came && MonotonicNow() < limit);
}

bool Client::Impl::Receive() {
  bool received = false;
  while (const std::optional<Incoming> incoming = socket.TryReceive()) {
    received = true;
    const Bytes payload = incoming->payload();
    Result<CoordinatorToClient> message = Decode<CoordinatorToClient>(incoming->header(), payload.size());
    if (!message.ok()) {
      LogWarning("client plane: dropped a message: " + message.status().message());
      continue;
    }
    unanswered_since.reset();
    received_bytes += payload.size();
    Handle(*message, payload);
    if (received_bytes - told_bytes >= kTellBytes) SendPing(MonotonicNow());  // else the service takes it for one that does not read
  }
  return received;
}

void Client::Impl::Handle(CoordinatorToClient& message, const Bytes& payload) {
  if (const auto* progress = std::get_if<FrameProgress>(&message)) {
    if (open.contains(progress->request)) events.push_back({progress->request, *progress});
  } else if (auto* reply = std::get_if<FrameReply>(&message)) {
    Handle(*reply, payload);
  } else if (const auto* failed = std::get_if<FrameFailed>(&message)) {
    End(failed->request, failed->status);
  } else if (const auto* pong = std::get_if<ClientPong>(&message)) {
    Handle(*pong);
  } else if (auto* summary = std::get_if<SummaryReply>(&message)) {
    EndQuestion(summary->nonce, QuestionReply(std::move(*summary)));
  } else if (auto* samples = std::get_if<SampleReply>(&message)) {
    EndQuestion(samples->nonce, QuestionReply(std::move(*samples)));
  } else if (auto* picked = std::get_if<PickReply>(&message)) {
    EndQuestion(picked->nonce, QuestionReply(std::move(*picked)));
  } else if (const std::optional<std::uint64_t> nonce = NonceOfAnswer(message)) {
    const auto* refused = std::get_if<OrderRefused>(&message);
    if (refused != nullptr && EndQuestion(*nonce, refused->status)) return;
    if (*nonce == question) answer = std::move(message);  // else it comes too late
  } else {
    LogWarning("client plane: dropped " + std::string(NameOf(message)) + ", which services do not send to clients");
  }
}

template <class Answer, class Question>
Result<Answer> Client::Impl::Ask(Question question_message, Duration timeout) {
  answer.reset();
  question_message.nonce = question = ++last_id;
  (void)Send(question_message);
  bool woken = false;
  const auto ends_early = [&] { return answer.has_value() || woken; };
  if (!PumpUntil(timeout, ends_early, &woken)) return NoAnswer(timeout);
  if (!answer) return Status::Unavailable("the question to the service was given up");
  if (const auto* refused = std::get_if<OrderRefused>(&*answer)) return refused->status;
  if (auto* found = std::get_if<Answer>(&*answer)) return std::move(*found);
  return Status::Internal("the service answered " + std::string(NameOf(*answer)));
}

void Client::Impl::Handle(FrameReply& reply, const Bytes& payload) {
  const auto found = open.find(reply.request);
  if (found == open.end()) return;  // cancelled, or a duplicate
  Result<Picture> picture = DecodePicture(reply, payload, found->second.message.frame.size);
  if (!picture.ok()) {
    End(reply.request, picture.status());
    return;
  }
  if (picture->final) {
    picture->latency = MonotonicNow() - found->second.submitted;
    open.erase(found);
  }
  events.push_back({reply.request, std::move(*picture)});
}

void Client::Impl::Handle(const ClientPong& pong) {
  const auto ping = pinged.find(pong.nonce);
  if (ping == pinged.end()) return;
  const std::vector<RequestId> asked = std::move(ping->second);
  pinged.erase(pinged.begin(), std::next(ping));  // older ones will not be answered any more
  for (const RequestId request : asked) {
    const auto found = open.find(request);
    if (found == open.end()) continue;
    OpenRequest& state = found->second;
    if (std::find(pong.known.begin(), pong.known.end(), request) != pong.known.end()) {
      state.unknown_pongs = 0;
    } else if (++state.unknown_pongs >= kUnknownPongs) {
      state.unknown_pongs = 0;
      SubmitAgain(state);
    }
  }
}

// The service has lost the request: it was started anew. The deadline is still that of the first time.
void Client::Impl::SubmitAgain(OpenRequest& lost) {
  const RequestId request = lost.message.request;
  const std::int64_t left_ms = std::chrono::duration_cast<std::chrono::milliseconds>(lost.deadline - MonotonicNow()).count();
  if (lost.cancelled) {
    End(request, Status::Cancelled("the client cancelled the frame"));
  } else if (left_ms < 1) {
    End(request, Status::DeadlineExceeded("the service at " + endpoint + " lost the request, and its time is over"));
  } else if (lost.resubmits++ < kMaxResubmits) {
    SubmitFrame again = lost.message;  // a copy: a failed submit ends the request
    again.deadline_ms = std::uint32_t(left_ms);
    Submit(again);
  } else {
    End(request, Status::Unavailable("the service at " + endpoint + " lost the request " + std::to_string(kMaxResubmits + 1) + " times"));
  }
}

void Client::Impl::End(RequestId request, Status status) {
  if (open.erase(request) > 0) events.push_back({request, std::move(status)});
}

bool Client::Impl::EndQuestion(std::uint64_t nonce, std::variant<FrameProgress, Picture, QuestionReply, Status> end) {
  if (questions.erase(nonce) == 0) return false;
  events.push_back({nonce, std::move(end)});
  return true;
}

void Client::Impl::ExpireQuestions(Time now) {
  std::vector<std::uint64_t> late;
  for (const auto& [nonce, asked] : questions) {
    if (now >= asked.deadline) late.push_back(nonce);
  }
  for (const std::uint64_t nonce : late) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now - questions.at(nonce).submitted).count();
    EndQuestion(nonce, Status::DeadlineExceeded("the service at " + endpoint + " has not answered within " + std::to_string(ms) + " ms"));
  }
}

void Client::Impl::FailAll(const std::string& reason) {
  while (!questions.empty()) EndQuestion(questions.begin()->first, Status::Unavailable(reason));
  while (!open.empty()) End(open.begin()->first, Status::Unavailable(reason));
  pinged.clear();
  unanswered_since.reset();
}

Result<Client> Client::Connect(Context& context, const ServiceAddress& service, Duration timeout, ClientTiming timing,
                               const std::function<bool()>& give_up) {
  Result<Socket> socket = Socket::Dealer(context, {.client_keys = service.keys});
  if (!socket.ok()) return socket.status();
  if (Status connected = socket->Connect(service.endpoint); !connected.ok()) return connected;
  Client client(std::make_unique<Impl>(service.endpoint, std::move(*socket), timing));
  client.impl_->SendPing(MonotonicNow());
  constexpr Duration kEachLook = std::chrono::milliseconds(100);  // at give_up
  const auto connected_or = [&client](Duration time) {
    return client.impl_->PumpUntil(time, [&] { return client.impl_->pinged.empty(); });
  };
  for (const Time end = MonotonicNow() + timeout;;) {
    const Duration left = end - MonotonicNow();
    if (connected_or(give_up ? std::min(left, kEachLook) : left)) return client;
    if (MonotonicNow() >= end || (give_up && give_up())) return client.impl_->NoAnswer(timeout);
  }
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;

Client::~Client() {
  if (impl_ == nullptr) return;  // moved from
  for (const auto& [request, unused] : impl_->open) (void)impl_->Send(CancelFrame{request});
}

RequestId Client::Submit(const FrameRequest& request, Duration deadline) {
  const RequestId id = ++impl_->last_id;
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(deadline).count();
  SubmitFrame message{.request = id, .deadline_ms = std::uint32_t(std::clamp<std::int64_t>(ms, 1, kMaxDeadlineMs)), .frame = request};
  const Time now = MonotonicNow();
  const Time limit = now + std::chrono::milliseconds(message.deadline_ms);
  impl_->open.emplace(id, OpenRequest{.message = message, .submitted = now, .deadline = limit});
  if (Status status = Validate(request); !status.ok()) {
    impl_->End(id, std::move(status));  // the service would drop a request that it cannot decode
  } else if (impl_->open.size() > kMaxOpenRequests) {
    impl_->End(id, Status::ResourceExhausted("at most " + std::to_string(kMaxOpenRequests) + " requests may be open at once"));
  } else {
    impl_->Submit(message);
  }
  return id;
}

RequestId Client::Submit(Question question, Duration deadline) {
  const RequestId id = ++impl_->last_id;
  std::visit([id](auto& query) { query.nonce = id; }, question);
  const Time now = MonotonicNow();
  impl_->questions.emplace(id, OpenQuestion{now, now + deadline});
  // What the service would refuse to decode is refused here, by the same rules.
  if (const auto checked = Decode<ClientToCoordinator>(Encode(question), 0); !checked.ok()) {
    impl_->EndQuestion(id, checked.status());
  } else if (impl_->questions.size() > kMaxOpenQuestions) {
    impl_->EndQuestion(id, Status::ResourceExhausted("at most " + std::to_string(kMaxOpenQuestions) + " questions may be open at once"));
  } else if (const Status sent = impl_->Send(question); !sent.ok()) {
    impl_->EndQuestion(id, Status::Unavailable("no service at " + impl_->endpoint + ": " + sent.message()));
  }
  return id;
}

void Client::Cancel(RequestId request) {
  impl_->questions.erase(request);
  const auto found = impl_->open.find(request);
  if (found == impl_->open.end()) return;
  found->second.cancelled = true;
  (void)impl_->Send(CancelFrame{request});
}

std::optional<ClientEvent> Client::Next(Duration timeout) {
  const Time limit = MonotonicNow() + timeout;
  // At least one round, so that a caller who polls without a timeout keeps pinging and receiving.
  bool woken = false;
  do {
    woken = impl_->Pump(impl_->events.empty() ? limit : MonotonicNow());
  } while (impl_->events.empty() && !woken && MonotonicNow() < limit);
  if (impl_->events.empty()) return std::nullopt;
  ClientEvent event = std::move(impl_->events.front());
  impl_->events.pop_front();
  return event;
}

template <class Reply>
Result<Reply> Client::Impl::Await(Client& client, RequestId id) {
  std::deque<ClientEvent> others;  // of other open requests
  std::optional<Result<Reply>> end;
  while (!end) {
    std::optional<ClientEvent> event = client.Next(timing.ping);
    if (!event) continue;
    if (event->request != id) {
      others.push_back(std::move(*event));
    } else if (const auto* failure = std::get_if<Status>(&event->what)) {
      end = *failure;
    } else if constexpr (std::is_same_v<Reply, Picture>) {
      auto* picture = std::get_if<Picture>(&event->what);
      if (picture != nullptr && picture->final) end = std::move(*picture);
    } else if (auto* reply = std::get_if<QuestionReply>(&event->what)) {
      auto* wanted = std::get_if<Reply>(reply);
      end = wanted != nullptr ? Result<Reply>(std::move(*wanted)) : Status::Internal("the service answered another question");
    }
  }
  events.insert(events.begin(), std::make_move_iterator(others.begin()), std::make_move_iterator(others.end()));
  return std::move(*end);
}

Result<Picture> Client::Render(const FrameRequest& request, Duration deadline) {
  return impl_->Await<Picture>(*this, Submit(request, deadline));
}

Result<SummaryReply> Client::Summarize(const std::string& dataset, const TransferChoice& transfer, Duration deadline) {
  return impl_->Await<SummaryReply>(*this, Submit(SummaryQuery{.dataset = dataset, .transfer = transfer}, deadline));
}

Result<std::vector<VolumeSample>> Client::SampleAt(const std::string& dataset, std::vector<Vec3> points, Duration deadline) {
  const std::size_t count = points.size();
  Result<SampleReply> reply =
      impl_->Await<SampleReply>(*this, Submit(SampleQuery{.dataset = dataset, .points = std::move(points)}, deadline));
  if (!reply.ok()) return reply.status();
  if (reply->samples.size() != count) {
    return Status::DataLoss("the service answered " + std::to_string(reply->samples.size()) + " of " + std::to_string(count) + " points");
  }
  return std::move(reply->samples);
}

Result<PickReply> Client::Pick(const FrameRequest& frame, double x, double y, Duration deadline) {
  return impl_->Await<PickReply>(*this, Submit(PickQuery{.frame = frame, .x = x, .y = y}, deadline));
}

Result<StatusReply> Client::QueryStatus(Duration timeout) { return impl_->Ask<StatusReply>(StatusQuery{}, timeout); }

Status Client::ShutDownService(Duration timeout) { return impl_->Ask<ShutDownReply>(ShutDown{}, timeout).status(); }

Result<std::vector<AdmittedKey>> Client::OrderKeys(KeysOrder order, Duration timeout) {
  Result<KeysReply> reply = impl_->Ask<KeysReply>(std::move(order), timeout);
  if (!reply.ok()) return reply.status();
  return std::move(reply->keys);
}

Result<std::vector<DatasetStatus>> Client::OrderData(DataOrder order, Duration timeout) {
  Result<DataReply> reply = impl_->Ask<DataReply>(std::move(order), timeout);
  if (!reply.ok()) return reply.status();
  return std::move(reply->datasets);
}

Wakeup& Client::wakeup() { return impl_->wakeup; }

}  // namespace slabstream
