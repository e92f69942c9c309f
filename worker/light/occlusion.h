// How open the surroundings of each voxel of a light volume are (local ambient occlusion: Hernell, Ljung and Ynnerman 2010): the mean
// transmittance of ways of one length, the radius, that lead away in 26 directions, those of the voxel's neighbours. The directions are
// weighted as points of Lebedev's quadrature on the sphere (1976), so the mean of functions up to degree 7 is exact on a cubic grid.
//
// It is found on a coarser grid, at most kMaxOcclusionSide voxels a side and kMostOcclusionSteps in a radius, and interpolated linearly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "worker/light/extinction.h"

namespace slabstream {

inline constexpr std::int32_t kMaxOcclusionSide = 64;
inline constexpr std::int32_t kMostOcclusionSteps = 8;

// Gets the openness, in [0, 1], of the voxels of a row along x; the first one has this number (NumberIn).
using TakeOpenness = std::function<void(std::size_t first, std::span<const float> row)>;

// `radius`: in the unit of the world, > 0. Each row of the grid that `extinction` is on goes to `take` once, on any thread. A voxel in the
// flat surface of opaque matter has about 1/2. Parallel; the result is the same for any number of threads and any instruction set.
void FindOpenness(const Extinction& extinction, double radius, const TakeOpenness& take);

// What ambient occlusion of this strength, [0, 1], leaves of the light, in 1/255, by openness. A flat surface, which has an openness of
// about 1/2, keeps its light.
void KeepOpen(std::span<const float> open, float strength, std::uint8_t* out);

}  // namespace slabstream
