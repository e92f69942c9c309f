#include "client/client_impl.h"

#include <algorithm>
#include <iterator>

#include "client/decode_picture.h"
#include "common/base/log.h"
#include "common/base/overloaded.h"
#include "common/threads/guarded.h"
#include "common/wire/other_version.h"

namespace slabstream {
namespace {

constexpr int kMaxResubmits = 3;  // before it fails
constexpr char kLostTooOften[] = "lost the request 4 times";

std::string Milliseconds(Duration duration) {
  return std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count()) + " ms";
}

}  // namespace

Status Client::Impl::NoAnswer(Duration timeout) const {
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

void Client::Impl::EndUnlessSent(RequestId request, const Status& sent) {
  if (!sent.ok()) End(request, Status::Unavailable("no service at " + endpoint + ": " + sent.message()));
}

void Client::Impl::SendPing(Time now) {
  ClientPing ping{.nonce = ++last_id, .open = {}, .received_bytes = received_bytes};
  if (direct) ping.senders = direct->senders();
  told_bytes = received_bytes;
  for (const auto& [request, unused] : open) {
    if (ping.open.size() < kMaxOpenRequests) ping.open.push_back(request);
  }
  for (const auto& [nonce, unused] : questions) ping.asked.push_back(nonce);
  unreachable = !Send(ping).ok();  // it counts as unanswered
  std::ranges::copy(ping.asked, std::back_inserter(ping.open));
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
      if (const auto other = OtherVersion(incoming->header())) {
        FailAll(refusal = Status::InvalidArgument("the service at " + endpoint + " " + TextOfOtherVersion(*other)));
        continue;
      }
      LogWarning("client plane: dropped a message: " + message.status().message());
      continue;
    }
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

// Else the service takes this client for one that does not read.
void Client::Impl::TellReceived() {
  constexpr std::uint64_t kTellBytes = std::uint64_t{1} << 20;
  if (received_bytes - told_bytes >= kTellBytes) SendPing(MonotonicNow());
}

void Client::Impl::Handle(CoordinatorToClient& message, const Bytes& payload) {
  const auto handle = Overloaded{[&](FrameProgress& progress) {
                                   if (open.contains(progress.request)) events.push_back({progress.request, progress});
                                 },
                                 [&](FrameReply& reply) { Handle(reply, payload); },
                                 [&](FrameFailed& failed) { End(failed.request, failed.status); },
                                 [&](ClientPong& pong) { Handle(pong); },
                                 [&](OrderRefused& refused) {
                                   if (refused.nonce == 0)
                                     refusal = Status(refused.status.code(), endpoint + ": " + refused.status.message());
                                   End(refused.nonce, refused.status);
                                 },
                                 [&](auto& reply) {
                                   const auto asked = questions.find(reply.nonce);
                                   if (asked == questions.end()) return;
                                   Event::What answer = std::move(reply);
                                   if (answer.index() != asked->second.answer)
                                     answer = Status::Internal("the service answered another question");
                                   End(asked->first, std::move(answer));
                                 },
                                 [](VolumeCredit&) { LogWarning("client plane: dropped a VolumeCredit: this client sends no volumes"); }};
  std::visit(handle, message);
}

void Client::Impl::OpenDirectPictures() {
  if (std::exchange(direct_opened, true) || !takes_pictures) return;
  direct = DirectPictures::Open(context, endpoint);
  if (direct) SendPing(MonotonicNow());  // the answer says whom to admit
}

void Client::Impl::MatchPictures() {
  if (!direct) return;
  for (DirectPictures::Reply& reply : direct->TakeCome()) Handle(std::move(reply));
  if (open.empty()) direct->DropUnclaimed();  // they are of requests that were cancelled
}

bool Client::Impl::ExpirePictures(Time now) {
  const std::vector<DirectPictures::Lost> lost = direct ? direct->TakeLost(now) : std::vector<DirectPictures::Lost>();
  for (const auto& [reply, missing_bytes] : lost) {
    received_bytes += missing_bytes;  // the service counts them as sent: they must not be unread for ever
    TellReceived();
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
  Result<Picture> picture = Guarded("the picture", [&] { return DecodePicture(reply, complete.runs, found->second.message.frame); });
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
  pinged.clear();  // older ones will not be answered any more, later ones do not ask about what is sent again now
  for (const RequestId id : asked) {
    const auto request = open.find(id);
    const auto question = questions.find(id);
    const bool waits = request != open.end() && !request->second.awaits_picture;
    if (waits && std::ranges::count(pong.known, id) == 0) SubmitAgain(request->second);
    if (question != questions.end() && std::ranges::count(pong.lost, id) > 0) AskAgain(id, question->second);
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
    End(request, Status::Unavailable("the service at " + endpoint + " " + kLostTooOften));
  }
}

void Client::Impl::AskAgain(RequestId nonce, OpenQuestion& lost) {
  const bool again = !lost.message.empty();
  if (again && lost.resubmits++ < kMaxResubmits) return EndUnlessSent(nonce, socket.Send({}, lost.message));
  const std::string once = "was restarted, or its connection broke: the order may have been carried out or not";
  End(nonce, Status::Unavailable("the service at " + endpoint + " " + (again ? kLostTooOften : once)));
}

void Client::Impl::End(RequestId request, Event::What end) {
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

}  // namespace slabstream
