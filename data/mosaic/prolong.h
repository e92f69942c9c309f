// Prolongation: voxels of a level, interpolated between those of a coarser one. Multilinear between centres, constant beyond the
// outermost ones; exact where the values are linear.
//
// Pure. Any thread.
#pragma once

#include <cstddef>

#include "common/volume/volume.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// The voxels of `coarse` that those of `box` of `fine` lie between. Both levels have the same axes.
Box BoxBetween(const Box& box, const VolumeGeometry& fine, const VolumeGeometry& coarse);

// Fills in `box` at `out`. `samples`: of BoxBetween(box, fine, coarse), x fastest. T: float, double.
template <class T>
void Prolong(const T* samples, const Box& box, const VolumeGeometry& fine, const VolumeGeometry& coarse, const BoxRoom& out);

}  // namespace slabstream
