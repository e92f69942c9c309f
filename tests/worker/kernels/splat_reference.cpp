#include "tests/worker/kernels/splat_reference.h"

#include <algorithm>

namespace slabstream {

void FilterBeamReference(const FootprintTable& footprint, const Lattice& lattice, const BeamWork& work) {
  for (std::int32_t word = 0; word < work.words; ++word) {
    for (SegmentWord rest = work.wanted[word]; rest != 0; rest &= rest - 1) {
      const std::int32_t segment = FirstSegment(rest, word);
      for (std::int32_t i = segment * kSegment; i < (segment + 1) * kSegment; ++i) {
        const std::int64_t at = lattice.At(work.first_sample + i);
        const float* voxel = work.voxels + 4 * std::ptrdiff_t{Lattice::First(at)};
        const float* weights = &footprint.weights[Lattice::Phase(at) * std::size_t(footprint.taps)];
        for (std::int32_t c = 0; c < 4; ++c) {
          float sum = 0;
          for (std::int32_t n = 0; n < footprint.taps; ++n) sum += weights[n] * voxel[4 * n + c];
          work.out[4 * i + c] = sum;
        }
      }
    }
  }
}

void CompositeRowReference(const RowWork& work) {
  for (std::int32_t word = 0; word < work.words; ++word) {
    SegmentWord any = 0;
    for (std::int32_t n = 0; n < work.taps; ++n) any |= work.filled[n][word];
    for (SegmentWord rest = any & work.open[word]; rest != 0; rest &= rest - 1) {
      const std::int32_t segment = FirstSegment(rest, word);
      const SegmentWord bit = rest & ~(rest - 1);
      float least = 1;
      for (std::int32_t i = segment * kSegment; i < (segment + 1) * kSegment; ++i) {
        float* pixel = work.accumulated + 4 * i;
        const float transmittance = 1 - pixel[3];
        for (std::int32_t c = 0; c < 4; ++c) {
          float sheet = 0;
          for (std::int32_t n = 0; n < work.taps; ++n) {
            if ((work.filled[n][word] & bit) != 0) sheet += work.weights[n] * work.beams[n][4 * i + c];
          }
          pixel[c] += transmittance * sheet;
        }
        least = std::min(least, pixel[3]);
      }
      if (least >= work.opaque_alpha[segment]) work.open[word] &= ~bit;
    }
  }
}

}  // namespace slabstream
