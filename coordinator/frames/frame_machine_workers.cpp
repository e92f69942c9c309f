#include <utility>

#include "common/planning/key_of_picture.h"
#include "coordinator/frames/frame_machine_state.h"

namespace slabstream {

void FrameMachine::State::OnWorkerMessage(const FromWorker& event, const Register& message) {
  for (const WorkerId dead : roster.ReplacedBy(message, event.from)) LoseWorker(dead, LiveRoster::Loss::kSilent);
  if (roster.empty()) next_ping = now + config.heartbeat;
  const std::size_t members_before = roster.members().size();
  const WorkerId worker = roster.Admit(message, event.from, now);
  if (roster.members().size() > members_before) {  // else it has not heard of its Welcome
    Tell(NoteAbout::kWorkers, LogLevel::kInfo, "worker {} is here: pid {} on {}, {} threads, slot {}", worker, message.pid, message.host,
         message.threads, roster.PlaceOf(worker).slot);
  }
  SendWorker(worker, Welcome{.epoch = config.epoch,
                             .incarnation = message.incarnation,
                             .worker = worker,
                             .voxels_endpoint = config.voxels_endpoint,
                             .heartbeat_ms = Milliseconds(config.heartbeat),
                             .timeout_ms = Milliseconds(config.worker_timeout)});
}

void FrameMachine::State::OnWorkerMessage(const FromWorker& event, const Heartbeat& message) {
  const Member* const member = roster.Find(message.worker);
  const bool was_leaving = member == nullptr || member->leaving;
  const LiveRoster::News news = message.epoch == config.epoch ? roster.Hear(message, event.from, now) : LiveRoster::News{};
  if (news.known) {
    if (message.leaving && !was_leaving) {
      Tell(NoteAbout::kWorkers, LogLevel::kInfo, "worker {} is leaving: it finishes what it has", message.worker);
    }
    for (RunningFrame& frame : frames) {
      if (news.moved) frame.OnReconnection(message.worker, now);
      frame.OnHeartbeat(message.worker, news.progressed, now);
    }
    SendWorker(message.worker, MakePing(message.worker));
  } else if (!news.stale) {
    actions.emplace_back(TellWorkers{.to = {event.from}, .message = Retire{.epoch = config.epoch}});
  }
}

void FrameMachine::State::OnWorkerMessage(const FromWorker& event, const GroupDone& message) {
  if (!IsFrom(event, message.epoch, message.worker)) return;
  roster.Touch(message.worker, now);
  RunningFrame* frame = frames.Find(message.key.frame);
  if (frame != nullptr && frame->OnGroupDone(message, now)) AfterGroupDone(*frame);
}

void FrameMachine::State::OnWorkerMessage(const FromWorker& event, const FrameImage& message) {
  if (!IsFrom(event, message.epoch, message.worker)) return;
  roster.Touch(message.worker, now);
  RunningFrame* frame = frames.Find(message.frame);
  if (frame == nullptr || (message.picture.direct && !frame->request().pictures)) return;
  const std::uint32_t groups_before = frame->groups_done();
  const RunningFrame::Use use = frame->OnImage(message, event.payload, now);
  if (frame->groups_done() > groups_before) AfterGroupDone(*frame);
  if (use == RunningFrame::Use::kNothing) return;

  const OpenRequest& request = frame->request();
  auto [shares, payload] = frame->TakePicture();
  FrameReply reply{.request = request.submit.request,
                   .size = request.submit.frame.size,
                   .groups_done = request.coarse ? 0 : message.groups_done,
                   .group_count = message.group_count,
                   .shares = std::move(shares),
                   .statistics = {},
                   .geometry = PictureGeometryOf(frame->plan().setup)};
  if (request.submit.frame.key) reply.key = KeyOf(*frame->planned()->asked.resolved);
  for (const PictureShare& share : reply.shares) {
    if (share.direct) clients.Sent(request.client, share.runs.encoded_bytes);
  }
  if (use == RunningFrame::Use::kPreview || request.coarse) {
    if (!clients.IsBehind(request.client)) SendClient(request.client, std::move(reply), std::move(payload));
    if (request.coarse) EndFrame(message.frame, "done, as a preview");
    return;
  }
  reply.statistics = frame->Statistics(now);
  if (frame->planned()->teaches()) actions.emplace_back(FrameMeasured{frame->planned(), reply.statistics.reports});
  EndRequest(request.client, request.submit.request, std::move(reply), std::move(payload));
  ++frames_done;
  EndFrame(message.frame, "done", DeadlineForecast::Ended::kDone);
}

void FrameMachine::State::OnWorkerMessage(const FromWorker& event, const WorkerTrouble& message) {
  if (!IsFrom(event, message.epoch, message.worker) || roster.Find(message.worker) == nullptr) return;
  roster.Touch(message.worker, now);
  RunningFrame* frame = frames.Find(message.key.frame);
  if (frame == nullptr) return;
  if (message.unreachable != 0) {
    if (roster.Find(message.unreachable) == nullptr) return;         // known to be lost: the frame has been planned anew already
    SendWorker(message.unreachable, MakePing(message.unreachable));  // if it cannot be sent, the complaint is right
  }
  const Status status = frame->OnTrouble(message, now);
  if (!status.ok()) FailFrame(*frame, status);
}

void FrameMachine::State::OnWorkerMessage(const FromWorker& event, const Leave& message) {
  if (IsFrom(event, message.epoch, message.worker)) RemoveWorker(message.worker, LiveRoster::Loss::kLeft);
}

void FrameMachine::State::LoseWorker(WorkerId worker, LiveRoster::Loss loss) {
  ++workers_lost;
  RemoveWorker(worker, loss);
}

void FrameMachine::State::RemoveWorker(WorkerId worker, LiveRoster::Loss loss) {
  const Member* member = roster.Find(worker);
  if (member == nullptr) return;
  const double silent = std::chrono::duration<double>(now - member->last_heard).count();
  switch (loss) {
    case LiveRoster::Loss::kLeft: Tell(NoteAbout::kWorkers, LogLevel::kInfo, "worker {} has left", worker); break;
    case LiveRoster::Loss::kSilent:
      Tell(NoteAbout::kWorkers, LogLevel::kWarning, "worker {} is lost: not heard for {:.1f} s", worker, silent);
      break;
    case LiveRoster::Loss::kGone:
      Tell(NoteAbout::kWorkers, LogLevel::kWarning, "worker {} is lost: its connection has ended", worker);
      break;
  }
  const std::optional<Time> last_word = loss == LiveRoster::Loss::kGone ? std::optional(member->last_heard) : std::nullopt;
  roster.Remove(worker, now, loss);
  for (auto it = frames.begin(); it != frames.end();) {
    RunningFrame& frame = *it++;  // FailFrame removes it
    if (const Status status = frame.OnLoss(worker, last_word, now); !status.ok()) FailFrame(frame, status);
  }
}

}  // namespace slabstream
