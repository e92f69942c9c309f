#include "laboratory/measure/splat_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/support/random.h"
#include "tests/support/simd_targets.h"

namespace slabstream {
namespace {

double LargestDifference(const AlignedVector<float>& a, const AlignedVector<float>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(double(a[i]) - double(b[i])));
  return largest;
}

TEST(DenseSlice, IsTheSameInPhasesByKernelsAndPlainly) {
  Random random(51);
  SCOPED_TRACE(random.trace());
  ForEachTarget([&] {
    for (int k = kLeastDiameter; k <= kMostDiameter; ++k) {
      const int side = random.Integer(1, 90);
      const double occupancy = random.Chance(0.3) ? 1 : random.Real(0.02, 1);
      const auto seed = std::uint64_t(random.Integer(1, 1000));
      DenseSlice plain(side, SigmaOf(k), occupancy, seed), phases(side, SigmaOf(k), occupancy, seed),
          kernels(side, SigmaOf(k), occupancy, seed);
      EXPECT_EQ(plain.taps(), k);
      for (int slices = 0; slices < 2; ++slices) {
        plain.SplatPlainly();
        phases.SplatInPhases();
        kernels.SplatByKernels();
        EXPECT_LE(LargestDifference(plain.accumulated(), phases.accumulated()), 2e-6) << "k " << k << ", side " << side;
        EXPECT_LE(LargestDifference(plain.accumulated(), kernels.accumulated()), 2e-6) << "k " << k << ", side " << side;
      }
    }
  });
}

// Weights sum to 1: what voxels hold arrives in the frame, of every footprint alike.
TEST(DenseSlice, KeepsTheSumOfItsVoxels) {
  constexpr int kSide = 37;
  const auto sum_of = [](int k) {
    DenseSlice slice(kSide, SigmaOf(k), 0.6, 9);
    slice.SplatInPhases();
    return std::accumulate(slice.accumulated().begin(), slice.accumulated().end(), 0.0);
  };
  const double expected = sum_of(5);
  EXPECT_NEAR(expected, 4 * kSide * kSide * 0.6 * 0.01, 0.1 * expected);
  for (int k = kLeastDiameter; k <= kMostDiameter; ++k) EXPECT_NEAR(sum_of(k), expected, 1e-4 * expected) << k;
}

}  // namespace
}  // namespace slabstream
