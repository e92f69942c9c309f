// From what samples see to the fragments of pixels.
#pragma once

#include <vector>

#include "worker/shapes/shape_scene.h"
#include "worker/shapes/tile_samples.h"

namespace slabstream {

// `hits`: as KeepNearest leaves them.
ShapeTile ResolveTile(const ShapeScene& scene, const TileSamples& samples, const std::vector<ShapeHit>& hits);

}  // namespace slabstream
