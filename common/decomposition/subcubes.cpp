#include "common/decomposition/grow_tree.h"

namespace slabstream {

Partition MakeSubcubes(const DecompositionRequest& request) {
  const auto [second, third] = OtherAxes(request.work->size(), request.axis);
  const std::array<Axis, 3> axes = {request.axis, second, third};
  return GrowTree(request, {.axes = axes});
}

}  // namespace slabstream
