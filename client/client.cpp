#include "client/client.h"

#include <algorithm>
#include <type_traits>

#include "client/client_impl.h"
#include "common/base/any_of.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

constexpr std::int64_t kMaxDeadlineMs = 86'400'000;

// Answers to orders are for those who wait for them.
ClientEvent ToClientEvent(auto event) {
  const auto what = [](auto& known) -> decltype(ClientEvent::what) {
    if constexpr (AnyOf<std::decay_t<decltype(known)>, FrameProgress, Picture, StatusReply, SteerReply, Status>) return std::move(known);
    if constexpr (requires { QuestionReply(std::move(known)); }) return QuestionReply(std::move(known));
    return Status::Internal("nobody waits for the answer to an order");
  };
  return {event.request, std::visit(what, event.what)};
}

}  // namespace

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
    if (!client.impl_->refusal.ok()) return client.impl_->refusal;
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
  impl_->open.emplace(id, Impl::OpenRequest{.message = message, .submitted = now, .deadline = limit});
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
  const bool order = requires { Order(message); };
  bool changes = std::is_same_v<Message, ShutDown>;
  if constexpr (requires { message.action; }) changes = message.action != decltype(message.action)::kList;
  if constexpr (std::is_same_v<Message, SteerDataset>) changes = !message.values.empty();
  const std::vector<std::byte> bytes = Encode(message);
  questions[id] = {patience, MonotonicNow() + patience, order, Event::Asked(std::in_place_type<Message>).index(),
                   changes ? std::vector<std::byte>() : bytes};
  // What the service would refuse to decode is refused here, by the same rules.
  if (const auto checked = Decode<ClientToCoordinator>(bytes, 0); !checked.ok()) {
    End(id, checked.status());
  } else if (questions.size() > kMaxOpenQuestions) {
    End(id, Status::ResourceExhausted("at most " + std::to_string(kMaxOpenQuestions) + " questions may be open at once"));
  } else {
    EndUnlessSent(id, socket.Send({}, bytes));
  }
  return id;
}

RequestId Client::Submit(Question question, Duration deadline) {
  return std::visit([&](auto& query) { return impl_->Ask(std::move(query), deadline); }, question);
}

RequestId Client::Submit(StatusQuery question, Duration timeout) { return impl_->Ask(question, timeout); }

RequestId Client::Submit(SteerDataset order, Duration timeout) { return impl_->Ask(std::move(order), timeout); }

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
  Event::What end = std::move(std::ranges::find(events.rbegin(), events.rend(), id, &Event::request)->what);
  std::erase_if(events, [id](const Event& event) { return event.request == id; });
  if (auto* failure = std::get_if<Status>(&end)) return std::move(*failure);
  return std::get<Reply>(std::move(end));
}

Result<Picture> Client::Render(const FrameRequest& request, Duration deadline) { return impl_->Await<Picture>(Submit(request, deadline)); }

Result<SummaryReply> Client::Summarize(SummaryQuery query, Duration deadline) {
  return impl_->Await<SummaryReply>(impl_->Ask(std::move(query), deadline));
}

Result<std::vector<VolumeSample>> Client::SampleAt(SampleQuery query, Duration deadline) {
  const std::size_t count = query.points.size();
  Result<SampleReply> reply = impl_->Await<SampleReply>(impl_->Ask(std::move(query), deadline));
  if (!reply.ok()) return reply.status();
  if (reply->samples.size() != count) {
    return Status::DataLoss("the service answered " + std::to_string(reply->samples.size()) + " of " + std::to_string(count) + " points");
  }
  return std::move(reply->samples);
}

Result<StatisticsReply> Client::StatisticsIn(StatisticsQuery query, Duration deadline) {
  return impl_->Await<StatisticsReply>(impl_->Ask(std::move(query), deadline));
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

Result<SimulationStatus> Client::Steer(SteerDataset order, Duration timeout) {
  Result<SteerReply> reply = impl_->Await<SteerReply>(impl_->Ask(std::move(order), timeout));
  if (!reply.ok()) return reply.status();
  return std::move(reply->simulation);
}

Wakeup& Client::wakeup() { return impl_->wakeup; }

}  // namespace slabstream
