// ResolvedPolicy: how a frame is made. A Policy is what a client asks for: its axis may depend on the view. Names are looked up once, here;
// planning works with the entries of the lists.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/decomposition/decomposition.h"
#include "common/frame/frame_request.h"
#include "common/planning/assignment.h"
#include "common/planning/balances.h"
#include "common/planning/policy_names.h"
#include "common/volume/volume.h"

namespace slabstream {

struct ResolvedPolicy {
  const DecompositionEntry* decomposition = nullptr;  // one of Decompositions(), never null
  BalanceBy balance_by = BalanceBy::kVoxels;
  Axis axis = Axis::kZ;                         // the axis that is cut, or cut first
  int groups = 0;                               // [1, kMaxGroups]; 0: the fewest that memory allows (LayoutMaker::FewestGroups)
  const AssignmentEntry* assignment = nullptr;  // one of Assignments(), never null
  const BalanceEntry* balance = nullptr;        // one of Balances(), never null
  std::string combine;                          // ParseCombining takes it; empty: StandardCombining of the frame
  double pixel_error = 0;                       // Policy::pixel_error
  int teams = 1;                                // Policy::teams
  friend bool operator==(const ResolvedPolicy&, const ResolvedPolicy&) = default;
};

// The policy is valid and settled (SettledPolicy), and has known names (CheckNames).
ResolvedPolicy ResolvePolicy(const Policy& policy, const VolumeGeometry& geometry);

// InvalidArgument that says which names there are, if a name of the policy is in no list.
Status CheckNames(const Policy& policy);

// The request's policy with an axis that no longer depends on the view (AxisChoice::kView). The request must be valid.
Policy SettledPolicy(const FrameRequest& request, const VolumeGeometry& geometry);

// The axis that is cut, or cut first. "auto" is z; for slabs it is another axis if that has more than twice as many slices. `choice` is not
// kView.
Axis SlabAxis(AxisChoice choice, const DecompositionEntry& decomposition, const Index3& size);

// The policy's load metric. "auto" becomes what suits the decomposition; where costs of boxes count, too, voxels are counted. The policy's
// names must be known.
std::string_view BalanceByOf(const Policy& policy);

// Whether boxes may change between frames (Balances). The policy's names must be known.
bool IsDynamic(const Policy& policy);

// Whether the policy's layout needs an exact OccupancyGrid. The policy's names must be known.
bool NeedsOccupancy(const Policy& policy);

}  // namespace slabstream
