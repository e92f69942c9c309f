// From slices in any order to a stack: sorted by their positions along the normal of their plane, and checked to lie evenly. Several slices
// at each position are several volumes, such as times or echoes, if an attribute or two tell them apart. Pure.
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
#include "common/volume/field_info.h"
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
  Index3 size;                // the size of each volume
  TimeAxis times;             // volumes, in the order of the values that tell them apart
  std::string told_apart;     // "EchoTime 4.6, 9.2"; "": one volume
  std::array<Vec3, 3> steps;  // from a voxel to the next one along a row, a column and the stack; mm to right, anterior, superior
  Vec3 origin;
  std::vector<std::size_t> order;    // numbers of slices by their position, one volume after the other
  std::vector<std::int32_t> places;  // for a segmentation: the slice that each frame is a part of
};

// InvalidArgument: fewer than two slices, slices without a place or of different sizes, planes or spacings, several at the same position
// that are no volumes, missing ones, uneven distances. Messages name a slice, what is wrong and what to do.
Result<DicomStack> ArrangeSlices(std::span<const DicomSlice> slices);

// The frames of a segmentation, which has several at a place, one a segment, and leaves out those without any voxel: slices lie
// SpacingBetweenSlices apart, or by the least distance between any two. `order` is left empty, `places` says where each frame is.
// InvalidArgument: as above, and a segment with several frames at a place.
Result<DicomStack> ArrangeSegments(std::span<const DicomSlice> frames);

}  // namespace slabstream
