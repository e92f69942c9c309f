// March: the ray caster's kernel (Levoy 1988, 1990). Samples of a box along the rays of a tile of pixels are interpolated, classified,
// shaded and composited front to back.
//
//   sample      trilinear interpolation of stored samples (gradient_bricks-inl.h)
//   classified  after interpolation, by RayLook::entries; a sample that is not finite is empty
//   gradient    central differences of stored samples over two voxels, interpolated like the samples. If `smooth`, each of the two slices
//               is smoothed first
//   opacity     times the factor of the plain gradient's magnitude (RayLook::gradient_factors), if there is such a curve
//   shaded      as Phong::AtNormal and WithoutGradient define it
//   light       shadows and ambient occlusion at the sample (LightAt), if there are any
//   labels      the label of the nearest voxel, or of those around if labels are smoothed, changes the volume's sample as
//               docs/rendering.md says (RayLabels)
//   fields      sampled like the volume, and blended with it (RayFields)
//
// Fragments of shapes are composited among the samples, each by the box that holds it. They cut the ray: samples beside a cut stand for the
// length up to it, as at a clipping plane. An opaque one ends the ray, and is left to whoever finishes the picture (ComposeShapes).
//
// Isosurfaces of the interpolated volume are composited among the samples, each crossing of a ray with its surface's opacity
// (surface_walk-inl.h). A crossing between two samples comes after the first of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "worker/light/frame_light.h"
#include "worker/rays/ray_box.h"
#include "worker/rays/ray_look.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/gradient_bricks.h"
#include "worker/renderers/raycast/ray_fields.h"
#include "worker/renderers/raycast/ray_labels.h"
#include "worker/shapes/fragment_order.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

struct MarchWork {
  const ViewRays* rays = nullptr;
  const RayBox* box = nullptr;
  const RayLook* look = nullptr;
  // Distances of the box's cells, for the octants of the rays: to cells with visible samples, and to those that an
  // isosurface passes through.
  const EmptyDistances* to_samples = nullptr;
  const EmptyDistances* to_surfaces = nullptr;  // null: no isosurface is shown
  const std::int32_t* surface_cells = nullptr;  // FindSurfaceCells
  float termination = 0;                        // a ray ends where it transmits less; 0: never
  bool smooth = false;                          // light falls on smoothed gradients
  const RayLabels* labels = nullptr;            // null: none are shown
  const RayFields* fields = nullptr;            // null: no other field is shown
  const ShapeTile* shapes = nullptr;            // that holds the tile's pixels; null: there are none
  const FragmentOrder* order = nullptr;         // of the frame, if there are shapes
  const FrameLight::View* light = nullptr;      // shadows and ambient occlusion, by positions in the box; null: there are none
};

// Premultiplied RGBA of the samples that the box owns on the rays of the pixels of `tile`; `rgba` points to the first pixel. Pixels without
// a visible sample may stay unwritten: they must be 0 before. Returns how many samples were shaded. `bricks`: the calling thread's,
// of the volume and of each other field.
std::uint64_t MarchTile(const MarchWork& work, const PixelBounds& tile, std::span<GradientBricks> bricks, float* rgba,
                        std::size_t floats_a_row);

}  // namespace slabstream
