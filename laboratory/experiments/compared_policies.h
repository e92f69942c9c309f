// Assignments and balances that the service does not have, to compare its own with. Each is one line in a list. A policy of the laboratory
// (FrameCase::policy) may name them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/planning/assignment.h"
#include "common/planning/balances.h"
#include "common/planning/resolved_request.h"

namespace slabstream {

struct ComparedBalance : BalanceEntry {
  bool hands_over = false;  // it changes who owns a box and never the boxes, so it needs several boxes a worker
};

const std::vector<AssignmentEntry>& ComparedAssignments();
const std::vector<ComparedBalance>& ComparedBalances();

// Whether the service does not have what the policy names.
bool IsCompared(const Policy& policy);

// As the other ResolveRequest. The policy may name what is above, too, or as its assignment an arrangement of so many owners
// (OwnerArrangements).
Result<ResolvedRequest> ResolveCompared(FrameRequest request, DatasetId dataset, std::shared_ptr<const VolumeSummary> summary,
                                        std::uint32_t owners);

// Planes of the partition move to where both sides took as long, each time, whatever that costs to move: after Marchesin, Mongenet and
// Dischler, "Dynamic load balancing for parallel volume rendering", EGPGV 2006.
std::optional<Layout> MovePlanes(const BalanceRequest& request);

// Busy workers hand boxes over to those that have least to do, each time, so that a worker's boxes need not touch: a simple form of what
// Walldén, Markidis, Okita and Ino do in two layers of groups, "Memory efficient load balancing for distributed large-scale volume
// rendering using a two-layered group structure", IEICE Transactions E102-D, 2019.
std::optional<Layout> HandOver(const BalanceRequest& request);

}  // namespace slabstream
