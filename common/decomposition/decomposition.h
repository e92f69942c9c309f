// The ways to divide a volume into boxes. Each is one file and one line in Decompositions().
//
// All of them take any number of boxes. Where there is no room for as many, they make as many as there is room for; which boxes come out
// empty depends on the volume and is found out by who looks at them.
#pragma once

#include <string_view>
#include <vector>

#include "common/decomposition/partition.h"
#include "common/decomposition/work_field.h"

namespace slabstream {

struct DecompositionRequest {
  const WorkField* work = nullptr;  // what boxes should have equal shares of; its size is the volume's
  int boxes = 1;                    // wanted number
  int most_boxes = 1 << 20;         // >= boxes: of which there are never more
  int together = 1;       // boxes of a group: of a whole number of groups, each is a subtree, and so follows one another in any view
  Axis axis = Axis::kZ;   // which axis is cut (slabs), first (beams), or where two are as good as each other
  std::int32_t halo = 0;  // voxels: a box that has no work nearer than that is empty
  // A partition of the same volume into as many boxes by the same decomposition: it is resized. Planes move to where the work is halved
  // now, but keep their axes and how many boxes lie on either side, so that work which is known of the old boxes tells of the new ones.
  const Partition* resized = nullptr;
  int shape = 0;  // [0, DecompositionEntry::shapes)
};

struct DecompositionEntry {
  std::string_view name;     // what --decomposition takes
  std::string_view purpose;  // one line for --help
  Partition (*make)(const DecompositionRequest&);
  std::string_view split;  // what its boxes have equal shares of, unless told otherwise: a name of WorkSplits()
  bool one_axis;           // cuts one axis only, which must have slices enough
  int shapes = 1;          // into which it can cut the same work; which is quickest to render depends on the volume
};

// The only list.
const std::vector<DecompositionEntry>& Decompositions();

// Slabs along `axis`, which are numbered along it. Of equal voxels: sizes differ by at most one slice.
Partition MakeSlabs(const DecompositionRequest& request);
// Boxes that run through the volume along the shorter of the two axes that are not `axis`.
Partition MakeBeams(const DecompositionRequest& request);
// Boxes as near to cubes as their number allows.
Partition MakeSubcubes(const DecompositionRequest& request);
// All boxes halved along all three axes, m times over: 8^m boxes, the least m that makes `boxes` and no more than `most_boxes`. Blind to
// work.
Partition MakeOctree(const DecompositionRequest& request);
// A kd-tree: boxes hug what is occupied. Empty space at least kLeastCut voxels thick is cut away from a box before it is divided, at equal
// work, across `axis` down to boxes of a few halos, as `shape` has it, else across its longest side. What was cut away are
// boxes of the partition, too, numbered after the `boxes` others.
inline constexpr int kKdTreeShapes = 3;
Partition MakeKdTree(const DecompositionRequest& request);

}  // namespace slabstream
