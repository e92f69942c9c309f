// Layout: where the boxes of a volume are, and which slot owns each. It depends on the volume, the transfer function and the policy, not on
// the view; as long as a layout stays, no voxel moves.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/decomposition/partition.h"
#include "common/decomposition/work_field.h"
#include "common/planning/resolved_policy.h"
#include "common/volume/summary.h"

namespace slabstream {

class RendererKind;

inline constexpr std::uint32_t kNoSlot = std::numeric_limits<std::uint32_t>::max();  // of a box that shows nothing: nobody renders it

struct Layout {
  Partition partition;
  std::vector<std::uint32_t> owners;  // by box: its slot, or kNoSlot
  friend bool operator==(const Layout&, const Layout&) = default;
};

// What is known about the work in a volume under one transfer function. Null: not known.
struct WorkKnowledge {
  const OccupancyGrid* occupied =
      nullptr;  // of what the renderer draws (RendererKind::DrawnTable); else the bricks of the volume's summary tell what may be occupied
  const WorkField* cost = nullptr;  // seconds, learnt from frames; else what is occupied stands for it
};

// Memory of the voxels of one slab at most, where slices allow it.
inline constexpr std::int64_t kSlabBytesTarget = std::int64_t{256} << 20;

struct LayoutRequest {
  const VolumeSummary* summary = nullptr;
  const TransferFunction* transfer = nullptr;
  const ResolvedPolicy* policy = nullptr;
  const RendererKind* renderer = nullptr;
  std::uint32_t slots = 1;  // >= 1
  std::int64_t slab_bytes_target = kSlabBytesTarget;
  WorkKnowledge known;
  const Partition* resized = nullptr;  // of a layout by the same policy: its boxes are resized (DecompositionRequest); null: cut anew
};

// Pure. Boxes with the halo of which nothing is visible belong to nobody; the others are numbered on for their assignment. Where boxes are
// split by what is occupied, they are cut again and again by the cost that the renderer predicts for them (AnalyticCost), as they would be
// by their measured costs (LearntCost); the best of these layouts is taken: that with the quickest frame, on average over views along x and
// along y.
Layout MakeLayout(const LayoutRequest& request);

// Layouts by several policies: what they are all made from is worked out once.
class LayoutMaker {
 public:
  // The policy of `request` does not count. What it points at must live as long as this.
  explicit LayoutMaker(const LayoutRequest& request);
  ~LayoutMaker();
  LayoutMaker(LayoutMaker&&) noexcept;

  Layout Make(const ResolvedPolicy& policy);
  // The fewest groups by which no slab (a box that shows something, with its halo) is larger than the target, in any view; as many as
  // leave boxes that are not mostly halo, where that is not enough. What the policy says, if it says a number.
  int FewestGroups(const ResolvedPolicy& policy);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
