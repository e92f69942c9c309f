#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "common/planning/frame_occlusion.h"
#include "common/wire/codecs.h"
#include "common/wire/limits.h"
#include "common/wire/wire_text.h"

namespace slabstream {
namespace {

constexpr WorkerId kMaxWorkerId = std::numeric_limits<WorkerId>::max();

// `in` names every worker of the group and the display worker, nobody twice.
void CheckPeers(const GroupAssignment& in, Checker& check) {
  std::vector<WorkerId> known;
  known.reserve(in.peers.size());
  for (const Peer& peer : in.peers) known.push_back(peer.worker);
  std::sort(known.begin(), known.end());
  check.That(std::adjacent_find(known.begin(), known.end()) == known.end(), "peers", "a worker appears twice");
  const auto require = [&](WorkerId worker) {
    if (!std::binary_search(known.begin(), known.end(), worker)) check.Fail("peers", "worker " + std::to_string(worker) + " is missing");
  };
  require(in.display);
  for (const Placement& placement : in.group.placements) require(placement.worker);
}

void CheckHidden(const GroupAssignment& in, Checker& check) {
  const auto scope = check.In("hidden");
  check.That(in.hidden.empty() || in.key.group > 0, "", "a mask for the first group, in front of which there is nothing");
  check.Adopt(CheckFits(in.hidden, in.setup));
}

}  // namespace

v1::Register ToProto(const Register& in) {
  v1::Register out;
  out.set_incarnation(in.incarnation);
  out.set_pid(in.pid);
  out.set_host(WireText(in.host, kMaxNameBytes));
  out.set_images_endpoint(in.images_endpoint);
  out.set_threads(in.threads);
  out.set_memory_bytes(in.memory_bytes);
  out.set_memory_scope(in.memory_scope);
  out.set_lends_memory(in.lends_memory);
  return out;
}

Register FromProto(const v1::Register& in, Checker& check) {
  Register out;
  out.incarnation = in.incarnation();
  out.pid = in.pid();
  out.host = check.Text("host", in.host(), 0, kMaxNameBytes);
  out.images_endpoint = check.Text("images_endpoint", in.images_endpoint(), 1, kMaxEndpointBytes);
  out.threads = check.Range("threads", in.threads(), 1, kMaxThreads);
  out.memory_bytes = in.memory_bytes();
  out.memory_scope = in.memory_scope();
  out.lends_memory = in.lends_memory();
  return out;
}

v1::Welcome ToProto(const Welcome& in) {
  v1::Welcome out;
  out.set_epoch(in.epoch);
  out.set_incarnation(in.incarnation);
  out.set_worker(in.worker);
  out.set_slabs_endpoint(in.slabs_endpoint);
  out.set_heartbeat_ms(in.heartbeat_ms);
  out.set_timeout_ms(in.timeout_ms);
  return out;
}

Welcome FromProto(const v1::Welcome& in, Checker& check) {
  Welcome out;
  out.epoch = in.epoch();
  out.incarnation = in.incarnation();
  out.worker = check.Range("worker", in.worker(), 1, kMaxWorkerId);
  out.slabs_endpoint = check.Text("slabs_endpoint", in.slabs_endpoint(), 1, kMaxEndpointBytes);
  out.heartbeat_ms = check.Range("heartbeat_ms", in.heartbeat_ms(), 10, 60000);
  out.timeout_ms = check.Range("timeout_ms", in.timeout_ms(), 100, 600000);
  return out;
}

v1::Heartbeat ToProto(const Heartbeat& in) {
  v1::Heartbeat out;
  out.set_epoch(in.epoch);
  out.set_incarnation(in.incarnation);
  out.set_worker(in.worker);
  out.set_cached_bytes(in.cached_bytes);
  out.set_fetched_bytes(in.fetched_bytes);
  out.set_rendered_ranks(in.rendered_ranks);
  return out;
}

Heartbeat FromProto(const v1::Heartbeat& in, Checker&) {
  return {.epoch = in.epoch(),
          .incarnation = in.incarnation(),
          .worker = in.worker(),
          .cached_bytes = in.cached_bytes(),
          .fetched_bytes = in.fetched_bytes(),
          .rendered_ranks = in.rendered_ranks()};
}

v1::Ping ToProto(const Ping& in) {
  v1::Ping out;
  out.set_epoch(in.epoch);
  out.set_finished_before(in.finished_before);
  out.mutable_cancelled()->Add(in.cancelled.begin(), in.cancelled.end());
  return out;
}

Ping FromProto(const v1::Ping& in, Checker& check) {
  Ping out;
  out.epoch = in.epoch();
  out.finished_before = in.finished_before();
  out.cancelled.assign(in.cancelled().begin(), in.cancelled().begin() + check.Count("cancelled", in.cancelled_size(), kMaxCancelled));
  return out;
}

v1::Peer ToProto(const Peer& in) {
  v1::Peer out;
  out.set_worker(in.worker);
  out.set_images_endpoint(in.images_endpoint);
  out.set_memory_scope(in.memory_scope);
  return out;
}

Peer FromProto(const v1::Peer& in, Checker& check) {
  return {.worker = check.Range("worker", in.worker(), 1, kMaxWorkerId),
          .images_endpoint = check.Text("images_endpoint", in.images_endpoint(), 1, kMaxEndpointBytes),
          .memory_scope = in.memory_scope()};
}

v1::GroupAssignment ToProto(const GroupAssignment& in) {
  v1::GroupAssignment out;
  out.set_epoch(in.epoch);
  *out.mutable_key() = ToProto(in.key);
  out.set_finished_before(in.finished_before);
  out.set_group_count(in.group_count);
  out.set_first_group(in.first_group);
  out.set_previews(in.previews);
  out.set_groups_done(in.groups_done);
  out.set_display(in.display);
  *out.mutable_setup() = ToProto(in.setup);
  *out.mutable_group() = ToProto(in.group);
  WriteAll(in.peers, out.mutable_peers());
  *out.mutable_hidden() = ToProto(in.hidden);
  return out;
}

GroupAssignment FromProto(const v1::GroupAssignment& in, Checker& check) {
  GroupAssignment out;
  out.epoch = in.epoch();
  out.key = Read("key", in.key(), check);
  out.finished_before = in.finished_before();
  out.group_count = check.Range("group_count", in.group_count(), out.key.group + 1, kMaxGroups);
  out.first_group = check.Range("first_group", in.first_group(), 0, out.key.group);
  out.previews = in.previews();
  out.groups_done = check.Range("groups_done", in.groups_done(), 0, out.key.group);
  out.display = check.Range("display", in.display(), 1, kMaxWorkerId);
  out.setup = Read("setup", in.setup(), check);
  out.group = Read("group", in.group(), check);
  out.peers = ReadAll("peers", in.peers(), kMaxPeers, check);
  out.hidden = Read("hidden", in.hidden(), check);
  if (!check.ok()) return out;
  CheckPeers(out, check);
  CheckHidden(out, check);
  const auto scope = check.In("group");
  CheckFits(out.group, out.setup, check);
  return out;
}

v1::GroupDone ToProto(const GroupDone& in) {
  v1::GroupDone out;
  out.set_epoch(in.epoch);
  out.set_worker(in.worker);
  *out.mutable_key() = ToProto(in.key);
  WriteAll(in.reports, out.mutable_reports());
  *out.mutable_hidden() = ToProto(in.hidden);
  return out;
}

GroupDone FromProto(const v1::GroupDone& in, Checker& check) {
  GroupDone out;
  out.epoch = in.epoch();
  out.worker = in.worker();
  out.key = Read("key", in.key(), check);
  out.reports = ReadAll("reports", in.reports(), kMaxReports, check);
  out.hidden = Read("hidden", in.hidden(), check);
  return out;
}

v1::FrameImage ToProto(const FrameImage& in) {
  v1::FrameImage out;
  out.set_epoch(in.epoch);
  out.set_worker(in.worker);
  out.set_frame(in.frame);
  out.set_attempt(in.attempt);
  out.set_groups_done(in.groups_done);
  out.set_group_count(in.group_count);
  *out.mutable_runs() = ToProto(in.runs);
  WriteAll(in.reports, out.mutable_reports());
  return out;
}

FrameImage FromProto(const v1::FrameImage& in, Checker& check) {
  FrameImage out;
  out.epoch = in.epoch();
  out.worker = in.worker();
  out.frame = in.frame();
  out.attempt = in.attempt();
  out.group_count = check.Range("group_count", in.group_count(), 1, kMaxGroups);
  out.groups_done = check.Range("groups_done", in.groups_done(), 0, out.group_count);
  out.runs = Read("runs", in.runs(), check);
  out.reports = ReadAll("reports", in.reports(), kMaxReports, check);
  return out;
}

v1::WorkerTrouble ToProto(const WorkerTrouble& in) {
  v1::WorkerTrouble out;
  out.set_epoch(in.epoch);
  out.set_worker(in.worker);
  *out.mutable_key() = ToProto(in.key);
  out.set_unreachable(in.unreachable);
  *out.mutable_status() = ToProto(in.status);
  out.set_elsewhere(in.elsewhere);
  return out;
}

WorkerTrouble FromProto(const v1::WorkerTrouble& in, Checker& check) {
  WorkerTrouble out;
  out.epoch = in.epoch();
  out.worker = in.worker();
  out.key = Read("key", in.key(), check);
  out.unreachable = in.unreachable();
  out.status = Read("status", in.status(), check);
  out.elsewhere = in.elsewhere();
  return out;
}

v1::Leave ToProto(const Leave& in) {
  v1::Leave out;
  out.set_epoch(in.epoch);
  out.set_worker(in.worker);
  return out;
}

Leave FromProto(const v1::Leave& in, Checker&) { return {.epoch = in.epoch(), .worker = in.worker()}; }

v1::Retire ToProto(const Retire& in) {
  v1::Retire out;
  out.set_epoch(in.epoch);
  return out;
}

Retire FromProto(const v1::Retire& in, Checker&) { return {.epoch = in.epoch()}; }

v1::Stop ToProto(const Stop& in) {
  v1::Stop out;
  out.set_epoch(in.epoch);
  return out;
}

Stop FromProto(const v1::Stop& in, Checker&) { return {.epoch = in.epoch()}; }

}  // namespace slabstream
