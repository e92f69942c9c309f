// Layout: where the boxes of a volume are, and which slot owns each. It depends on the volume, the transfer function and the policy, not on
// the view; as long as a layout stays, no voxel moves.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/decomposition/partition.h"
#include "common/decomposition/work_field.h"
#include "common/planning/frame_request.h"
#include "common/volume/summary.h"

namespace slabstream {

inline constexpr std::uint32_t kNoSlot = std::numeric_limits<std::uint32_t>::max();  // of a box that shows nothing: nobody renders it

struct Layout {
  Partition partition;
  std::vector<std::uint32_t> owners;  // by box: its slot, or kNoSlot
  friend bool operator==(const Layout&, const Layout&) = default;
};

// What is known about the work in a volume under one transfer function. Null: not known.
struct WorkKnowledge {
  const OccupancyGrid* occupied = nullptr;  // else the bricks of the volume's summary tell what may be occupied
  const WorkField* cost = nullptr;          // seconds, learnt from frames; else what is occupied stands for it
};

// Whether the layout of a policy is better for an exact OccupancyGrid. The policy's names must be known ones.
bool NeedsOccupancy(const Policy& policy);

struct LayoutRequest {
  const VolumeSummary* summary = nullptr;
  const TransferFunction* transfer = nullptr;
  const Policy* policy = nullptr;                            // with names that there are (CheckNames)
  std::uint32_t slots = 1;                                   // >= 1
  std::int64_t slab_bytes_target = std::int64_t{256} << 20;  // voxels of one slab at most, where slices allow it
  WorkKnowledge known;
};

// Pure. Boxes with the halo of which nothing is visible belong to nobody; the others are numbered on for their assignment.
Layout MakeLayout(const LayoutRequest& request);

// The axis that is cut, or cut first: "auto" is z, but for slabs where another axis has more than twice as many slices.
Axis SlabAxis(const Policy& policy, const Index3& size);

// What `split` of the policy comes to: "auto" is the choice of the decomposition.
std::string_view SplitOf(const Policy& policy);

// InvalidArgument naming what there is, if a name of the policy is in no list.
Status CheckNames(const Policy& policy);

}  // namespace slabstream
