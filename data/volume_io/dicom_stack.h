// From slices in any order to a stack: sorted by their positions along the normal of their plane, and checked to lie evenly. Pure.
//
// Names of files and InstanceNumber do not matter. The step from slice to slice need not be along the normal: with a tilted gantry it is
// not, and such stacks are straightened later (world_placement.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "data/volume_io/dicom_image.h"

namespace slabstream {

// How far a slice may lie off its place in an even stack, in voxels along each axis: scanners round positions to a tenth of a millimetre.
inline constexpr double kMostOffPlace = 0.2;
// How far directions of slices may differ, by component; and spacings, as a share.
inline constexpr double kMostTurned = 1e-3;
// Slices nearer to each other than this share of the mean distance are at the same position.
inline constexpr double kSamePlace = 0.01;

struct DicomSlice {
  const DicomFrame* frame = nullptr;
  std::int32_t columns = 0, rows = 0;
  std::string name;  // for messages
};

struct DicomStack {
  Index3 size;
  std::array<Vec3, 3> steps;  // from a voxel to the next one along a row, a column and the stack; mm to right, anterior, superior
  Vec3 origin;
  std::vector<std::size_t> order;  // numbers of slices, by their position
};

// InvalidArgument: fewer than two slices, slices without a place or of different sizes, planes or spacings, several at the same position,
// missing ones, uneven distances. Messages name a slice, what is wrong and what to do.
Result<DicomStack> ArrangeSlices(std::span<const DicomSlice> slices);

}  // namespace slabstream
