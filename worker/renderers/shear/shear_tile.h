// ShearTile: the passes of a tile of the picture, and what its samples add up to.
//
// A tile goes through the box slice by slice of z, nearest first:
//
//   1. reconstruct and view: passes 1 and 2 resample a slice onto the tile's lattice points (u, v, z), in chunks of kChunk columns
//   2. the last four resampled slices are kept; pass 3 makes the samples (u, v, k) that lie between the middle two
//   3. shade: a sample is classified by RayLook; its gradient is made of central differences, which each pass finds along its own axis
//      among the samples that it reads anyway
//   4. compose: samples blend front to back
//
// Chunks of slices without active cells, and those whose rays are opaque or elsewhere, are not resampled.
//
// Samples lie where those of ray casting lie, and are owned alike: sample (u, v, k) at p belongs to the box with low <= p < high.
//
// A fragment of a shape is composited in front of the next sample behind it. An opaque one ends its ray, like a clipping plane: the last
// sample stands for the length up to it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/image/occlusion_mask.h"
#include "worker/rays/box_fragments.h"
#include "worker/rays/ray_look.h"
#include "worker/rays/view_rays.h"
#include "worker/renderers/shear/active_macrocells.h"
#include "worker/renderers/shear/cubic_kernel.h"
#include "worker/renderers/shear/shear_passes.h"
#include "worker/renderers/shear/turned_voxels.h"

namespace slabstream::shear {

// Lattice points of a tile, along u and v.
inline constexpr std::int32_t kChunk = 16, kChunks = 4, kTileColumns = kChunk * kChunks, kTileRows = 32;

struct ShearWork {
  const ViewRays* rays = nullptr;  // orthographic
  const ShearPasses* passes = nullptr;
  CubicKernel kernel;
  int supersampling = 1;  // beams, and slices, for each of the volume
  const TurnedVoxels* voxels = nullptr;
  const ActiveMacrocells* active = nullptr;
  const RayLook* look = nullptr;
  const VisibleSamples* visible = nullptr;
  Float3 low{}, high{};                     // the box owns the positions p with low <= p < high on every axis of the volume
  std::int32_t k_begin = 0, k_end = 0;      // its samples are among these
  const OcclusionMask* hidden = nullptr;    // the frame's hidden tiles
  float termination = 0;                    // a ray ends where it transmits less; 0: never
  const BoxFragments* fragments = nullptr;  // of shapes; null: there are none
};

// Where a tile's pixels are stored: four floats each.
struct TilePixels {
  PixelBounds pixels;                                           // of the frame
  std::int32_t u_begin = 0, v_begin = 0, u_end = 0, v_end = 0;  // at most kTileColumns x kTileRows
  float* first = nullptr;
  std::ptrdiff_t along_u = 0, along_v = 0;  // floats
};

// Room for what a tile computes. One tile at a time.
struct TileRoom;
struct DeleteTileRoom {
  void operator()(TileRoom* room) const;
};
using TileRoomPtr = std::unique_ptr<TileRoom, DeleteTileRoom>;
TileRoomPtr MakeTileRoom();

// Premultiplied RGBA of the samples and translucent fragments that the box owns. Pixels without any stay unwritten: they must be 0 before.
// Returns how many samples were shaded.
std::uint64_t ShearTile(const ShearWork& work, const TilePixels& tile, TileRoom& room);

}  // namespace slabstream::shear
