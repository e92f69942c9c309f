// Assignments: which slot owns which box. Each is one line in Assignments(). Decompositions() decide where the boxes are.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace slabstream {

struct AssignmentRequest {
  std::span<const double> costs;  // predicted, by box; >= 0, in any unit
  std::uint32_t slots = 1;        // >= 1
  // By box: who holds its voxels (OwnedBox::owner), numbers below `holder_count`; empty: unknown.
  std::span<const std::uint32_t> holders = {};
  std::uint32_t holder_count = 0;
  // By holder, and by slot: the host whose memory its processes can read (VolumeSummary::owner_hosts); 0: not known. Empty: of none.
  std::span<const std::uint64_t> holder_hosts = {}, slot_hosts = {};
};

struct AssignmentEntry {
  std::string_view name;                                           // what --assignment takes
  std::string_view purpose;                                        // one line for --help
  std::vector<std::uint32_t> (*assign)(const AssignmentRequest&);  // by box: its slot, in [0, slots)
  bool by_cost = false;                                            // it uses costs: the better they are known, the better it is
  // In every other frame the last slot renders the first one's boxes, and so on: each worker holds the voxels of two slots.
  bool alternates = false;
  // Boxes are those of owners (VolumeSummary::owned), and groups take runs of them (owner_groups.h). Needs `holders`.
  bool by_owner = false;
};

// The only list.
const std::vector<AssignmentEntry>& Assignments();

}  // namespace slabstream
