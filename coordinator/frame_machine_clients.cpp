#include <algorithm>
#include <utility>

#include "common/renderers/registry.h"
#include "coordinator/frame_machine_state.h"

namespace slabstream {

void FrameMachine::State::On(const BadRequest& event) {
  ++refused.bad_request;
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "a request of client {} is refused: {}", event.from, event.why.message());
  if (const auto* order = std::get_if<OrderRefused>(&event.answer)) {
    if (const Upload upload = UploadOf(event.from, order->nonce); upload != uploads.end()) return EndUpload(upload, event.why);
  }
  SendClient(event.from, event.answer);
}

void FrameMachine::State::OnClientMessage(PeerToken client, const SubmitFrame& message) {
  clients.Meet(client, now);
  if (IsOpen(client, message.request)) return;
  if (Answer* answer = clients.FindAnswer(client, message.request)) return SendAnswer(client, *answer);

  OpenRequest request{.client = client, .submit = message, .arrived = now};
  const std::string& name = message.frame.dataset;
  if (datasets.folders.empty() && datasets.Find(name) == nullptr) {
    return RefuseRequest(request, datasets.NoSuchDataset(name), &RefusedRequests::unknown_dataset);
  }
  if (Status names = CheckNames(message.frame.policy); !names.ok()) return RefuseRequest(request, names, &RefusedRequests::bad_request);
  if (Status quota = WithinQuota(client); !quota.ok()) return RefuseRequest(request, quota, &RefusedRequests::over_quota);
  request.needs_occupancy = NeedsOccupancy(message.frame.policy);
  if (Status sought = Seek(request); !sought.ok()) return RefuseRequest(request, sought, &RefusedRequests::bad_request);
  queue.Push(request);
  SendQueued(request);
}

Status FrameMachine::State::WithinQuota(PeerToken client) const {
  const auto running = std::ranges::count(frames, client, [](const RunningFrame& frame) { return frame.request().client; });
  if (queue.CountOf(client) + std::size_t(running) >= kMaxOpenRequests) {
    return Status::ResourceExhausted("this client has " + std::to_string(kMaxOpenRequests) +
                                     " open requests, which is the limit of a client");
  }
  if (queue.size() >= config.max_queued) {
    return Status::ResourceExhausted(std::to_string(queue.size()) + " frames are queued, which is the limit of the service");
  }
  return Status::Ok();
}

void FrameMachine::State::OnClientMessage(PeerToken client, const CancelFrame& message) {
  clients.Meet(client, now);
  const Status cancelled = Status::Cancelled("the client cancelled the frame");
  const auto queued = queue.Extract([&](const OpenRequest& request) { return request.Is(client, message.request); });
  if (!queued.empty()) {
    FailRequest(queued.front(), cancelled);
  } else if (const RunningFrame* frame = frames.FindRequest(client, message.request)) {
    FailFrame(*frame, cancelled);
  } else if (Answer* answer = clients.FindAnswer(client, message.request)) {
    SendAnswer(client, *answer);
  } else {
    // The SubmitFrame may still be under way: the answer is kept, so that it ends like this, too.
    EndRequest(client, message.request, FrameFailed{.request = message.request, .status = cancelled}, {});
  }
}

void FrameMachine::State::OnClientMessage(PeerToken client, const ClientPing& message) {
  clients.Read(client, message.received_bytes);
  ClientPong pong{.epoch = config.epoch, .nonce = message.nonce};
  for (const RequestId request : message.open) {
    Answer* answer = clients.FindAnswer(client, request);
    if (answer == nullptr && !IsOpen(client, request)) continue;
    pong.known.push_back(request);
    // If the client asks long after the answer was sent, a connection must have lost it.
    if (answer != nullptr && now >= answer->sent + config.client_timeout / 2) SendAnswer(client, *answer);
  }
  SendClient(client, std::move(pong));
}

void FrameMachine::State::OnClientMessage(PeerToken client, const StatusQuery& message) {
  StatusReply reply{.epoch = config.epoch,
                    .nonce = message.nonce,
                    .pid = config.pid,
                    .uptime_ms = std::uint64_t(std::chrono::duration_cast<std::chrono::milliseconds>(now - *started).count()),
                    .clients = std::uint32_t(clients.size()),
                    .queued = std::uint32_t(queue.size()),
                    .running = std::uint32_t(frames.size()),
                    .frames_done = frames_done,
                    .frames_failed = frames_failed,
                    .workers_lost = workers_lost,
                    .datasets = datasets.Report(now),
                    .memory_bytes = config.memory_bytes,
                    .refused = refused};
  for (const Member& member : roster.members()) {
    reply.workers.push_back({.worker = member.id,
                             .pid = member.description.pid,
                             .host = member.description.host,
                             .threads = member.description.threads,
                             .slot = roster.PlaceOf(member.id).slot,
                             .cached_bytes = member.cached_bytes,
                             .fetched_bytes = member.fetched_bytes,
                             .rendered_ranks = member.rendered_ranks,
                             .silent_ms = Milliseconds(std::max(now - member.last_heard, Duration::zero())),
                             .leaving = member.leaving,
                             .memory_bytes = member.description.memory_bytes});
  }
  for (const RendererKind* kind : Renderers()) {
    RendererStatus& renderer = reply.renderers.emplace_back(RendererStatus{std::string(kind->name()), std::string(kind->title()), {}, {}});
    for (const Ability ability : kind->abilities()) renderer.abilities.emplace_back(NameOf(ability));
    for (const RendererParameter& parameter : kind->parameters()) renderer.parameters.emplace_back(parameter.name);
  }
  SendClient(client, std::move(reply));
}

void FrameMachine::State::OnClientMessage(PeerToken client, const ShutDown& message) {
  SendClient(client, ShutDownReply{.nonce = message.nonce});
  StopAll(Stop{.epoch = config.epoch}, "the service was shut down");
}

void FrameMachine::State::SendQueued(const OpenRequest& request) {
  const bool loading = datasets.Find(request.submit.frame.dataset)->state == DatasetState::kLoading;
  SendClient(request.client, FrameProgress{.request = request.submit.request,
                                           .phase = loading ? FramePhase::kLoading : FramePhase::kQueued,
                                           .queue_position = queue.PositionOf(request.client, request.submit.request),
                                           .workers = std::uint32_t(roster.staying())});
}

void FrameMachine::State::SendAnswer(PeerToken client, Answer& answer) {
  answer.sent = now;
  SendClient(client, answer.message, answer.payload);
}

void FrameMachine::State::EndRequest(PeerToken client, RequestId request, CoordinatorToClient message, Bytes payload) {
  SendClient(client, message, payload);
  clients.Keep(client, {.request = request, .message = std::move(message), .payload = std::move(payload), .sent = now});
}

void FrameMachine::State::AnswerFailure(const OpenRequest& request, const Status& status) {
  EndRequest(request.client, request.submit.request, FrameFailed{.request = request.submit.request, .status = Bounded(status)}, {});
  if (status.code() != StatusCode::kCancelled) ++frames_failed;
}

// Of a request whose frame has not begun.
void FrameMachine::State::FailRequest(const OpenRequest& request, const Status& status) {
  AnswerFailure(request, status);
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "request {} of client {} ends without a frame: dataset {}: {}", request.submit.request,
       request.client, request.submit.frame.dataset, status.message());
}

void FrameMachine::State::RefuseRequest(const OpenRequest& request, const Status& status, Refusal reason) {
  ++(refused.*reason);
  EndRequest(request.client, request.submit.request, FrameFailed{.request = request.submit.request, .status = Bounded(status)}, {});
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "request {} of client {} is refused: {}", request.submit.request, request.client,
       status.message());
}

void FrameMachine::State::FreeClient(PeerToken client) {
  if (const Upload upload = UploadOf(client); upload != uploads.end()) EndUpload(upload, Status::Unavailable("its client has gone"));
  std::erase_if(questions, [client](const auto& open) { return open.second.client == client; });
  if (!clients.Forget(client)) return;
  queue.Forget(client);
  std::vector<FrameId> orphans;
  for (const RunningFrame& frame : frames) {
    if (frame.request().client == client) orphans.push_back(frame.id());
  }
  for (const FrameId id : orphans) EndFrame(id, "its client has gone");
}

}  // namespace slabstream
