// TileRoom: what the passes of a tile hand each other. One tile at a time.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "worker/renderers/shear/shear_tile.h"

namespace slabstream::shear {

inline constexpr std::int32_t kSlots = 4;  // slices that a kernel reads
inline constexpr std::int32_t kBlockRows = 8, kBlocks = kTileRows / kBlockRows;

inline constexpr std::int32_t kNoSlice = std::numeric_limits<std::int32_t>::max();

// One part of each ray that clipping leaves.
struct PartRoom {
  alignas(64) float begin[kTileRows][kTileColumns], end[kTileRows][kTileColumns];   // samples that the box owns
  alignas(64) float first[kTileRows][kTileColumns], last[kTileRows][kTileColumns];  // EndSamples
  alignas(64) float first_excess[kTileRows][kTileColumns], last_excess[kTileRows][kTileColumns];
  alignas(64) float face[3][kTileRows][kTileColumns], face_end[kTileRows][kTileColumns];  // if the volume is clipped
};

// A chunk of kBlockRows rows.
struct BlockState {
  bool alive = false;                    // a ray may have samples left
  std::int32_t z_first = 0, z_last = 0;  // intervals between slices that hold its samples, if it was ever alive
  bool resampled[kSlots] = {};
  std::int32_t gradients_of[2] = {kNoSlice, kNoSlice};  // slices of the volume whose gradients are there
};

// Lattice points of a slice.
struct SliceRoom {
  alignas(64) float values[kTileRows][kTileColumns];
  alignas(64) float low[kTileRows][kChunks], high[kTileRows][kChunks];  // bounds of the chunk's values
};

// Central differences of the volume's samples, over two voxels, at lattice points of a slice of the volume.
struct GradientRoom {
  alignas(64) float along[3][kTileRows][kTileColumns];  // x, y and z
};

// A translucent fragment of a shape.
struct TileFragment {
  std::int32_t row, column;
  float k;  // it lies in front of this sample: a whole number
  std::array<float, 4> rgba;
};

// The memory that one tile needs.
struct TileRoom {
  SliceRoom slots[kSlots];
  GradientRoom gradients[2];
  AlignedVector<float> beams;  // after pass 1, of a chunk: [beam][column], or [beam][x, y, z][column] of gradients
  std::int32_t slot_z[kSlots];
  BlockState blocks[kBlocks][kChunks];
  alignas(64) float z_of_first[kTileRows][kTileColumns];  // z of sample 0 of each ray
  alignas(64) float red[kTileRows][kTileColumns], green[kTileRows][kTileColumns], blue[kTileRows][kTileColumns],
      alpha[kTileRows][kTileColumns];
  PartRoom parts[2];
  // Of frames with shapes. Fragments lie pixel by pixel, nearest first.
  std::vector<TileFragment> fragments;
  std::uint32_t next_fragment[kTileRows][kTileColumns];        // numbers in `fragments`
  alignas(64) float next_fragment_k[kTileRows][kTileColumns];  // its k; kRayEnd: there is none
  alignas(64) float ray_ends[kTileRows][kTileColumns];         // samples: where opaque fragments end rays, or kRayEnd
  AlignedVector<float> between, between_slices[kSlots];        // beams between those of the volume
};

}  // namespace slabstream::shear
