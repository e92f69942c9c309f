// The splatting stage: sheets of a slice from its shaded voxels.
//
// A footprint is the product of one along u and one along v, and a slice meets the frame's pixels in straight columns and rows
// (common/view/sheet_grid.h). So a sheet is made in two passes of one-dimensional sums, in gather form. First each beam is filtered along u
// to the columns of the frame (FilterBeam). Then each row of the frame gathers the few beams that reach it and composites the sum at once
// (CompositeRow), so no sheet is stored. That is k + k operations a pixel instead of k * k, without a store for each tap.
#pragma once

#include <cstdint>

#include "worker/kernels/footprint_table.h"
#include "worker/kernels/segment_set.h"

namespace slabstream {

// out[i] = sum over n < padded_taps of weight(phase(i), n) * voxels[first(i) + n], for the samples i of the segments in `wanted`; RGBA.
struct BeamWork {
  // Points to voxel 0 of the volume's beam; only voxels that taps reach are read; they must be finite.
  const float* voxels = nullptr;
  float* out = nullptr;                 // points to the row's first pixel, 64-byte aligned
  const SegmentWord* wanted = nullptr;  // `words` words
  std::int32_t words = 0;
  std::int32_t first_sample = 0;  // the sample of the row's first pixel
};
void FilterBeam(const FootprintTable& footprint, const Lattice& lattice, const BeamWork& work);

// accumulated = accumulated over S, with S = sum over n < taps of weights[n] * beams[n]: premultiplied, front to back (Porter and Duff
// 1984), in the open segments that any of the beams fills. A segment closes when its least alpha reaches its
// opaque_alpha.
struct RowWork {
  std::int32_t taps = 0;
  const float* weights = nullptr;
  const float* const* beams = nullptr;         // [taps]: filtered beams, of the row's first pixel, 64-byte aligned
  const SegmentWord* const* filled = nullptr;  // [taps][words]: segments of the beam that hold something; others are not read
  float* accumulated = nullptr;                // points to the row's first pixel, 64-byte aligned
  SegmentWord* open = nullptr;                 // [words]
  std::int32_t words = 0;
  const float* opaque_alpha = nullptr;  // [words * kWordSegments]; above 1: never
};
void CompositeRow(const RowWork& work);

}  // namespace slabstream
