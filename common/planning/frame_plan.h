// FramePlan: everything that a frame will do, as a value. Built by pure functions; the service, the embedded executor and the simulator run
// it.
//
//   resolved request + roster + costs  --PlanFrame-->  FramePlan  --executor-->  image + reports
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/status.h"
#include "common/combining/named_schedule.h"
#include "common/combining/schedule.h"
#include "common/frame/frame_setup.h"
#include "common/image/color_coding.h"
#include "common/planning/layout.h"
#include "common/planning/resolved_request.h"
#include "common/planning/tile_plan.h"
#include "common/planning/worker_id.h"
#include "common/volume/filled_box.h"
#include "common/volume/summary.h"

namespace slabstream {

// One rank of a group: which box, and who renders it. After the loss of a worker, another one may hold several ranks of a group.
struct Placement {
  BoxId id = 0;
  Box box;  // in voxels of the setup's volume
  WorkerId worker = 0;
  std::uint8_t level = 0;              // the level that it is drawn from: LevelBox
  std::vector<FilledBox> filled = {};  // parts of the padded box that need not be read; only at level 0

  LevelBox at() const { return {box, level}; }
  friend bool operator==(const Placement&, const Placement&) = default;
};

struct GroupPlan {
  std::vector<Placement> placements;          // by rank, nearest first; boxes that show nothing are left out, so it may be empty
  ScheduleName schedule;                      // over these ranks
  ColorCoding color = ColorCoding::kFloat32;  // coding of images that workers send as runs
  friend bool operator==(const GroupPlan&, const GroupPlan&) = default;
};

// The workers where the group's image ends, by share. If the schedule has one root, `display` alone; it may hold no rank.
std::vector<WorkerId> DisplaysOf(const GroupPlan& group, WorkerId display);
// The share that `worker` gets; none: it gets none.
std::optional<std::size_t> ShareOf(const GroupPlan& group, WorkerId display, WorkerId worker);

// Frames take turns. If the workers are divided into teams (common/planning/team.h), a plan uses the workers of one team. The display
// worker changes from frame to frame of a team, so that no worker makes all pictures.
struct Turn {
  std::uint64_t number = 0;  // number of the frame among those of its team
  std::uint32_t teams = 1;
  friend bool operator==(const Turn&, const Turn&) = default;
};

// What the client takes.
struct ClientTakes {
  // Not 0: it puts the picture together, so workers may finish shares of it, each of at least so many pixels of the frame. They do if there
  // is one group (SharesOf).
  std::uint64_t share_pixels = 0;
  bool straight8 = false;  // FrameRequest::straight8, of the picture alone
  friend bool operator==(const ClientTakes&, const ClientTakes&) = default;
};

struct FramePlan {
  FrameSetup setup;
  std::shared_ptr<const Layout> layout;  // never null; equal plans share it
  std::uint32_t slots = 1;               // p: owner slots the layout was made for
  Axis slab_axis = Axis::kZ;
  double pixel_error = 0;         // the policy's pixel_error
  std::string combine;            // the combining scheme, never empty
  bool alternates = false;        // the policy's assignment does (AssignmentEntry)
  std::vector<GroupPlan> groups;  // nearest first; at least one
  std::vector<TileOrder> tiles;   // of shapes; of a frame's first attempt alone
  Turn turn;
  ClientTakes client;
  WorkerId display = 0;  // accumulates the groups and hands the frame over; holds a rank wherever possible. In shares: the first one's
  friend bool operator==(const FramePlan&, const FramePlan&) = default;
};

// The placements of all groups, nearest first.
std::vector<Placement> PlacementsOf(const FramePlan& plan);

// The worker of each slot of a layout. A slot may be vacant (0) after a loss. Its boxes are then lent to the other workers, round robin;
// these keep their own boxes, so that only the lost voxels travel again. No worker holds two slots.
struct Roster {
  std::vector<WorkerId> slots;
  std::vector<WorkerId> leaving = {};  // hold no slot and render nothing new, but may remain a frame's display worker
  friend bool operator==(const Roster&, const Roster&) = default;
};

// The part of a plan that does not depend on the policy. InvalidArgument: a view that cannot be rendered, or a frame that is too large.
Result<FrameSetup> MakeFrameSetup(const ResolvedRequest& request);

// Pure. Unavailable: no worker in the roster. ResourceExhausted: more than kMaxGroups groups. `layout` was made for the setup's volume and
// look and this policy, and for as many slots as the roster has.
Result<FramePlan> PlanFrame(FrameSetup setup, const ResolvedPolicy& policy, const Roster& roster, std::shared_ptr<const Layout> layout,
                            const Turn& turn = {}, const ClientTakes& client = {});
// Resolves the request (ResolveRequest) and plans it with no knowledge but the volume's summary. Errors of all steps.
Result<FramePlan> PlanFrame(const FrameRequest& request, DatasetId dataset, const VolumeSummary& summary, const Roster& roster,
                            std::int64_t box_bytes_target = kBoxBytesTarget);

}  // namespace slabstream
