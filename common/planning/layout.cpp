#include "common/planning/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "common/base/check.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/policy_names.h"
#include "common/view/sheet_grid.h"

namespace slabstream {
namespace {

constexpr std::int64_t kMostBoxes = std::int64_t{1} << 20;

template <class Entry>
Status CheckName(std::string_view field, std::string_view name, const std::vector<Entry>& entries) {
  std::string known;
  for (const Entry& entry : entries) {
    if (entry.name == name) return Status::Ok();
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  return Status::InvalidArgument(fmt::format("{} is '{}', but must be one of: {}", field, name, known));
}

// The fewest groups whose slabs stay under the target, whatever the view. Slabs thinner than the halo would hold more of it than voxels of
// their own.
std::int64_t ChooseGroups(const LayoutRequest& request, Axis axis) {
  const VolumeDescription& description = request.summary->description;
  const std::int64_t slices = description.geometry.size[axis], slots = request.slots;
  const std::int64_t slice_bytes = description.voxel_bytes() / slices;
  const std::int64_t most = std::clamp<std::int64_t>(slices / (slots * kHalo), 1, kMaxGroups);
  for (std::int64_t groups = 1; groups < most; ++groups) {
    const std::int64_t own_slices = (slices + slots * groups - 1) / (slots * groups);
    if (std::min(own_slices + 2 * kHalo, slices) * slice_bytes <= request.slab_bytes_target) return groups;
  }
  return most;
}

// The fields of work that a layout is made from, each made when it is first asked for.
class WorkFields {
 public:
  explicit WorkFields(const LayoutRequest& request)
      : request_(request),
        visibility_(*request.summary, *request.transfer),
        voxels_(WorkField::Uniform(request.summary->description.geometry.size)) {}

  const WorkField& Of(WorkSplit split) {
    if (split == WorkSplit::kVoxels) return voxels_;
    if (split == WorkSplit::kCost && request_.known.cost != nullptr) return *request_.known.cost;
    if (!occupied_) occupied_.emplace(request_.known.occupied != nullptr ? *request_.known.occupied : visibility_.VisibleCells());
    return *occupied_;
  }

  // Whether any sample that `box` owns may show something.
  bool Shows(const Box& box) {
    const Box with_halo = Grown(box, kHalo, request_.summary->description.geometry.bounds());
    if (request_.known.occupied == nullptr) return visibility_.AnyVisible(with_halo);
    return !Of(WorkSplit::kOccupied).Hull(with_halo).empty();
  }

 private:
  const LayoutRequest& request_;
  const BrickVisibility visibility_;
  const WorkField voxels_;
  std::optional<WorkField> occupied_;
};

}  // namespace

Status CheckNames(const Policy& policy) {
  if (Status s = CheckName("policy.decomposition", policy.decomposition, Decompositions()); !s.ok()) return s;
  if (Status s = CheckName("policy.split", policy.split, WorkSplits()); !s.ok()) return s;
  if (Status s = CheckName("policy.assignment", policy.assignment, Assignments()); !s.ok()) return s;
  if (Status s = CheckName("policy.balance", policy.balance, BalanceModes()); !s.ok()) return s;
  if (const auto scheme = ParseCombining(policy.combine); !scheme.ok()) {
    return Status::InvalidArgument("policy.combine " + scheme.status().message());
  }
  return Status::Ok();
}

std::string_view SplitOf(const Policy& policy) {
  return policy.split == kAutomaticSplit ? FindDecomposition(policy.decomposition)->split : std::string_view(policy.split);
}

bool NeedsOccupancy(const Policy& policy) {
  return FindWorkSplit(SplitOf(policy)) != WorkSplit::kVoxels || policy.assignment == "greedy" || policy.balance == kDynamicBalance;
}

Axis SlabAxis(const Policy& policy, const Index3& size) {
  if (policy.axis != AxisChoice::kAuto) return Axis(policy.axis);
  // z, about which views turn: slabs one above the other hide little of each other from most sides, so none of them is rendered in vain.
  Axis longest = Axis::kZ;
  if (!FindDecomposition(policy.decomposition)->one_axis) return longest;
  for (Axis axis : {Axis::kY, Axis::kX}) {
    if (size[axis] > 2 * size.z && size[axis] > size[longest]) longest = axis;
  }
  return longest;
}

Layout MakeLayout(const LayoutRequest& request) {
  const Policy& policy = *request.policy;
  const VolumeGeometry& geometry = request.summary->description.geometry;
  const Axis axis = SlabAxis(policy, geometry.size);
  const std::int64_t groups = policy.groups > 0 ? policy.groups : ChooseGroups(request, axis);
  const std::int64_t slots = request.slots, voxels = geometry.bounds().voxel_count();

  WorkFields fields(request);
  const WorkSplit split = FindWorkSplit(SplitOf(policy)).value();
  Layout layout;
  layout.partition = FindDecomposition(policy.decomposition)
                         ->make({.work = &fields.Of(split),
                                 .boxes = int(std::min({groups * slots, voxels, kMostBoxes})),
                                 .most_boxes = int(std::min(kMaxGroups * slots, kMostBoxes)),
                                 .together = int(std::min(slots, kMostBoxes)),
                                 .axis = axis,
                                 .halo = kHalo});

  std::vector<BoxId> filled;
  std::vector<double> costs;
  const WorkField& cost = fields.Of(NeedsOccupancy(policy) ? WorkSplit::kCost : WorkSplit::kVoxels);
  for (BoxId box = 0; box < layout.partition.boxes().size(); ++box) {
    const Box& voxels_of_box = layout.partition.boxes()[box];
    if (!fields.Shows(voxels_of_box)) continue;
    filled.push_back(box);
    costs.push_back(cost.Sum(voxels_of_box));
  }
  layout.owners.assign(layout.partition.boxes().size(), kNoSlot);
  const std::vector<std::uint32_t> owners = FindAssignment(policy.assignment)->assign({costs, request.slots});
  for (std::size_t i = 0; i < filled.size(); ++i) layout.owners[filled[i]] = owners[i];
  return layout;
}

}  // namespace slabstream
