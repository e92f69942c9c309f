// MarchStretched: the ray caster's kernel in a rectilinear grid (march.h says what becomes of a sample). Samples are interpolated between
// the grid's own voxels; gradients are differences of neighbours over their distance.
//
// Steps follow the voxels. A ray is cut into blocks of 2^n units, each at a multiple of its length; a unit is half the least step (StepOf).
// A block is the longest one that passes 1 / sampling-rate of a voxel at most, along any axis, by the voxels where it begins and beside
// them (StretchTable::strides). A sample lies in the middle of what the volume and clipping leave of its block and stands for its length.
// So samples depend on the ray alone, and boxes agree on them; each belongs to the box that owns its position.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/frame/frame_setup.h"
#include "worker/rays/stretch_tables.h"
#include "worker/renderers/raycast/march.h"

namespace slabstream {

struct StretchedSteps {
  StretchTables tables;
  ViewRays rays;                // a step of them is a unit
  float most = 2;               // units of the longest blocks: a power of two
  float samples_per_voxel = 1;  // of the request

  StretchedSteps(const FrameSetup& setup, double samples_per_voxel);
  // Least steps in a voxel length of the volume.
  static double StepsPerVoxel(const VolumeGeometry& geometry, double samples_per_voxel);
};

// Without gradient opacity, replaces the opacity of a step in each entry by its extinction.
void MakeExtinctions(RayLook& look);
inline constexpr double kOpaqueExtinction = 1e9;  // of an opacity of 1

// As MarchTile. `work`: with the rays of `steps`, and without labels, fields and light; its box has the tables of `steps`.
std::uint64_t MarchStretchedTile(const MarchWork& work, const StretchedSteps& steps, const PixelBounds& tile, float* rgba,
                                 std::size_t floats_a_row);

}  // namespace slabstream
