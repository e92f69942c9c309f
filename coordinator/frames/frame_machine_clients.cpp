#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <ranges>
#include <string>
#include <utility>

#include "common/planning/levels.h"
#include "common/renderers/registry.h"
#include "coordinator/frames/frame_machine_state.h"

namespace slabstream {

namespace {

// Nobody but the client itself is connected to, whatever it says.
std::optional<PicturesAddress> AddressOf(const std::optional<PicturesDoor>& door, const std::string& host) {
  if (!door || host.empty()) return std::nullopt;
  return PicturesAddress{fmt::format("tcp://{}:{}", host, door->port), door->key};
}

FrameKind KindOf(const FrameRequest& frame) {
  return std::hash<std::string>()(
      fmt::format("{}\n{}\n{}\n{} {} {}", frame.dataset, frame.renderer, frame.level, frame.detail, frame.size.width, frame.size.height));
}

}  // namespace

void FrameMachine::State::OnSubmit(const FromClient& event, const SubmitFrame& message) {
  const PeerToken client = event.from;
  clients.Meet(client, now);
  if (IsOpen(client, message.request)) return;
  if (Answer* answer = clients.FindAnswer(client, message.request)) return SendAnswer(client, *answer);

  const Policy& policy = message.frame.policy;
  OpenRequest request{.client = client, .submit = message, .pictures = AddressOf(message.pictures, event.host), .arrived = now};
  if (Status names = CheckNames(policy); !names.ok()) return FailRequest(request, names, &RefusedRequests::bad_request);
  if (Status quota = WithinQuota(client); !quota.ok()) return FailRequest(request, quota, &RefusedRequests::over_quota);
  if (message.frame.previews) QueueCoarse(request);
  request.use = ++last_use;
  request.kind = KindOf(message.frame);
  forecast_due = true;
  queue.Push(std::move(request));
  actions.emplace_back(std::in_place_type<ToDatasets>, SeekDataset{last_use, std::make_shared<const FrameRequest>(message.frame)});
}

void FrameMachine::State::On(const DatasetNews& event) {
  for (const DatasetId dataset : event.unloaded) occupancy.Forget(dataset);
  std::map<UseId, DatasetLost> lost;
  queue.ForEach([&](OpenRequest& request) {
    const auto news = event.uses.find(request.use);
    if (news == event.uses.end()) return;
    if (const auto* awaited = std::get_if<DatasetAwaited>(&news->second)) {
      const bool first = std::holds_alternative<OpenRequest::Submitted>(request.state);
      request.state = OpenRequest::AwaitsDataset{};  // DropPlans drops a plan that it had
      if (first || awaited->read.percent > 0) SendQueued(request, awaited);
    } else if (const auto* ended = std::get_if<DatasetLost>(&news->second)) {
      lost[request.use] = *ended;
    } else if (const auto& ready = std::get<DatasetReady>(news->second);
               request.dataset() != nullptr && request.dataset()->DrawsFrom(ready)) {
      request.dataset()->seen = ready.seen;
    } else if (const Status suits = Resolve(request, ready); suits.ok()) {
      SendQueued(request, nullptr);
    } else {
      lost[request.use] = {suits, &RefusedRequests::bad_request};
    }
  });
  for (const OpenRequest& request : queue.Extract([&](const OpenRequest& each) { return lost.contains(each.use); })) {
    FailRequest(request, lost.at(request.use).why, lost.at(request.use).refused);
  }
}

// Errors as of ResolveRequest.
Status FrameMachine::State::Resolve(OpenRequest& request, const DatasetReady& ready) const {
  FrameRequest asked = request.submit.frame;
  if (ready.view) asked.view = *ready.view;
  if (ready.levels == nullptr && LevelNumber(asked.level).value_or(0) > 0) {
    return Status::InvalidArgument(fmt::format("level is {}, but dataset \"{}\" has level 0 alone", asked.level, asked.dataset));
  }
  const VolumeGeometry& drawn = ready.summary->description.geometry;
  const VolumeGeometry& finest = ready.levels == nullptr ? drawn : ready.levels->levels.front().geometry;
  Result<ResolvedRequest> resolved = ResolveRequest(AtLevel(asked, finest, drawn), ready.dataset, ready.summary, ready.fields);
  if (!resolved.ok()) return resolved.status();
  resolved->map = ready.map;
  resolved->coarser = ready.coarser;
  resolved->light = ready.light;
  // Nobody counts what nobody holds, nor what is drawn from several levels.
  const bool counted = !resolved->summary->stored && resolved->map == nullptr;
  request.needs_occupancy = NeedsOccupancy(asked.policy) && counted;
  const ViewParameters view = ready.view.value_or(resolved->frame.view);
  request.state = OpenRequest::HasDataset{.resolved = std::make_shared<const ResolvedRequest>(*std::move(resolved)),
                                          .seen = ready.seen,
                                          .levels = ready.levels,
                                          .drawn = ready.drawn,
                                          .view = view};
  return Status::Ok();
}

Status FrameMachine::State::WithinQuota(PeerToken client) const {
  const auto running = std::ranges::count_if(
      frames, [client](const RunningFrame& frame) { return frame.request().client == client && !frame.request().coarse; });
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

void FrameMachine::State::OnPing(const FromClient& event, const ClientPing& message) {
  const PeerToken client = event.from;
  clients.Read(client, message.received_bytes, event.unsent_bytes);
  ClientPong pong{.epoch = config.epoch, .nonce = message.nonce};
  for (const RequestId request : message.open) {
    Answer* answer = clients.FindAnswer(client, request);
    if (answer == nullptr && !IsOpen(client, request)) continue;
    pong.known.push_back(request);
    // If the client asks long after the answer was sent, a connection must have lost it.
    if (answer != nullptr && now >= answer->sent + config.client_timeout / 2) SendAnswer(client, *answer);
  }
  if (message.senders) {
    PictureSenders senders = roster.SendersOfPictures();
    if (senders.version != *message.senders) pong.senders = std::move(senders);
  }
  pong.lost = message.asked;
  if (pong.lost.empty()) return SendClient(client, std::move(pong));
  actions.emplace_back(std::in_place_type<ToDatasets>, FinishPong{client, std::move(pong)});
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
                    .datasets = {},
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
    for (const std::string_view ability : kind->AbilityNames()) renderer.abilities.emplace_back(ability);
    for (const RendererParameter& parameter : kind->parameters()) renderer.parameters.emplace_back(parameter.name);
  }
  reply.web = WebTrafficOfAll();
  actions.emplace_back(std::in_place_type<ToDatasets>, FinishStatus{client, std::move(reply)});
}

std::vector<WebTraffic> FrameMachine::State::WebTrafficOfAll() const {
  std::map<std::string, WebTraffic> of_servers;
  const auto add = [&](const std::vector<WebTraffic>& process) {
    for (const WebTraffic& traffic : process) {
      WebTraffic& sum = of_servers[traffic.server];
      sum.server = traffic.server;
      sum += traffic;
    }
  };
  if (config.web_traffic) add(config.web_traffic());
  for (const Member& member : roster.members()) add(member.web);
  std::vector<WebTraffic> all;
  for (auto& [server, traffic] : of_servers | std::views::take(kMaxWebServers)) all.push_back(std::move(traffic));
  return all;
}

void FrameMachine::State::OnClientMessage(PeerToken client, const ShutDown& message) {
  SendClient(client, ShutDownReply{.nonce = message.nonce});
  StopAll(Stop{.epoch = config.epoch}, "the service was shut down");
}

void FrameMachine::State::SendQueued(const OpenRequest& request, const DatasetAwaited* awaited) {
  if (request.coarse) return;
  const bool loading = awaited != nullptr && awaited->loading;
  SendClient(request.client, FrameProgress{.request = request.submit.request,
                                           .phase = loading ? FramePhase::kLoading : FramePhase::kQueued,
                                           .queue_position = queue.PositionOf(request.client, request.submit.request),
                                           .workers = std::uint32_t(roster.staying()),
                                           .read_percent = loading ? std::uint32_t(awaited->read.percent) : 0,
                                           .read_rate = loading ? awaited->read.bytes_per_second : 0});
}

void FrameMachine::State::SendAnswer(PeerToken client, Answer& answer) {
  answer.sent = now;
  SendClient(client, answer.message, answer.payload);
}

void FrameMachine::State::EndRequest(PeerToken client, RequestId request, CoordinatorToClient message, Bytes payload) {
  SendClient(client, message, payload);
  // What went straight to the client cannot be sent again: if it asks again, the frame is made anew.
  const auto* const reply = std::get_if<FrameReply>(&message);
  if (reply != nullptr && std::ranges::any_of(reply->shares, &PictureShare::direct)) return;
  clients.Keep(client, {.request = request, .message = std::move(message), .payload = std::move(payload), .sent = now});
}

void FrameMachine::State::AnswerFailure(const OpenRequest& request, const Status& status, RefusedAs as) {
  if (request.coarse) return;
  EndRequest(request.client, request.submit.request, FrameFailed{.request = request.submit.request, .status = Bounded(status)}, {});
  if (as != nullptr) {
    ++(refused.*as);
  } else {
    ++(status.code() == StatusCode::kCancelled ? frames_cancelled : frames_failed);
  }
}

// Of a request whose frame has not begun.
void FrameMachine::State::FailRequest(const OpenRequest& request, const Status& status, RefusedAs as) {
  actions.emplace_back(std::in_place_type<ToDatasets>, LeaveDataset{request.use});
  if (request.coarse) return;
  AnswerFailure(request, status, as);
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "request {} of client {} {}: {}", request.submit.request, request.client,
       as == nullptr ? "ends without a frame: dataset " + request.submit.frame.dataset : "is refused", status.message());
}

void FrameMachine::State::FreeClient(PeerToken client) {
  actions.emplace_back(std::in_place_type<ToDatasets>, ForgetClient{client});
  if (!clients.Forget(client)) return;
  for (const OpenRequest& request : queue.Forget(client)) {
    actions.emplace_back(std::in_place_type<ToDatasets>, LeaveDataset{request.use});
    frames_cancelled += request.coarse ? 0 : 1;
  }
  std::vector<FrameId> orphans;
  for (const RunningFrame& frame : frames) {
    if (frame.request().client != client) continue;
    orphans.push_back(frame.id());
    frames_cancelled += frame.request().coarse ? 0 : 1;
  }
  for (const FrameId id : orphans) EndFrame(id, "its client has gone");
}

}  // namespace slabstream
