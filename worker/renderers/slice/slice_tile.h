// SliceTile: the samples of a tile of the picture, and what they add up to (Yagel, Reed, Law, Shih, Shareef 1996).
//
// Planes are taken in chunks, nearest first. A list holds the cells that reach into the chunk:
//
//   1. cells that begin in the chunk join the list, each as a CellShape
//   2. cut: every cell writes the values of its samples, interval by interval, into a buffer [plane][row][x] that is empty before; if the
//      frame is lit, their gradients, too
//   3. compose: samples that the box owns are classified and lit by RayLook, with shadows and ambient occlusion, and blend front to back
//   4. cells that end in the chunk leave the list
//
// A fragment of a shape is composited in front of the next plane behind it. An opaque one ends its ray, like a clipping plane: the last
// sample stands for the length up to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/mesh/mesh.h"
#include "worker/light/frame_light.h"
#include "worker/rays/box_fragments.h"
#include "worker/rays/ray_look.h"
#include "worker/renderers/slice/cell_bins.h"
#include "worker/renderers/slice/frame_space.h"

namespace slabstream::slice {

struct SliceWork {
  const FrameSpace* space = nullptr;
  const Mesh* mesh = nullptr;
  const FramePoints* points = nullptr;  // the mesh's points
  const RayLook* look = nullptr;
  Float3 low{}, high{};                     // the box owns the positions p with low <= p < high on every axis
  bool at_border = false;                   // the box touches the volume's border
  std::int32_t k_begin = 0, k_end = 0;      // its samples are among these
  float termination = 0;                    // a ray ends where it transmits less; 0: never
  const FrameLight::View* light = nullptr;  // shadows and ambient occlusion; null: there are none
  const BoxFragments* fragments = nullptr;  // of shapes; null: there are none
};

// Room for what a tile computes. One tile at a time.
struct TileRoom;
struct DeleteTileRoom {
  void operator()(TileRoom* room) const;
};
using TileRoomPtr = std::unique_ptr<TileRoom, DeleteTileRoom>;
TileRoomPtr MakeTileRoom();

// Premultiplied RGBA of the samples and translucent fragments that the box owns in the pixels of `tile`, at most one tile; `rgba` points to
// the first pixel. Pixels without any stay unwritten: they must be 0 before. `cells`: of CellBins. Returns how many samples were drawn.
std::uint64_t SliceTile(const SliceWork& work, const PixelBounds& tile, std::span<const CellBins::Entry> cells, TileRoom& room, float* rgba,
                        std::size_t floats_a_row);

}  // namespace slabstream::slice
