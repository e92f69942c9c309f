// The ways to divide a volume into boxes. Each is one file and one line in Decompositions().
#pragma once

#include <string_view>
#include <vector>

#include "common/decomposition/partition.h"
#include "common/volume/summary.h"

namespace slabstream {

struct DecompositionRequest {
  const VolumeSummary* summary = nullptr;  // geometry, and bricks for splits by content
  int boxes = 1;                           // wanted number; fewer where the volume has fewer slices
  Axis axis = Axis::kZ;                    // slabs: the axis that is cut
};

struct DecompositionEntry {
  std::string_view name;     // what --decomposition takes
  std::string_view purpose;  // one line for --help
  Partition (*make)(const DecompositionRequest&);
};

// The only list.
const std::vector<DecompositionEntry>& Decompositions();
const DecompositionEntry* FindDecomposition(std::string_view name);  // null: no such name

// Equal slabs along an axis: sizes differ by at most one slice.
Partition MakeSlabs(const DecompositionRequest& request);

}  // namespace slabstream
