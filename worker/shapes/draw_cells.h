// What is not a small triangle, in double precision: large triangles, and capsules.
#pragma once

#include <array>
#include <vector>

#include "common/shapes/capsule.h"
#include "worker/shapes/key_plane.h"
#include "worker/shapes/shape_scene.h"
#include "worker/shapes/tile_samples.h"

namespace slabstream {

// What a pass over samples changes. `hits`: null: the element is opaque, otherwise what it shows is added there.
struct Drawing {
  const ShapeScene& scene;
  TileSamples& samples;
  std::vector<ShapeHit>* hits = nullptr;
};

// `range`: pixels of the tile, not empty, that the element may lie in. Edge functions of steps from the tile's corner, >= 0 inside; keys of
// pixels from there.
void DrawLargeTriangle(const Drawing& drawing, const PixelBounds& range, const std::array<Line3, 3>& edges, const KeyPlane& plane,
                       Element element);
void DrawCapsule(const Drawing& drawing, const PixelBounds& range, const Capsule& capsule, Element element);

}  // namespace slabstream
