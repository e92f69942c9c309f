// TileRoom: what the steps of a tile hand each other. One tile at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/renderers/slice/cell_shape.h"
#include "worker/renderers/slice/slice_tile.h"

namespace slabstream::slice {

inline constexpr std::size_t kTilePixels = std::size_t(kTileWidth) * kTileHeight, kRowPadding = 16;  // kernels may rewrite what lies behind

// A cell that reaches into the chunk.
struct ActiveMacrocell {
  CellShape shape;
  std::int32_t k_begin, k_end;  // planes that it may reach into
  std::int32_t y_begin, y_end;  // rows of the tile
};

// One of the parts that clipping leaves of the rays; by pixel, [y][x].
struct TilePart {
  alignas(64) float begin[kTilePixels], end[kTilePixels];   // samples of the box
  alignas(64) float first[kTilePixels], last[kTilePixels];  // EndSamples
  alignas(64) float first_excess[kTilePixels], last_excess[kTilePixels];
  alignas(64) float face[3][kTilePixels], face_end[kTilePixels];  // PacketPart; of clipped frames that are lit
};

// A translucent fragment of a shape. It is composited in front of the samples of a plane.
struct PlaneFragment {
  std::int32_t plane;
  std::size_t pixel;
  std::array<float, 4> rgba;
};

constexpr std::size_t kChunkFloats = kChunkPlanes * kTilePixels + kRowPadding;  // [plane][y][x]

struct TileRoom {
  TilePart parts[2];
  bool has_ends;                                                  // a sample may stand for another length than a step
  alignas(64) float ray_ends[kTilePixels];                        // samples: where opaque fragments end rays, or kRayEnd; with shapes
  alignas(64) float length[kTilePixels];                          // of a step of each ray, in distances of planes
  alignas(64) float first[3][kTilePixels], move[3][kTilePixels];  // of each ray (RayPacket); with a FrameLight
  alignas(64) float red[kTilePixels], green[kTilePixels], blue[kTilePixels], alpha[kTilePixels];
  alignas(64) float values[4][kChunkFloats];  // the value, NaN: no cell; then the gradient's components, of frames that are lit
  std::vector<std::size_t> chunk_first;       // of `ordered`, by chunk
  std::vector<std::uint32_t> ordered;         // the tile's cells
  std::vector<ActiveMacrocell> cells;         // rooms of active cells
  std::vector<std::uint32_t> active, vacant;  // of `cells`
  std::vector<PlaneFragment> fragments;       // nearest plane first
  std::size_t next_fragment;
};

// Fills in what shapes have on the rays of `tile`. Returns whether one of them ends a ray.
bool FindFragments(const SliceWork& work, const PixelBounds& tile, TileRoom& room);
// Adds the fragments in front of the samples of plane `k` that are not there yet.
void AddFragments(std::int32_t k, TileRoom& room);

}  // namespace slabstream::slice
