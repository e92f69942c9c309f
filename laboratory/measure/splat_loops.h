// DenseSlice: splatting and compositing of one slice of side x side shaded voxels at a pixel a voxel, in three ways that make the same
// pixels, for timing:
// - plainly, as the paper did: each occupied voxel adds k x k weighted pixels to a sheet (Westover 1990). Compiled without vectors;
// - in phases, as the paper proposes for vectors (Yagel and Machiraju, section 5.1): there is a phase for each of the k x k offsets, in
//   which all voxels, empty ones too, add to the pixel at that offset. The voxel's own pixel is one of them, so 5 x 5 pixels are the
//   paper's 24 phases and one. In vectors of the best instruction set;
// - by the pipeline's kernels, band by band as in the pipeline: k + k filter taps, vectors, and no sheet.
#pragma once

#include <cstdint>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "worker/kernels/footprint_table.h"
#include "worker/kernels/segment_set.h"

namespace slabstream {

// Footprints of k pixels are cut at three sigma on both sides. The pipeline's kernels are made for three taps or more.
inline constexpr int kLeastDiameter = 3, kMostDiameter = 31;
constexpr double SigmaOf(int k) { return (k - 0.5) / 6; }

class DenseSlice {
 public:
  // `side` voxels, [1, 4096]; footprints of `sigma` voxels, cut at three of them, sigma in [SigmaOf(kLeastDiameter),
  // SigmaOf(kMostDiameter)]. `occupancy`: the probability of each voxel to be occupied, (0, 1].
  DenseSlice(std::int32_t side, double sigma, double occupancy = 1, std::uint64_t seed = 1);

  // Each composites the slice behind what is there.
  void SplatPlainly();
  void SplatInPhases();
  void SplatByKernels();

  std::int32_t taps() const { return footprint_.taps; }                     // k
  const AlignedVector<float>& accumulated() const { return accumulated_; }  // RGBA

 private:
  std::size_t VoxelAt(std::int32_t u, std::int32_t v) const;
  std::size_t SheetAt(std::int32_t u, std::int32_t v) const;  // a voxel's first pixel
  void AddEachVoxel();
  void CompositeSheet();

  std::int32_t side_;
  FootprintTable footprint_;
  Lattice lattice_;            // along both axes
  std::int32_t pixels_;        // a side of the frame: all footprints lie in it
  std::int32_t row_voxels_;    // voxels in a row of the stored slice, with margins
  std::vector<float> square_;  // k x k weights of a voxel's pixels
  AlignedVector<float> voxels_, accumulated_, filtered_, sheet_;
  std::int32_t words_;
  std::vector<SegmentWord> all_, open_;  // every segment of a row; those that are not opaque yet
};

// A phase for each weight, [k][k]: at weight (j, i) all voxels of row v are added to row v + j of the sheet, i pixels on. Rows of `floats`
// floats; up to 64 floats behind a row are read, and added to the sheet: they must be 0.
struct PhaseWork {
  const float* voxels = nullptr;
  std::size_t voxel_stride = 0;  // floats from row to row
  float* sheet = nullptr;
  std::size_t sheet_stride = 0, floats = 0;
  std::int32_t rows = 0, k = 0;
  const float* weights = nullptr;
};
void SpreadInPhases(const PhaseWork& work);

}  // namespace slabstream
