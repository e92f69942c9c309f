#include "common/decomposition/decomposition.h"

namespace slabstream {

const std::vector<DecompositionEntry>& Decompositions() {
  static const std::vector<DecompositionEntry> entries = {
      {"slab", "slabs of slices along --axis", MakeSlabs, "voxels", true},
      {"beam", "boxes cut along two axes, --axis first", MakeBeams, "voxels", false},
      {"subcube", "boxes cut along all three axes", MakeSubcubes, "voxels", false},
      {"octree", "octants of octants, at least as many as requested", MakeOctree, "voxels", false},
      {"kd-tree", "boxes that fit tightly round occupied voxels, with empty space cut away", MakeKdTree, "bricks", false, kKdTreeShapes},
  };
  return entries;
}

}  // namespace slabstream
