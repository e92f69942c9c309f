// The control plane: coordinator (ROUTER) and workers (DEALER).
//
//   worker                               coordinator
//   Register  ------------------------>            every second until Welcome (or Refused)
//             <------------------------  Welcome
//   Heartbeat ------------------------>            every heartbeat interval; Ping answers (also sent unasked)
//             <------------------------  Ping
//             <------------------------  GroupAssignment       one message has all that a group needs: order of arrival does not matter
//   GroupDone ------------------------>            display worker only; opens the window for the next group
//   FrameImage + payload ------------->            display worker only; a preview or the finished frame. Without payload if that went
//                                                  straight to the client
//   WorkerTrouble -------------------->            something failed for this group
//   Leave     ------------------------>            a worker ends now, whatever it had to do
//             <------------------------  Retire    you are not (or no longer) known: register again
//             <------------------------  Stop      end the process
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/base/web_traffic.h"
#include "common/image/occlusion_mask.h"
#include "common/image/run_header.h"
#include "common/planning/frame_plan.h"
#include "common/stats/report.h"
#include "common/wire/encoded_runs.h"
#include "common/wire/ids.h"
#include "common/wire/picture_messages.h"

namespace slabstream {

inline constexpr std::size_t kMaxEndpointBytes = 512;
inline constexpr std::int32_t kMaxOcclusionTiles = OcclusionTiles(kMaxGridSide);

// The slot that a worker owns, among how many.
struct SlotPlace {
  std::uint32_t slot = 0;
  std::uint32_t slots = 0;  // 0: it owns none
  friend bool operator==(const SlotPlace&, const SlotPlace&) = default;
};

struct Register {
  Incarnation incarnation = 0;
  std::uint32_t pid = 0;
  std::string host;                // at most kMaxNameBytes
  std::string images_endpoint;     // where other workers reach this one's image plane
  std::uint32_t threads = 1;       // render threads, [1, kMaxThreads]
  std::uint64_t memory_bytes = 0;  // limit of its memory: it gets no frame that needs more; 0: none stated
  std::uint64_t memory_scope = 0;  // workers of the same scope can read each other's memory (SharedMemoryScope); 0: it takes frames only
  bool lends_memory = false;       // it lends its own images to workers of its scope; else it sends them in frames
  std::string images_key = {};     // public key of its image plane; empty: that plane is not encrypted
  SlotPlace place = {};            // the slot that it had last: it holds the voxels of that slot's boxes
  friend bool operator==(const Register&, const Register&) = default;
};

struct Welcome {
  Epoch epoch = 0;
  Incarnation incarnation = 0;  // echoed
  WorkerId worker = 0;
  std::string voxels_endpoint;
  std::uint32_t heartbeat_ms = 500;  // [10, 60000]
  std::uint32_t timeout_ms = 6000;   // silence after which the other side is taken for dead, [100, 600000]
  friend bool operator==(const Welcome&, const Welcome&) = default;
};

struct Heartbeat {
  Epoch epoch = 0;
  Incarnation incarnation = 0;
  WorkerId worker = 0;
  std::uint64_t cached_bytes = 0;    // voxels and what was made from them
  std::uint64_t fetched_bytes = 0;   // voxels received since the process began
  std::uint32_t rendered_ranks = 0;  // since the process began: progress, even while a long group runs
  bool leaving = false;              // it wants no new work, and Stop once nothing needs it any more; from then on in every heartbeat
  std::vector<WebTraffic> web = {};  // what the process has read since it began; at most kMaxWebServers
  friend bool operator==(const Heartbeat&, const Heartbeat&) = default;
};

struct Ping {
  Epoch epoch = 0;
  FrameId finished_before = 0;      // all frames with a smaller id are over: forget them
  std::vector<FrameId> cancelled;   // also over, though their id is not smaller; at most kMaxCancelled
  SlotPlace place = {};             // the receiver's slot
  std::vector<WorkerId> gone = {};  // workers that left or were lost lately; at most kMaxPeers
  friend bool operator==(const Ping&, const Ping&) = default;
};
inline constexpr std::size_t kMaxCancelled = 1024;

struct Peer {
  WorkerId worker = 0;
  std::string images_endpoint;
  std::uint64_t memory_scope = 0;  // Register::memory_scope
  std::string images_key = {};     // Register::images_key
  friend bool operator==(const Peer&, const Peer&) = default;
};

struct GroupAssignment {
  Epoch epoch = 0;
  GroupKey key;
  FrameId finished_before = 0;
  std::uint32_t group_count = 1;  // [1, kMaxGroups]
  std::uint32_t first_group = 0;  // the first group of this attempt: earlier groups are already accumulated by `display`
  bool previews = false;
  bool straight8 = false;  // FrameRequest::straight8
  WorkerId display = 0;
  FrameSetup setup;
  GroupPlan group;          // with several roots: the only one of its frame
  std::vector<Peer> peers;  // every worker of the group, and the display worker
  OcclusionMask hidden;     // some of what earlier groups hide (common/planning/frame_occlusion.h); fits the setup
  // Groups of the frame, at most key.group, that are accumulated, so images lent for them have been read.
  std::uint32_t groups_done = 0;
  ClientId client = 0;                           // whom the frame is for: a worker shares its time among clients
  std::optional<PicturesAddress> pictures = {};  // where that client takes pictures; none: through the coordinator
  friend bool operator==(const GroupAssignment&, const GroupAssignment&) = default;
};

struct GroupDone {
  Epoch epoch = 0;
  WorkerId worker = 0;
  GroupKey key;
  std::vector<RankReport> reports;  // the reports of every rank of this group
  OcclusionMask hidden;             // some of what the groups 0 ... key.group hide; at most kMaxOcclusionTiles along an axis
  friend bool operator==(const GroupDone&, const GroupDone&) = default;
};

// Final pixels (supersampling resolved), premultiplied; payload: the runs, unless they went straight to the client.
struct FrameImage {
  Epoch epoch = 0;
  WorkerId worker = 0;
  FrameId frame = 0;
  std::uint32_t attempt = 0;
  std::uint32_t groups_done = 0, group_count = 1;  // equal: the finished frame
  PictureShare picture;
  std::vector<RankReport> reports;           // resolve and encode times of the display worker; at most kMaxReports
  std::uint32_t share = 0, share_count = 1;  // [1, kMaxShares]
  friend bool operator==(const FrameImage&, const FrameImage&) = default;
};

struct WorkerTrouble {
  Epoch epoch = 0;
  WorkerId worker = 0;
  GroupKey key;
  WorkerId unreachable = 0;  // a peer that does not answer, or 0
  Status status;             // not ok; its message says what failed
  bool elsewhere = false;    // another worker may be able to do it, so the frame goes on without this one; else the same may work later
  friend bool operator==(const WorkerTrouble&, const WorkerTrouble&) = default;
};

struct Leave {
  Epoch epoch = 0;
  WorkerId worker = 0;
  friend bool operator==(const Leave&, const Leave&) = default;
};

struct Retire {
  Epoch epoch = 0;
  friend bool operator==(const Retire&, const Retire&) = default;
};

struct Stop {
  Epoch epoch = 0;
  friend bool operator==(const Stop&, const Stop&) = default;
};

using WorkerToCoordinator = std::variant<Register, Heartbeat, GroupDone, FrameImage, WorkerTrouble, Leave>;
using CoordinatorToWorker = std::variant<Welcome, Ping, GroupAssignment, Retire, Stop>;

}  // namespace slabstream
