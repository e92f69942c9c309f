// Surfaces that pixels see: between which vertices, which way they face, their colour and their light. In single precision without fused
// operations: the same bits on every instruction set.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/memory/pooled_vector.h"
#include "worker/shapes/shape_scene.h"

namespace slabstream {

// Arrays of whole vectors, with one element for each surface; between those of two shapes there may be elements of no surface.
struct Surfaces {
  static constexpr std::uint32_t kMostLanes = 16;
  static constexpr std::uint32_t WholeVectors(std::uint32_t count) { return (count + kMostLanes - 1) / kMostLanes * kMostLanes; }
  template <class T>
  using Each = UnwrittenVector<T>;
  Each<float> column, row, key, depth;       // the pixel's centre, from the tile's corner
  std::array<Each<std::int32_t>, 3> vertex;  // in the shape's arrays
  std::array<Each<float>, 3> weight;         // of these vertices, in [0, 1], 1 in all
  std::array<Each<float>, 3> normal;         // physical, unit or 0
  std::array<Each<float>, 3> color;          // straight; at last what is seen
  Each<float> opacity;
  Each<float> open;                                          // shares of light (FrameLight)
  std::array<Each<float>, std::size_t{kMaxLights}> reached;  // by light

  void Resize(std::size_t count, std::size_t lights);  // of whole vectors; lights: 0: there are no shares
};

// The two below change surfaces of one shape, [begin, end), and what is behind them in the last vector.
// Weights and normals in the pixels' centres, of triangles; where a centre does not see the triangle, those near its edge. As exact as the
// shape's positions are. The tile's corner is at `left`, `top` of the frame.
void WeighTriangles(const SceneShape& shape, double left, double top, std::size_t begin, std::size_t end, Surfaces& surfaces);
// Colours and opacities by weights.
void ColorSurfaces(const SceneShape& shape, std::size_t begin, std::size_t end, Surfaces& surfaces);

// Depths by keys.
void FindDepths(const FrameMap& map, std::size_t count, Surfaces& surfaces);

// FrameLight::At, scene.light_way before the side of each surface that is seen, where it does not lie in its own shadow; outside the light
// volume all of the light. The tile's corner is at `left`, `top` of the frame.
void FindShares(const ShapeScene& scene, double left, double top, std::size_t count, Surfaces& surfaces);

// Phong (common/view/phong.h) on the first `count` surfaces. `to_viewer`: physical, unit. `shares`: there are any.
void LightSurfaces(const Shading& shading, const Vec3& to_viewer, bool shares, std::size_t count, Surfaces& surfaces);

}  // namespace slabstream
