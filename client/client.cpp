#include "client/client.h"

#include <algorithm>
#include <array>
#include <deque>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "client/decode_picture.h"
#include "client/direct_pictures.h"
#include "common/base/any_of.h"
#include "common/base/log.h"
#include "common/base/merged.h"
#include "common/base/overloaded.h"
#include "common/transport/endpoint.h"
#include "common/wire/any_message.h"
#include "common/wire/other_version.h"
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
  bool cancelled = false;       // by the caller; the service has not answered yet
  bool awaits_picture = false;  // the service has done its part, and need not know it any more
};

// A question or an order that has no answer yet.
struct OpenQuestion {
  Duration patience{};
  Time deadline;
  bool order = false;  // services answer those at once; a wakeup ends the wait for one
};

using OrderReply = std::variant<StatusReply, ShutDownReply, KeysReply, DataReply>;

template <class T, class Variant>
constexpr bool kIsIn = false;
template <class T, class... Types>
constexpr bool kIsIn<T, std::variant<Types...>> = AnyOf<T, Types...>;
template <class T>
concept Answer = kIsIn<T, QuestionReply> || kIsIn<T, OrderReply>;

struct Event {
  RequestId request = 0;
  Merged<std::variant<FrameProgress, Picture, Status>, QuestionReply, OrderReply> what;
};

// Answers to orders are for those who wait for them.
ClientEvent ToClientEvent(Event event) {
  const auto what =
      Overloaded{[](AnyOf<FrameProgress, Picture, Status> auto& known) -> decltype(ClientEvent::what) { return std::move(known); },
                 []<Answer T>(T& reply) -> decltype(ClientEvent::what) {
                   if constexpr (kIsIn<T, QuestionReply>) return QuestionReply(std::move(reply));
                   return Status::Internal("the service answered another question");
                 }};
  return {event.request, std::visit(what, event.what)};
}

std::string Milliseconds(Duration duration) {
  return std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count()) + " ms";
}

constexpr std::uint64_t kTellBytes = std::uint64_t{1} << 20;

}  // namespace

struct Client::Impl {
  Impl(Context& client_context, const ServiceAddress& service, Socket service_socket, ClientTiming client_timing)
      : context(client_context),
        endpoint(service.endpoint),
        has_keys(service.keys.has_value()),
        takes_pictures(service.keys.has_value() && service.direct_pictures),
        socket(std::move(service_socket)),
        timing(client_timing) {}

  Status Send(MessageView message) { return socket.Send({}, Encode(message)); }

  void Submit(const SubmitFrame& message);

  // Sends due messages, waits for a message, a wakeup, a signal, the next due time or `limit`, and handles what has come. True: a wakeup or
  // a signal ended the wait.
  bool Pump(Time limit);

  Status NoAnswer(Duration timeout) const {
    if (socket.refused() && !has_keys) {
      return Status::InvalidArgument("the service at " + endpoint + " has keys: name its service file, client.json (--service)");
    }
    // Whoever listens with keys may end the connection before its greeting, which says so, has come.
    if (!has_keys && !socket.connected() && !socket.local_host().empty()) {
      return Status::Unavailable("no service answers at " + endpoint + ", but somebody listens there; a service with keys needs its " +
                                 "service file, client.json (--service)");
    }
    if (socket.refused()) return Status::Unavailable("the service at " + endpoint + " refuses the key: it was revoked or is another's");
    return Status::Unavailable("no service answers at " + endpoint + " within " + Milliseconds(timeout));
  }

  // Sends a question or an order, of the number that is returned. It ends with its answer or a Status.
  template <class Message>
  RequestId Ask(Message message, Duration patience);
  // Waits for the end of what was submitted or asked. `Reply`: Picture, or the type of the answer.
  template <class Reply>
  Result<Reply> Await(RequestId id);
  void SendPing(Time now);
  bool Receive();  // true: something came
  // Else the service takes it for one that does not read.
  void TellReceived() {
    if (received_bytes - told_bytes >= kTellBytes) SendPing(MonotonicNow());
  }
  void Handle(CoordinatorToClient& message, const Bytes& payload);
  void Handle(FrameReply& reply, const Bytes& payload);
  void Handle(DirectPictures::Reply reply);
  void OpenDirectPictures();
  void MatchPictures();           // hands over the awaited ones that have come
  bool ExpirePictures(Time now);  // asks for those that are lost; true: there are some
  void Handle(const ClientPong& pong);
  void SubmitAgain(OpenRequest& lost);
  void End(RequestId request, decltype(Event::what) end);  // nothing happens if it has ended
  bool ExpireQuestions(Time now);                          // true: some have ended
  void FailAll(const Status& reason);
  Status OtherRelease() const { return Status::InvalidArgument("the service at " + endpoint + " " + TextOfOtherVersion(*other_version)); }

  // The reason, once the service counts as gone.
  std::optional<std::string> Loss(Time now) const;

  Context& context;
  std::string endpoint;
  const bool has_keys;
  const bool takes_pictures;  // straight from workers, if they reach this host
  Socket socket;
  ClientTiming timing;
  const bool same_process = ParseEndpoint(endpoint, false)->scheme == Scheme::kInproc;
  std::optional<std::uint32_t> other_version;  // that the service speaks, if it is not ours
  bool unreachable = false;                    // the last ping could not be queued
  std::optional<Status> wrong_endpoint;        // clients are not heard there
  Wakeup wakeup;
  std::uint64_t last_id = 0;                         // of requests and nonces
  std::uint64_t received_bytes = 0, told_bytes = 0;  // of payloads; those that the last ping told
  std::map<RequestId, OpenRequest> open;
  std::map<RequestId, OpenQuestion> questions;             // by nonce
  std::map<std::uint64_t, std::vector<RequestId>> pinged;  // requests of each unanswered ping, by nonce
  std::unique_ptr<DirectPictures> direct;                  // from the first frame on; null: there is no such way
  bool direct_opened = false;                              // or tried
  std::deque<Event> events;
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
  if (direct) ping.senders = direct->senders();
  told_bytes = received_bytes;
  for (const auto& [request, unused] : open) {
    if (ping.open.size() < kMaxOpenRequests) ping.open.push_back(request);
  }
  unreachable = !Send(ping).ok();  // it counts as unanswered
  pinged[ping.nonce] = std::move(ping.open);
  if (!unanswered_since) unanswered_since = now;
  next_ping = now + timing.ping;
}

std::optional<std::string> Client::Impl::Loss(Time now) const {
  if (same_process) return unreachable ? std::optional<std::string>("has ended") : std::nullopt;
  if (!unanswered_since || now - *unanswered_since < timing.silence) return std::nullopt;
  return "has not answered for " + Milliseconds(now - *unanswered_since);
}

bool Client::Impl::Pump(Time limit) {
  // Messages that have already come are handled before silence is judged: the caller may have been busy elsewhere for long.
  bool ready = Receive();
  Time now = MonotonicNow();
  if (ExpireQuestions(now)) ready = true;
  if (ExpirePictures(now)) ready = true;
  if (!open.empty() || !questions.empty()) {
    if (now >= next_ping) SendPing(now);
    if (const std::optional<std::string> loss = Loss(now)) {
      FailAll(Status::Unavailable("the service at " + endpoint + " " + *loss));
      return false;
    }
    limit = std::min(limit, next_ping);
    if (unanswered_since && !same_process) limit = std::min(limit, *unanswered_since + timing.silence);
    for (const auto& [nonce, question] : questions) limit = std::min(limit, question.deadline);
    if (direct) limit = std::min(limit, direct->NextLoss());
  }
  if (ready) return false;  // this may be what the caller waits for
  std::vector<Socket*> sockets = {&socket};
  if (direct) sockets.push_back(&direct->socket());
  now = MonotonicNow();
  const bool woken = Wait(sockets, &wakeup, std::max<Duration>(limit - now, Duration::zero()));
  Receive();  // a message may come together with a wakeup, which is told all the same: nobody notifies twice
  return woken;
}

bool Client::Impl::Receive() {
  bool received = false;
  while (const std::optional<Incoming> incoming = socket.TryReceive()) {
    received = true;
    const Bytes payload = incoming->payload();
    Result<CoordinatorToClient> message = Decode<CoordinatorToClient>(incoming->header(), payload.size());
    if (!message.ok()) {
      if ((other_version = OtherVersion(incoming->header()))) {
        FailAll(OtherRelease());
        continue;
      }
      LogWarning("client plane: dropped a message: " + message.status().message());
      continue;
    }
    other_version.reset();
    unanswered_since.reset();
    received_bytes += payload.size();
    Handle(*message, payload);
    TellReceived();
  }
  if (const std::uint64_t bytes = direct ? direct->Receive() : 0; bytes > 0) {
    received = true;
    received_bytes += bytes;
    TellReceived();
  }
  MatchPictures();
  return received;
}

void Client::Impl::Handle(CoordinatorToClient& message, const Bytes& payload) {
  const auto handle =
      Overloaded{[&](const FrameProgress& progress) {
                   if (open.contains(progress.request)) events.push_back({progress.request, progress});
                 },
                 [&](FrameReply& reply) { Handle(reply, payload); },
                 [&](const FrameFailed& failed) { End(failed.request, failed.status); },
                 [&](const ClientPong& pong) { Handle(pong); },
                 [&](const OrderRefused& refused) {
                   if (refused.nonce == 0) wrong_endpoint = refused.status;
                   End(refused.nonce, refused.status);
                 },
                 [&](Answer auto& reply) { End(reply.nonce, std::move(reply)); },
                 [](const VolumeCredit&) { LogWarning("client plane: dropped a VolumeCredit: this client sends no volumes"); }};
  std::visit(handle, message);
}

void Client::Impl::OpenDirectPictures() {
  if (std::exchange(direct_opened, true) || !takes_pictures) return;
  direct = DirectPictures::Open(context, endpoint);
  if (direct) SendPing(MonotonicNow());  // the answer says whom to admit
}

void Client::Impl::MatchPictures() {
  if (!direct) return;
  if (open.empty()) return direct->Clear();  // what has come is of requests that were cancelled
  for (DirectPictures::Reply& reply : direct->TakeCome()) Handle(std::move(reply));
}

bool Client::Impl::ExpirePictures(Time now) {
  const std::vector<FrameReply> lost = direct ? direct->TakeLost(now) : std::vector<FrameReply>();
  for (const FrameReply& reply : lost) {
    const auto found = open.find(reply.request);
    if (found == open.end() || reply.groups_done < reply.group_count) continue;  // previews are not repeated
    found->second.message.pictures.reset();
    found->second.awaits_picture = false;
    SubmitAgain(found->second);
  }
  return !lost.empty();
}

void Client::Impl::Handle(FrameReply& reply, const Bytes& payload) {
  const auto found = open.find(reply.request);
  if (found == open.end()) return;  // cancelled, or a duplicate
  std::vector<Bytes> runs;
  std::uint64_t relayed_bytes = 0, direct_bytes = 0;
  for (const PictureShare& share : reply.shares) {
    const std::uint64_t bytes = share.runs.encoded_bytes;
    runs.push_back(share.direct ? Bytes() : payload.Part(relayed_bytes, bytes));
    (share.direct ? direct_bytes : relayed_bytes) += bytes;
  }
  if (direct_bytes == 0) return Handle(DirectPictures::Reply{std::move(reply), std::move(runs)});
  if (!direct) return End(reply.request, Status::DataLoss("the service sent a picture on a way that this client does not have"));
  if (reply.groups_done == reply.group_count) found->second.awaits_picture = true;
  constexpr std::uint64_t kSlowBytesPerMillisecond = 1000;  // over a slower link, pictures come twice
  const Time until = MonotonicNow() + timing.lost_picture + std::chrono::milliseconds(direct_bytes / kSlowBytesPerMillisecond);
  direct->Await({std::move(reply), std::move(runs)}, until);
}

void Client::Impl::Handle(DirectPictures::Reply complete) {
  FrameReply& reply = complete.message;
  const auto found = open.find(reply.request);
  if (found == open.end()) return;
  Result<Picture> picture = DecodePicture(reply, complete.runs, found->second.message.frame.size);
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
  if (pong.senders && direct) direct->Admit(*pong.senders, MonotonicNow());
  if (ping == pinged.end()) return;
  const std::vector<RequestId> asked = std::move(ping->second);
  pinged.erase(pinged.begin(), std::next(ping));  // older ones will not be answered any more
  for (const RequestId request : asked) {
    const auto found = open.find(request);
    if (found == open.end()) continue;
    OpenRequest& state = found->second;
    if (state.awaits_picture) continue;
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

void Client::Impl::End(RequestId request, decltype(Event::what) end) {
  if (open.erase(request) + questions.erase(request) > 0) events.push_back({request, std::move(end)});
}

bool Client::Impl::ExpireQuestions(Time now) {
  const std::size_t asked = questions.size();
  for (auto next = questions.begin(); next != questions.end();) {
    const auto [nonce, question] = *next++;  // a copy: End removes it
    if (now < question.deadline) continue;
    const std::string text = "the service at " + endpoint + " has not answered within " + Milliseconds(question.patience);
    End(nonce, question.order ? NoAnswer(question.patience) : Status::DeadlineExceeded(text));
  }
  return questions.size() < asked;
}

void Client::Impl::FailAll(const Status& reason) {
  while (!questions.empty()) End(questions.begin()->first, reason);
  while (!open.empty()) End(open.begin()->first, reason);
  pinged.clear();
  if (direct) direct->Clear();
  unanswered_since.reset();
}

Result<Client> Client::Connect(Context& context, const ServiceAddress& service, Duration timeout, ClientTiming timing,
                               const std::function<bool()>& give_up) {
  Result<Socket> socket = Socket::Dealer(context, {.client_keys = service.keys});
  if (!socket.ok()) return socket.status();
  if (Status connected = socket->Connect(service.endpoint); !connected.ok()) return connected;
  Client client(std::make_unique<Impl>(context, service, std::move(*socket), timing));
  client.impl_->SendPing(MonotonicNow());
  constexpr Duration kEachLook = std::chrono::milliseconds(100);  // at give_up, and whether the service admits it
  for (const Time end = MonotonicNow() + timeout; !client.impl_->pinged.empty();) {
    const Time now = MonotonicNow();
    if (now >= end || (give_up && give_up())) return client.impl_->NoAnswer(timeout);
    client.impl_->Pump(std::min(end, now + kEachLook));
    if (client.impl_->other_version) return client.impl_->OtherRelease();
    if (const auto& wrong = client.impl_->wrong_endpoint) return Status(wrong->code(), service.endpoint + ": " + wrong->message());
    if (client.impl_->socket.refused()) return client.impl_->NoAnswer(timeout);
  }
  return client;
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
  impl_->OpenDirectPictures();
  SubmitFrame message{.request = id, .deadline_ms = std::uint32_t(std::clamp<std::int64_t>(ms, 1, kMaxDeadlineMs)), .frame = request};
  if (impl_->direct) message.pictures = impl_->direct->door();
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

template <class Message>
RequestId Client::Impl::Ask(Message message, Duration patience) {
  const RequestId id = message.nonce = ++last_id;
  questions[id] = {patience, MonotonicNow() + patience, AnyOf<Message, StatusQuery, ShutDown, KeysOrder, DataOrder>};
  // What the service would refuse to decode is refused here, by the same rules.
  if (const auto checked = Decode<ClientToCoordinator>(Encode(message), 0); !checked.ok()) {
    End(id, checked.status());
  } else if (questions.size() > kMaxOpenQuestions) {
    End(id, Status::ResourceExhausted("at most " + std::to_string(kMaxOpenQuestions) + " questions may be open at once"));
  } else if (const Status sent = Send(message); !sent.ok()) {
    End(id, Status::Unavailable("no service at " + endpoint + ": " + sent.message()));
  }
  return id;
}

RequestId Client::Submit(Question question, Duration deadline) {
  return std::visit([&](auto& query) { return impl_->Ask(std::move(query), deadline); }, question);
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
  ClientEvent event = ToClientEvent(std::move(impl_->events.front()));
  impl_->events.pop_front();
  return event;
}

template <class Reply>
Result<Reply> Client::Impl::Await(RequestId id) {
  while (open.contains(id) || questions.contains(id)) {
    const bool woken = Pump(Time::max());
    if (const auto asked = questions.find(id); woken && asked != questions.end() && asked->second.order)
      End(id, Status::Unavailable("the question to the service was given up"));
  }
  decltype(Event::what) end = std::move(std::ranges::find(events.rbegin(), events.rend(), id, &Event::request)->what);
  std::erase_if(events, [id](const Event& event) { return event.request == id; });
  if (auto* failure = std::get_if<Status>(&end)) return std::move(*failure);
  if (auto* reply = std::get_if<Reply>(&end)) return std::move(*reply);
  return Status::Internal("the service answered another question");
}

Result<Picture> Client::Render(const FrameRequest& request, Duration deadline) { return impl_->Await<Picture>(Submit(request, deadline)); }

Result<SummaryReply> Client::Summarize(const std::string& dataset, const TransferChoice& transfer, Duration deadline) {
  return impl_->Await<SummaryReply>(impl_->Ask(SummaryQuery{.dataset = dataset, .transfer = transfer}, deadline));
}

Result<std::vector<VolumeSample>> Client::SampleAt(const std::string& dataset, std::vector<Vec3> points, Duration deadline) {
  const std::size_t count = points.size();
  Result<SampleReply> reply = impl_->Await<SampleReply>(impl_->Ask(SampleQuery{.dataset = dataset, .points = std::move(points)}, deadline));
  if (!reply.ok()) return reply.status();
  if (reply->samples.size() != count) {
    return Status::DataLoss("the service answered " + std::to_string(reply->samples.size()) + " of " + std::to_string(count) + " points");
  }
  return std::move(reply->samples);
}

Result<StatisticsReply> Client::StatisticsIn(const std::string& dataset, const ClipBox& box, bool labels, Duration deadline) {
  return impl_->Await<StatisticsReply>(impl_->Ask(StatisticsQuery{.dataset = dataset, .box = box, .labels = labels}, deadline));
}

Result<ViewReply> Client::ChooseView(ViewQuery query, Duration deadline) {
  return impl_->Await<ViewReply>(impl_->Ask(std::move(query), deadline));
}

Result<StatusReply> Client::QueryStatus(Duration timeout) { return impl_->Await<StatusReply>(impl_->Ask(StatusQuery{}, timeout)); }

Status Client::ShutDownService(Duration timeout) { return impl_->Await<ShutDownReply>(impl_->Ask(ShutDown{}, timeout)).status(); }

Result<std::vector<AdmittedKey>> Client::OrderKeys(KeysOrder order, Duration timeout) {
  Result<KeysReply> reply = impl_->Await<KeysReply>(impl_->Ask(std::move(order), timeout));
  if (!reply.ok()) return reply.status();
  return std::move(reply->keys);
}

Result<std::vector<DatasetStatus>> Client::OrderData(DataOrder order, Duration timeout) {
  Result<DataReply> reply = impl_->Await<DataReply>(impl_->Ask(std::move(order), timeout));
  if (!reply.ok()) return reply.status();
  return std::move(reply->datasets);
}

Wakeup& Client::wakeup() { return impl_->wakeup; }

}  // namespace slabstream
