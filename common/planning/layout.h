// Layout: where the boxes of a volume are, and which slot owns each. It depends on the volume, the transfer function and the policy, not on
// the view; as long as a layout stays, no voxel moves. A picture that is drawn from several levels has a layout of its own.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "common/decomposition/partition.h"
#include "common/decomposition/work_field.h"
#include "common/planning/classified_volume.h"
#include "common/planning/least_extinction.h"
#include "common/planning/resolved_policy.h"
#include "common/planning/resolved_request.h"
#include "common/volume/filled_box.h"
#include "common/volume/summary.h"

namespace slabstream {

inline constexpr std::uint32_t kNoSlot = std::numeric_limits<std::uint32_t>::max();  // the box shows nothing, so nobody renders it

struct Layout {
  Partition partition;
  std::vector<std::uint32_t> owners;  // by box: its slot, or kNoSlot
  // By box: the level that it is drawn from (LevelBox), of a box outside the picture the coarsest one. Shapes may give it a slot all the
  // same. Empty: all from 0.
  std::vector<std::uint8_t> levels = {};
  // By box: parts of it and of its halo that need not be read. Empty: nothing is known of any box, or there are several levels.
  std::vector<std::vector<FilledBox>> filled = {};
  LeastExtinction extinction = {};  // the volume's least extinction; empty: not known
  // Of boxes that are grouped by owner (owner_groups.h): all pairs that touch, and the most bytes of padded boxes of a worker in a group.
  std::vector<TouchingBoxes> touching = {};  // empty: groups are as many boxes as there are slots, in visibility order
  std::uint64_t group_bytes = 0;
  friend bool operator==(const Layout&, const Layout&) = default;
};

// What is known about the work in a volume under one transfer function. Null: not known.
struct WorkKnowledge {
  // Drawn voxels (RendererKind::DrawnTable) of the whole volume; null: the summary's bricks tell what may be drawn.
  const OccupancyGrid* occupied = nullptr;
  const WorkField* cost = nullptr;  // seconds, learnt from frames; null: drawn voxels stand for it
};

// Most memory for the voxels of one padded box, as far as the size of slices allows.
inline constexpr std::int64_t kBoxBytesTarget = std::int64_t{256} << 20;

struct LayoutRequest {
  const VolumeSummary* summary = nullptr;
  const ClassifiedVolume* volume = nullptr;  // it has this summary
  const ResolvedPolicy* policy = nullptr;
  std::uint32_t slots = 1;                    // >= 1
  std::span<const std::uint64_t> hosts = {};  // AssignmentRequest::slot_hosts
  std::int64_t box_bytes_target = kBoxBytesTarget;
  // ResolvedRequest::map and coarser; null: one level
  const LevelMap* map = nullptr;
  std::span<const CoarserVolume> coarser = {};
  WorkKnowledge known;
  const Partition* resized = nullptr;  // partition to resize, of a layout by the same policy (DecompositionRequest); null: cut anew
  // Partition of the same volume by the same policy under another look; null: none. Boxes by bricks stay what they were there unless new
  // ones are predicted to gain much, so that a change of the look moves few voxels.
  const Partition* earlier = nullptr;
  std::stop_token stop = {};  // once it is told to stop, the layout comes soon, and is of no use but to be dropped
};

// Pure. A box is assigned to no worker if neither it nor its halo contains a visible voxel; the others are numbered consecutively for their
// assignment. If boxes are split by what bricks show or by what is occupied, they are cut repeatedly by their analytic costs
// (AnalyticCost), as they would be by measured costs (MeasuredCost). The result is the layout with the quickest frame, on average over
// views along x and along y and with the renderer's default parameters: a layout stays for all views.
Layout MakeLayout(const LayoutRequest& request);

// Empties the cells of which clipping leaves nothing. Cells that are clipped in part keep all their voxels.
void EmptyClippedCells(const ClipRegion& clip, const VolumeGeometry& geometry, OccupancyGrid& grid);

// Makes layouts by several policies; computes what they share once.
class LayoutMaker {
 public:
  // Ignores the policy of `request`. What it points at must live as long as this.
  explicit LayoutMaker(const LayoutRequest& request);
  ~LayoutMaker();
  LayoutMaker(LayoutMaker&&) noexcept;

  Layout Make(const ResolvedPolicy& policy);
  // The policy's number of groups, if it sets one. Else the fewest groups with which no padded box that shows something is
  // larger than the target, in any view; if none are enough, as many as leave boxes that are not mostly halo.
  int FewestGroups(const ResolvedPolicy& policy);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
