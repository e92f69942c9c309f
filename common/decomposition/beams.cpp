#include "common/decomposition/grow_tree.h"

namespace slabstream {

Partition MakeBeams(const DecompositionRequest& request) {
  const std::array<Axis, 2> axes = {request.axis, OtherAxes(request.work->size(), request.axis)[0]};
  return GrowTree(request, {.axes = axes});
}

}  // namespace slabstream
