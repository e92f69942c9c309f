// Messages of the control plane.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "common/planning/frame_occlusion.h"
#include "common/wire/plan_fields.h"
#include "slabstream/v1/control.pb.h"

namespace slabstream {

// The fields `slot` and `slots` of a message P.
template <class P>
void PlaceFields(auto& io, Is<SlotPlace> auto& m) {
  io.Any(m.slot, &P::slot, &P::set_slot);
  io.Any(m.slots, &P::slots, &P::set_slots);
}

v1::Register ProtoOf(const Register&);
void Fields(auto& io, Is<Register> auto& m) {
  using P = v1::Register;
  io.Any(m.incarnation, &P::incarnation, &P::set_incarnation);
  io.Any(m.pid, &P::pid, &P::set_pid);
  io.Text("host", m.host, &P::host, &P::mutable_host, 0, kMaxNameBytes);
  io.Bytes("images_endpoint", m.images_endpoint, &P::images_endpoint, &P::mutable_images_endpoint, 1, kMaxEndpointBytes);
  io.Range("threads", m.threads, &P::threads, &P::set_threads, 1, kMaxThreads);
  io.Any(m.memory_bytes, &P::memory_bytes, &P::set_memory_bytes);
  io.Any(m.memory_scope, &P::memory_scope, &P::set_memory_scope);
  io.Any(m.lends_memory, &P::lends_memory, &P::set_lends_memory);
  io.Bytes("images_key", m.images_key, &P::images_key, &P::mutable_images_key, 0, kKeyTextBytes);
  PlaceFields<P>(io, m.place);
}

v1::Welcome ProtoOf(const Welcome&);
void Fields(auto& io, Is<Welcome> auto& m) {
  using P = v1::Welcome;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.incarnation, &P::incarnation, &P::set_incarnation);
  io.Range("worker", m.worker, &P::worker, &P::set_worker, 1, kMaxWorkerId);
  io.Bytes("voxels_endpoint", m.voxels_endpoint, &P::voxels_endpoint, &P::mutable_voxels_endpoint, 1, kMaxEndpointBytes);
  io.Range("heartbeat_ms", m.heartbeat_ms, &P::heartbeat_ms, &P::set_heartbeat_ms, 10, 60000);
  io.Range("timeout_ms", m.timeout_ms, &P::timeout_ms, &P::set_timeout_ms, 100, 600000);
}

v1::Heartbeat ProtoOf(const Heartbeat&);
void Fields(auto& io, Is<Heartbeat> auto& m) {
  using P = v1::Heartbeat;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.incarnation, &P::incarnation, &P::set_incarnation);
  io.Any(m.worker, &P::worker, &P::set_worker);
  io.Any(m.cached_bytes, &P::cached_bytes, &P::set_cached_bytes);
  io.Any(m.fetched_bytes, &P::fetched_bytes, &P::set_fetched_bytes);
  io.Any(m.rendered_ranks, &P::rendered_ranks, &P::set_rendered_ranks);
  io.Any(m.leaving, &P::leaving, &P::set_leaving);
  io.Messages("web", m.web, &P::web, &P::mutable_web, kMaxWebServers);
}

v1::Ping ProtoOf(const Ping&);
void Fields(auto& io, Is<Ping> auto& m) {
  using P = v1::Ping;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.finished_before, &P::finished_before, &P::set_finished_before);
  io.Numbers("cancelled", m.cancelled, &P::cancelled, &P::mutable_cancelled, kMaxCancelled);
  PlaceFields<P>(io, m.place);
  io.Numbers("gone", m.gone, &P::gone, &P::mutable_gone, kMaxPeers);
}

void Fields(auto& io, Is<PicturesAddress> auto& m) {
  using P = v1::PicturesAddress;
  io.Bytes("endpoint", m.endpoint, &P::endpoint, &P::mutable_endpoint, 1, kMaxEndpointBytes);
  io.Bytes("key", m.key, &P::key, &P::mutable_key, kKeyTextBytes, kKeyTextBytes);
}

void Fields(auto& io, Is<Peer> auto& m) {
  using P = v1::Peer;
  io.Range("worker", m.worker, &P::worker, &P::set_worker, 1, kMaxWorkerId);
  io.Bytes("images_endpoint", m.images_endpoint, &P::images_endpoint, &P::mutable_images_endpoint, 1, kMaxEndpointBytes);
  io.Any(m.memory_scope, &P::memory_scope, &P::set_memory_scope);
  io.Bytes("images_key", m.images_key, &P::images_key, &P::mutable_images_key, 0, kKeyTextBytes);
}

// `m` names every worker of the group and the display worker, nobody twice.
inline void CheckPeers(const GroupAssignment& m, Checker& check) {
  std::vector<WorkerId> known;
  known.reserve(m.peers.size());
  for (const Peer& peer : m.peers) known.push_back(peer.worker);
  std::sort(known.begin(), known.end());
  check.That(std::adjacent_find(known.begin(), known.end()) == known.end(), "peers", "a worker appears twice");
  const auto require = [&](WorkerId worker) {
    if (!std::binary_search(known.begin(), known.end(), worker)) check.Fail("peers", "worker " + std::to_string(worker) + " is missing");
  };
  require(m.display);
  for (const Placement& placement : m.group.placements) require(placement.worker);
}

inline void CheckHidden(const GroupAssignment& m, Checker& check) {
  const auto scope = check.In("hidden");
  check.That(m.hidden.empty() || m.key.group > 0, "", "a mask for the first group, in front of which there is nothing");
  check.Adopt(CheckFits(m.hidden, m.setup));
}

// The plan fits the setup: boxes inside the volume, as many ranks as placements, a schedule that exists.
inline void CheckGroup(const GroupPlan& group, const FrameSetup& setup, Checker& check) {
  const auto scope = check.In("group");
  const Box volume = setup.description.geometry.bounds();
  for (std::size_t i = 0; i < group.placements.size(); ++i) {
    const auto placement = check.In("placements", i);
    check.That(volume.Contains(group.placements[i].box), "box", "not inside the volume");
    check.That(group.placements[i].level <= setup.coarser.size(), "level", "not one of the setup");
    check.That(group.placements[i].filled.empty() || (setup.stored && group.placements[i].level == 0), "filled",
               "of a coarser level, or of voxels that the coordinator holds");
  }
  if (group.schedule.ranks != group.placements.size()) {
    check.Fail("schedule.ranks",
               std::to_string(group.schedule.ranks) + ", but there are " + std::to_string(group.placements.size()) + " placements");
  }
  check.That(MayCode(setup.format, group.color), "color", "that of another format");
  if (check.ok()) check.Adopt(CheckScheduleName(group.schedule));
}

// The shares of a frame of several groups would have to be accumulated.
inline void CheckShares(const GroupAssignment& m, Checker& check) {
  if (m.group.schedule.roots.size() == 1 || !check.ok()) return;
  const auto scope = check.In("group.schedule.roots");
  check.That(m.group_count == 1 && !m.previews, "", "several, in a frame of several groups or with previews");
  std::vector<WorkerId> displays = DisplaysOf(m.group, m.display);
  std::ranges::sort(displays);
  check.That(std::ranges::adjacent_find(displays) == displays.end(), "", "several ranks of a worker");
}

v1::GroupAssignment ProtoOf(const GroupAssignment&);
void Fields(auto& io, Is<GroupAssignment> auto& m) {
  using P = v1::GroupAssignment;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Message("key", m.key, &P::key, &P::mutable_key);
  io.Any(m.finished_before, &P::finished_before, &P::set_finished_before);
  io.Range("group_count", m.group_count, &P::group_count, &P::set_group_count, m.key.group + 1, kMaxGroups);
  io.Range("first_group", m.first_group, &P::first_group, &P::set_first_group, 0, m.key.group);
  io.Any(m.previews, &P::previews, &P::set_previews);
  io.Any(m.straight8, &P::straight8, &P::set_straight8);
  io.Range("groups_done", m.groups_done, &P::groups_done, &P::set_groups_done, 0, m.key.group);
  io.Any(m.client, &P::client, &P::set_client);
  io.Range("display", m.display, &P::display, &P::set_display, 1, kMaxWorkerId);
  io.Message("setup", m.setup, &P::setup, &P::mutable_setup);
  io.Message("group", m.group, &P::group, &P::mutable_group);
  io.Messages("peers", m.peers, &P::peers, &P::mutable_peers, kMaxPeers);
  io.Message("hidden", m.hidden, &P::hidden, &P::mutable_hidden);
  io.Optional("pictures", m.pictures, &P::has_pictures, &P::pictures, &P::mutable_pictures);
  io.Check([&](Checker& check) {
    if (!check.ok()) return;
    CheckPeers(m, check);
    CheckHidden(m, check);
    CheckGroup(m.group, m.setup, check);
    CheckShares(m, check);
  });
}

v1::GroupDone ProtoOf(const GroupDone&);
void Fields(auto& io, Is<GroupDone> auto& m) {
  using P = v1::GroupDone;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.worker, &P::worker, &P::set_worker);
  io.Message("key", m.key, &P::key, &P::mutable_key);
  io.Messages("reports", m.reports, &P::reports, &P::mutable_reports, kMaxReports);
  io.Message("hidden", m.hidden, &P::hidden, &P::mutable_hidden);
}

v1::FrameImage ProtoOf(const FrameImage&);
void Fields(auto& io, Is<FrameImage> auto& m) {
  using P = v1::FrameImage;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.worker, &P::worker, &P::set_worker);
  io.Any(m.frame, &P::frame, &P::set_frame);
  io.Any(m.attempt, &P::attempt, &P::set_attempt);
  io.Range("group_count", m.group_count, &P::group_count, &P::set_group_count, 1, kMaxGroups);
  io.Range("groups_done", m.groups_done, &P::groups_done, &P::set_groups_done, 0, m.group_count);
  io.Message("picture", m.picture, &P::picture, &P::mutable_picture);
  io.Messages("reports", m.reports, &P::reports, &P::mutable_reports, kMaxReports);
  io.Range("share_count", m.share_count, &P::share_count, &P::set_share_count, 1, kMaxShares);
  io.Range("share", m.share, &P::share, &P::set_share, 0, m.share_count - 1);
}

v1::WorkerTrouble ProtoOf(const WorkerTrouble&);
void Fields(auto& io, Is<WorkerTrouble> auto& m) {
  using P = v1::WorkerTrouble;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.worker, &P::worker, &P::set_worker);
  io.Message("key", m.key, &P::key, &P::mutable_key);
  io.Any(m.unreachable, &P::unreachable, &P::set_unreachable);
  io.Message("status", m.status, &P::status, &P::mutable_status);
  io.Any(m.elsewhere, &P::elsewhere, &P::set_elsewhere);
}

v1::Leave ProtoOf(const Leave&);
void Fields(auto& io, Is<Leave> auto& m) {
  using P = v1::Leave;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.worker, &P::worker, &P::set_worker);
}

v1::Retire ProtoOf(const Retire&);
void Fields(auto& io, Is<Retire> auto& m) { io.Any(m.epoch, &v1::Retire::epoch, &v1::Retire::set_epoch); }

v1::Stop ProtoOf(const Stop&);
void Fields(auto& io, Is<Stop> auto& m) { io.Any(m.epoch, &v1::Stop::epoch, &v1::Stop::set_epoch); }

}  // namespace slabstream
