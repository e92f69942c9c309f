#include "common/decomposition/grow_tree.h"

namespace slabstream {

Partition MakeSlabs(const DecompositionRequest& request) { return GrowTree(request, {.axes = {&request.axis, 1}}); }

}  // namespace slabstream
