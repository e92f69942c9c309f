// --sampling-rate: the parameter of all renderers that take samples along rays.
#pragma once

#include "common/renderers/renderer_kind.h"

namespace slabstream {

inline RendererParameter SamplingRate() {
  return {.name = "sampling-rate", .purpose = "Samples along a ray in each voxel length", .standard = 1, .least = 0.1, .most = 16};
}

}  // namespace slabstream
