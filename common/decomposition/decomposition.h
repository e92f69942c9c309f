// The ways to divide a volume into boxes. Each is a function and one line in Decompositions().
//
// All of them take any number of boxes, and make fewer if there is no room for as many. Which boxes are empty depends on the volume; users
// of the partition find out.
#pragma once

#include <string_view>
#include <vector>

#include "common/decomposition/partition.h"
#include "common/decomposition/work_field.h"

namespace slabstream {

struct DecompositionRequest {
  const WorkField* work = nullptr;  // what boxes should have equal shares of; its size is the volume's
  int boxes = 1;                    // wanted number
  int most_boxes = 1 << 20;         // >= boxes: never exceeded
  int together = 1;                 // boxes of a group. If `boxes` is a multiple, each group is a subtree: consecutive in any view
  Axis axis = Axis::kZ;             // the axis that is cut (slabs), cut first (beams), or preferred among equals
  std::int32_t halo = 0;            // voxels: a box without work within this distance is empty
  // A partition of the same volume into as many boxes by the same decomposition, to be resized. Planes move to where they halve the work
  // now, but keep their axes and the numbers of boxes on either side, so that the known work of the old boxes applies to the new ones.
  const Partition* resized = nullptr;
  int shape = 0;  // [0, DecompositionEntry::shapes)
};

struct DecompositionEntry {
  std::string_view name;     // what --decomposition takes
  std::string_view purpose;  // one line for --help
  Partition (*make)(const DecompositionRequest&);
  std::string_view balance_by;  // what its boxes have equal shares of by default: a name of BalanceByChoices()
  bool one_axis;                // cuts one axis only, which must have enough slices
  int shapes = 1;               // ways to cut the same work; which one renders fastest depends on the volume
};

// The only list.
const std::vector<DecompositionEntry>& Decompositions();

// Slabs along `axis`, numbered along it. If work is uniform, their sizes differ by at most one slice.
Partition MakeSlabs(const DecompositionRequest& request);
// Boxes that run through the volume along the shorter of the two axes that are not `axis`.
Partition MakeBeams(const DecompositionRequest& request);
// Boxes as near to cubes as their number allows.
Partition MakeSubcubes(const DecompositionRequest& request);
// Halves all boxes along all three axes, m times: 8^m boxes, the least m that makes `boxes` and no more than `most_boxes`. Ignores work.
Partition MakeOctree(const DecompositionRequest& request);
// A kd-tree whose boxes fit tightly round what is occupied. Empty space at least kLeastCut voxels thick is cut away from a box before the
// box is divided at equal work: across `axis` down to boxes of a few halos (`shape` says how many), else across its longest side. The empty
// parts are boxes of the partition, too, numbered after the `boxes` others.
inline constexpr int kKdTreeShapes = 3;
Partition MakeKdTree(const DecompositionRequest& request);

}  // namespace slabstream
