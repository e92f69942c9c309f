// SliceSamples: where the frame's pixels sample a slice, and the samples that belong to a box.
//
// Ownership: the sample of pixel P in slice k belongs to the box whose cross-section holds the point where P's ray meets the slice. Rays
// through a column meet a slice in one line of constant u, rays through a row in one of constant v, so a box owns a rectangle of every
// sheet. Its borders are functions of (grid, slice, plane) alone: boxes on both sides of a plane find the same column, and every sample has
// one owner. Boxes on the volume's rim own everything outside.
#pragma once

#include <cstdint>
#include <map>

#include "common/frame/frame_setup.h"
#include "common/image/pixel_bounds.h"
#include "worker/kernels/footprint_table.h"

namespace slabstream {

// Footprints of a frame, by standard deviation. It varies between slices only in a minified perspective view. Addresses stay valid.
class Footprints {
 public:
  const FootprintTable& Get(double sigma);

 private:
  std::map<double, FootprintTable> tables_;
  double last_sigma_ = 0;  // asked for, of
  const FootprintTable* last_ = nullptr;
};

struct SliceSamples {
  const FootprintTable* along_u = nullptr;
  const FootprintTable* along_v = nullptr;
  Lattice columns, rows;
  PixelBounds owned;  // pixels of the frame that belong to the box and that occupied voxels of `reach` can touch
};

// The first pixel i whose first tap is `voxel` or a later one, in [begin, end].
std::int32_t FirstPixelWithTap(const Lattice& lattice, std::int32_t voxel, std::int32_t begin, std::int32_t end);

// For slice k. `box` owns the samples; `reach` holds all occupied voxels.
SliceSamples SampleSlice(const FrameSetup& setup, const Box& box, const Box& reach, std::int32_t k, Footprints& footprints);

}  // namespace slabstream
