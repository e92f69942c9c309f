#include "common/wire/codecs.h"
#include "common/wire/limits.h"
#include "common/wire/wire_text.h"

namespace slabstream {

v1::StatusQuery ToProto(const StatusQuery& in) {
  v1::StatusQuery out;
  out.set_nonce(in.nonce);
  return out;
}

StatusQuery FromProto(const v1::StatusQuery& in, Checker&) { return {.nonce = in.nonce()}; }

v1::WorkerStatus ToProto(const WorkerStatus& in) {
  v1::WorkerStatus out;
  out.set_worker(in.worker);
  out.set_pid(in.pid);
  out.set_host(WireText(in.host, kMaxNameBytes));
  out.set_threads(in.threads);
  out.set_slot(in.slot);
  out.set_cached_bytes(in.cached_bytes);
  out.set_fetched_bytes(in.fetched_bytes);
  out.set_rendered_ranks(in.rendered_ranks);
  out.set_silent_ms(in.silent_ms);
  return out;
}

WorkerStatus FromProto(const v1::WorkerStatus& in, Checker& check) {
  WorkerStatus out;
  out.worker = in.worker();
  out.pid = in.pid();
  out.host = check.Text("host", in.host(), 0, kMaxNameBytes);
  out.threads = check.Range("threads", in.threads(), 1, kMaxThreads);
  out.slot = in.slot();
  out.cached_bytes = in.cached_bytes();
  out.fetched_bytes = in.fetched_bytes();
  out.rendered_ranks = in.rendered_ranks();
  out.silent_ms = in.silent_ms();
  return out;
}

v1::DatasetStatus ToProto(const DatasetStatus& in) {
  v1::DatasetStatus out;
  out.set_name(WireText(in.name, kMaxNameBytes));
  out.set_state(WireEnum<v1::DatasetState>(in.state, DatasetState::kUnloaded));
  if (in.state == DatasetState::kReady) {
    *out.mutable_description() = ToProto(in.description);
    *out.mutable_range() = ToProto(in.range);
  }
  if (in.state == DatasetState::kFailed) out.set_error(WireText(in.error, kMaxTextBytes));
  return out;
}

DatasetStatus FromProto(const v1::DatasetStatus& in, Checker& check) {
  DatasetStatus out;
  out.name = check.Text("name", in.name(), 1, kMaxNameBytes);
  out.state = check.OneOf("state", in.state(), DatasetState::kUnloaded, DatasetState::kFailed);
  if (out.state == DatasetState::kReady) {
    out.description = Read("description", in.description(), check);
    out.range = Read("range", in.range(), check);
  }
  if (out.state == DatasetState::kFailed) out.error = check.Text("error", in.error(), 0, kMaxTextBytes);
  return out;
}

v1::StatusReply ToProto(const StatusReply& in) {
  v1::StatusReply out;
  out.set_epoch(in.epoch);
  out.set_nonce(in.nonce);
  out.set_pid(in.pid);
  out.set_uptime_ms(in.uptime_ms);
  out.set_clients(in.clients);
  out.set_queued(in.queued);
  out.set_running(in.running);
  out.set_frames_done(in.frames_done);
  out.set_frames_failed(in.frames_failed);
  out.set_workers_lost(in.workers_lost);
  WriteAll(in.workers, out.mutable_workers());
  WriteAll(in.datasets, out.mutable_datasets());
  return out;
}

StatusReply FromProto(const v1::StatusReply& in, Checker& check) {
  StatusReply out;
  out.epoch = in.epoch();
  out.nonce = in.nonce();
  out.pid = in.pid();
  out.uptime_ms = in.uptime_ms();
  out.clients = in.clients();
  out.queued = in.queued();
  out.running = in.running();
  out.frames_done = in.frames_done();
  out.frames_failed = in.frames_failed();
  out.workers_lost = in.workers_lost();
  out.workers = ReadAll("workers", in.workers(), kMaxListed, check);
  out.datasets = ReadAll("datasets", in.datasets(), kMaxListed, check);
  return out;
}

}  // namespace slabstream
