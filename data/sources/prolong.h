// Prolongation: voxels of a grid, interpolated between those of another one. Multilinear between centres, constant beyond the outermost
// ones; exact where the values are linear.
//
// Pure. Any thread.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/volume/volume.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// Where the voxels of a box lie along each axis among those of the other grid: ascending, from 0 to its last one. At least one each.
using VoxelPlaces = std::array<std::vector<double>, 3>;

// Of two levels with the same axes.
VoxelPlaces PlacesBetween(const Box& box, const VolumeGeometry& fine, const VolumeGeometry& coarse);

// The voxels of the other grid that the places lie between.
Box BoxBetween(const VoxelPlaces& places);

// Fills in the box at `out`, with `shift` added. `samples`: of BoxBetween(places), x fastest. From, To: float, float; double, double;
// std::uint8_t or std::uint16_t, float.
template <class From, class To>
void Prolong(const From* samples, const VoxelPlaces& places, const BoxRoom& out, double shift = 0);

}  // namespace slabstream
