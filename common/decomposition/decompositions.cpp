#include "common/decomposition/decomposition.h"

namespace slabstream {

const std::vector<DecompositionEntry>& Decompositions() {
  static const std::vector<DecompositionEntry> entries = {
      {"slab", "slabs of slices along --axis", MakeSlabs, "voxels", true},
      {"beam", "boxes cut along two axes, --axis first", MakeBeams, "voxels", false},
      {"subcube", "boxes cut along all three axes", MakeSubcubes, "voxels", false},
      {"octree", "eighths of eighths, at least as many as wanted", MakeOctree, "voxels", false},
      {"kd-tree", "boxes that hug what is occupied, empty space cut away", MakeKdTree, "occupied", false, kKdTreeShapes},
  };
  return entries;
}

}  // namespace slabstream
