// Who renders and combines what: the part of a plan that depends on the roster.
#pragma once

#include <set>

#include "common/planning/frame_plan.h"

namespace slabstream {

// Workers 1 ... `workers`, one for each slot: for plans that no service runs.
Roster RosterOf(std::uint32_t workers);

// Groups of `plan.slots` boxes of its layout that show something, in visibility order, or groups by owner (Layout::touching); at least one
// group.
void PlaceBoxes(FramePlan& plan);

// Boxes for one worker that renders nothing else of their groups. It is not the display worker either, unless it is the only worker.
struct SetApart {
  std::set<BoxId> boxes;
  WorkerId worker = 0;  // in the roster, if there are boxes
};

// Fills in the workers of all placements, the display worker and the schedules. The display worker stays if it is in the roster. Else the
// turn picks one of the workers that hold a rank in the most groups (in an empty frame: of all), in the order of slots. Unavailable: no
// worker in the roster; the plan is then unchanged.
Status AssignWorkers(const Roster& roster, FramePlan& plan, const SetApart& apart = {});

// Plans the same frame for another roster with the same number of slots. Setup, layout and groups stay; workers of placements, schedules
// and display change. The display worker stays if it is still in the roster: it holds the accumulated image. Unavailable: no worker.
Result<FramePlan> Replan(const FramePlan& plan, const Roster& roster, const SetApart& apart = {});

// The plan of another frame of the same request, for a roster of the same size with a worker in it. Only who does what changes.
FramePlan TakeTurn(const FramePlan& plan, const Roster& roster, const Turn& turn);

// The worker of each box: its slot's, or the one that it is lent to; 0 if the box belongs to nobody, or if the roster has no worker.
// `reversed`: the last slot renders the boxes of the first one, and so on (AssignmentEntry::alternates).
std::vector<WorkerId> OwnersOf(const Layout& layout, const Roster& roster, bool reversed = false);

// The rank where the group's image should end: the display worker's, so that it need not travel; 0 if it has none.
Rank RootOf(const GroupPlan& group, WorkerId display);

// ClientTakes::share_pixels of a service: smaller shares cost more in messages than they save (docs/time-dilated-cluster.md).
inline constexpr std::uint64_t kSharePixels = 65536;

// A picture of so many pixels is divided whatever the scheme, since combining it on one path takes longer than rendering it.
inline constexpr std::uint64_t kLargePicture = std::uint64_t{1} << 20;

// Whether a client that puts pictures together should get one of so many pixels in shares. They shorten a frame that is waited for;
// `alone`: no other one is under way. Where small frames follow one another, their messages cost more than they save.
constexpr bool SharesPay(std::uint64_t pixels, bool alone) { return alone || pixels >= kLargePicture; }

// Where the shares of a frame of one group should end: at most one rank of each worker, and if there are fewer shares than workers, other
// ones from turn to turn. One root: it is not divided, since that would not pay: it pays if the workers divide the picture anyway
// (CombiningEntry::divides), if there is work to be done after combining (RendererKind::Finish), or if the picture is large.
std::vector<Rank> SharesOf(const FramePlan& plan);

}  // namespace slabstream
