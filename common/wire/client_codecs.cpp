#include "common/wire/codecs.h"
#include "common/wire/limits.h"
#include "common/wire/wire_text.h"

namespace slabstream {

static_assert(v1::FramePhase_MAX == static_cast<int>(FramePhase::kRunning));
static_assert(v1::DatasetState_MAX == static_cast<int>(DatasetState::kFailed));

v1::SubmitFrame ToProto(const SubmitFrame& in) {
  v1::SubmitFrame out;
  out.set_request(in.request);
  out.set_deadline_ms(in.deadline_ms);
  *out.mutable_frame() = ToProto(in.frame);
  return out;
}

SubmitFrame FromProto(const v1::SubmitFrame& in, Checker& check) {
  SubmitFrame out;
  out.request = in.request();
  out.deadline_ms = check.Range("deadline_ms", in.deadline_ms(), 1, 86400000);
  out.frame = Read("frame", in.frame(), check);
  return out;
}

v1::FrameProgress ToProto(const FrameProgress& in) {
  v1::FrameProgress out;
  out.set_request(in.request);
  out.set_phase(WireEnum<v1::FramePhase>(in.phase, FramePhase::kQueued));
  out.set_queue_position(in.queue_position);
  out.set_groups_done(in.groups_done);
  out.set_group_count(in.group_count);
  out.set_attempt(in.attempt);
  out.set_workers(in.workers);
  return out;
}

FrameProgress FromProto(const v1::FrameProgress& in, Checker& check) {
  FrameProgress out;
  out.request = in.request();
  out.phase = check.OneOf("phase", in.phase(), FramePhase::kQueued, FramePhase::kRunning);
  out.queue_position = in.queue_position();
  out.group_count = check.Range("group_count", in.group_count(), 0, kMaxGroups);
  out.groups_done = check.Range("groups_done", in.groups_done(), 0, out.group_count);
  out.attempt = in.attempt();
  out.workers = in.workers();
  return out;
}

// Of seconds, and of the imbalance.
constexpr double kMaxPredicted = 1e9;

v1::FramePrediction ToProto(const FramePrediction& in) {
  v1::FramePrediction out;
  out.set_render_seconds(in.render_seconds);
  out.set_combine_seconds(in.combine_seconds);
  out.set_finish_seconds(in.finish_seconds);
  out.set_latency_seconds(in.latency_seconds);
  out.set_imbalance(in.imbalance);
  return out;
}

FramePrediction FromProto(const v1::FramePrediction& in, Checker& check) {
  FramePrediction out;
  out.render_seconds = check.Between("render_seconds", in.render_seconds(), 0, kMaxPredicted);
  out.combine_seconds = check.Between("combine_seconds", in.combine_seconds(), 0, kMaxPredicted);
  out.finish_seconds = check.Between("finish_seconds", in.finish_seconds(), 0, kMaxPredicted);
  out.latency_seconds = check.Between("latency_seconds", in.latency_seconds(), 0, kMaxPredicted);
  out.imbalance = check.Between("imbalance", in.imbalance(), 1, kMaxPredicted);
  return out;
}

v1::FrameStatistics ToProto(const FrameStatistics& in) {
  v1::FrameStatistics out;
  out.set_workers(in.workers);
  out.set_groups(in.groups);
  out.set_attempts(in.attempts);
  out.set_decomposition(WireText(in.decomposition, kMaxNameBytes));
  out.set_axis(WireText(in.axis, kMaxNameBytes));
  out.set_combine(WireText(in.combine, kMaxNameBytes));
  out.set_load_metric(WireText(in.load_metric, kMaxNameBytes));
  out.set_assignment(WireText(in.assignment, kMaxNameBytes));
  out.set_balance(WireText(in.balance, kMaxNameBytes));
  out.set_queued_ns(in.queued_ns);
  out.set_begin_ns(in.begin_ns);
  out.set_end_ns(in.end_ns);
  WriteAll(in.reports, out.mutable_reports());
  out.set_display(in.display);
  *out.mutable_grid() = ToProto(in.grid);
  if (in.predicted) *out.mutable_predicted() = ToProto(*in.predicted);
  return out;
}

FrameStatistics FromProto(const v1::FrameStatistics& in, Checker& check) {
  FrameStatistics out;
  out.workers = in.workers();
  out.groups = in.groups();
  out.attempts = in.attempts();
  out.decomposition = check.Text("decomposition", in.decomposition(), 0, kMaxNameBytes);
  out.axis = check.Text("axis", in.axis(), 0, kMaxNameBytes);
  out.combine = check.Text("combine", in.combine(), 0, kMaxNameBytes);
  out.load_metric = check.Text("load_metric", in.load_metric(), 0, kMaxNameBytes);
  out.assignment = check.Text("assignment", in.assignment(), 0, kMaxNameBytes);
  out.balance = check.Text("balance", in.balance(), 0, kMaxNameBytes);
  out.queued_ns = in.queued_ns();
  out.begin_ns = in.begin_ns();
  out.end_ns = in.end_ns();
  out.reports = ReadAll("reports", in.reports(), kMaxReports, check);
  out.display = in.display();
  out.grid = FromProto(in.grid(), check);
  if (in.has_predicted()) out.predicted = Read("predicted", in.predicted(), check);
  return out;
}

v1::FrameReply ToProto(const FrameReply& in) {
  v1::FrameReply out;
  out.set_request(in.request);
  *out.mutable_size() = ToProto(in.size);
  out.set_groups_done(in.groups_done);
  out.set_group_count(in.group_count);
  *out.mutable_runs() = ToProto(in.runs);
  *out.mutable_statistics() = ToProto(in.statistics);
  return out;
}

FrameReply FromProto(const v1::FrameReply& in, Checker& check) {
  FrameReply out;
  out.request = in.request();
  out.size = Read("size", in.size(), check);
  out.group_count = check.Range("group_count", in.group_count(), 1, kMaxGroups);
  out.groups_done = check.Range("groups_done", in.groups_done(), 0, out.group_count);
  out.runs = Read("runs", in.runs(), check);
  const PixelBounds picture = {0, 0, out.size.width, out.size.height};
  check.That(picture.Contains(out.runs.image.bounds), "runs.image.bounds", "not inside the picture");
  out.statistics = Read("statistics", in.statistics(), check);
  return out;
}

v1::FrameFailed ToProto(const FrameFailed& in) {
  v1::FrameFailed out;
  out.set_request(in.request);
  *out.mutable_status() = ToProto(in.status);
  return out;
}

FrameFailed FromProto(const v1::FrameFailed& in, Checker& check) {
  return {.request = in.request(), .status = Read("status", in.status(), check)};
}

v1::CancelFrame ToProto(const CancelFrame& in) {
  v1::CancelFrame out;
  out.set_request(in.request);
  return out;
}

CancelFrame FromProto(const v1::CancelFrame& in, Checker&) { return {.request = in.request()}; }

v1::ClientPing ToProto(const ClientPing& in) {
  v1::ClientPing out;
  out.set_nonce(in.nonce);
  out.mutable_open()->Add(in.open.begin(), in.open.end());
  return out;
}

ClientPing FromProto(const v1::ClientPing& in, Checker& check) {
  ClientPing out;
  out.nonce = in.nonce();
  out.open.assign(in.open().begin(), in.open().begin() + check.Count("open", in.open_size(), kMaxOpenRequests));
  return out;
}

v1::ClientPong ToProto(const ClientPong& in) {
  v1::ClientPong out;
  out.set_epoch(in.epoch);
  out.set_nonce(in.nonce);
  out.mutable_known()->Add(in.known.begin(), in.known.end());
  return out;
}

ClientPong FromProto(const v1::ClientPong& in, Checker& check) {
  ClientPong out;
  out.epoch = in.epoch();
  out.nonce = in.nonce();
  out.known.assign(in.known().begin(), in.known().begin() + check.Count("known", in.known_size(), kMaxOpenRequests));
  return out;
}

v1::ShutDown ToProto(const ShutDown& in) {
  v1::ShutDown out;
  out.set_nonce(in.nonce);
  return out;
}

ShutDown FromProto(const v1::ShutDown& in, Checker&) { return {.nonce = in.nonce()}; }

v1::ShutDownReply ToProto(const ShutDownReply& in) {
  v1::ShutDownReply out;
  out.set_nonce(in.nonce);
  return out;
}

ShutDownReply FromProto(const v1::ShutDownReply& in, Checker&) { return {.nonce = in.nonce()}; }

}  // namespace slabstream
