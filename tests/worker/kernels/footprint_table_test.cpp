// Footprints by table and places by fixed point, against Gaussians and places in double precision.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "worker/kernels/footprint_table.h"

namespace slabstream {
namespace {

constexpr double kCut = 3;

// A sample that lies `place` voxels from voxel 0 takes `weight` of voxel n.
double ExactWeight(double sigma, double place, double n) {
  const auto bell = [&](double d) {
    return std::abs(d) < kCut * sigma ? std::exp(-0.5 * d * d / (sigma * sigma)) - std::exp(-0.5 * kCut * kCut) : 0.0;
  };
  double sum = 0;
  for (double m = std::floor(place - kCut * sigma); m <= place + kCut * sigma + 1; ++m) sum += bell(place - m);
  return bell(place - n) / sum;
}

TEST(FootprintTable, HoldsNormalisedGaussians) {
  const unsigned seed = 21;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (double sigma : {0.55, 0.6, 0.7, 1.0, 1.3, 1.9, 2.1}) {
    const FootprintTable table = MakeFootprintTable(sigma, kCut);
    EXPECT_EQ(table.radius, kCut * sigma);
    EXPECT_EQ(table.taps, int(std::ceil(2 * table.radius)));
    for (int phase = 0; phase < kPhases; ++phase) {
      double sum = 0;
      for (int n = 0; n < table.taps; ++n) sum += double(table.weights[std::size_t(phase * table.taps + n)]);
      ASSERT_NEAR(sum, 1, 1e-6);
    }
    // Half a phase away a weight has changed by at most the slope of a Gaussian, 0.242 / sigma^2, and what the normalisation adds.
    const double bound = 0.3 / (sigma * sigma) / (2 * kPhases);
    for (int i = 0; i < 3000; ++i) {
      const double place = 100 * uniform(random), at = place - table.radius + 1;
      const auto first = int(std::floor(at)), phase = int((at - first) * kPhases);
      for (int n = -1; n <= table.taps; ++n) {
        const double weight = n < 0 || n == table.taps ? 0 : double(table.weights[std::size_t(phase * table.taps + n)]);
        ASSERT_NEAR(weight, ExactWeight(sigma, place, first + n), bound) << "seed " << seed << " sigma " << sigma << " place " << place;
      }
    }
  }
}

// The error of a place does not grow beyond 2^-15 voxel on the longest row that a frame may have.
TEST(Lattice, KeepsItsErrorBoundOnLongRows) {
  const unsigned seed = 22;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr std::int32_t kLongestRow = 1 << 17;
  for (int i = 0; i < 200; ++i) {
    const double scale = std::pow(10, 2 * uniform(random) - 1), offset = 2e5 * uniform(random) - 1e5, radius = 1.5 + 4 * uniform(random);
    const Lattice lattice = MakeLattice(scale, offset, radius);
    for (int j = 0; j < 100; ++j) {
      const auto pixel = std::int32_t(random() % kLongestRow);
      const double exact = (pixel + 0.5 - offset) / scale - radius + 1, got = std::ldexp(double(lattice.At(pixel)), -32);
      ASSERT_NEAR(got, exact, std::ldexp(pixel + 2.0, -32) + 1e-9) << "seed " << seed << " scale " << scale;
      const double place = Lattice::First(lattice.At(pixel)) + (double(Lattice::Phase(lattice.At(pixel))) + 0.5) / kPhases;
      ASSERT_NEAR(place, got, 0.5 / kPhases + 1e-9);
    }
  }
}

TEST(Lattice, FindsTheFirstSampleBeyondAPlane) {
  const unsigned seed = 23;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 5000; ++i) {
    const double scale = std::pow(10, 2 * uniform(random) - 1), offset = 400 * uniform(random) - 200, radius = 1.5 + 4 * uniform(random);
    const Lattice lattice = MakeLattice(scale, offset, radius);
    const auto begin = std::int32_t(random() % 100), end = begin + std::int32_t(random() % 300);
    const double plane = 300 * uniform(random) - 150;
    const std::int32_t first = FirstSampleFrom(lattice, radius, plane, begin, end);
    ASSERT_GE(first, begin);
    ASSERT_LE(first, end);
    constexpr double kTolerance = 1e-6;
    const auto place = [&](std::int32_t pixel) { return (pixel + 0.5 - offset) / scale; };
    if (first > begin) {
      ASSERT_LT(place(first - 1), plane + kTolerance) << "seed " << seed;
    }
    if (first < end) {
      ASSERT_GE(place(first), plane - kTolerance) << "seed " << seed;
    }
  }
}

// Whatever lies absurdly far away stays a number.
TEST(Lattice, IsBoundedForAnyGrid) {
  for (double scale : {0.1, 1.0, 1e12}) {
    for (double offset : {-1e12, 1e12}) {
      const Lattice lattice = MakeLattice(scale, offset, 2);
      for (std::int32_t pixel : {0, 1 << 17}) {
        EXPECT_LE(std::abs(std::ldexp(double(lattice.At(pixel)), -32)), std::ldexp(1.0, 30) + (1 << 17) / scale + 1);
      }
      EXPECT_EQ(FirstSampleFrom(lattice, 2, 0, 0, 100), offset > 0 ? 100 : 0);
    }
  }
}

TEST(Lattice, FindsFirstSamplesOfEvenlySpacedPlaces) {
  const unsigned seed = 24;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 500; ++i) {
    const double scale = std::pow(10, 2 * uniform(random) - 1), offset = 400 * uniform(random) - 200;
    const Lattice lattice = MakeLattice(scale, offset, 1.5 + 4 * uniform(random));
    const auto begin = std::int32_t(random() % 100), end = begin + std::int32_t(random() % 300);
    const std::int64_t stride = (1 + std::int64_t(random() % 20)) << 32, from = (std::int64_t(random() % 400) - 200) << 32;
    FirstSamples samples(lattice, from, stride);
    for (int n = 0; n < 60; ++n, samples.Next()) {
      const std::int64_t place = from + n * stride;
      const std::int32_t first = samples.In(begin, end);
      ASSERT_TRUE(first >= begin && first <= end);
      if (first > begin) {
        ASSERT_LT(lattice.At(first - 1), place) << "seed " << seed << " case " << i << ", " << n;
      }
      if (first < end) {
        ASSERT_GE(lattice.At(first), place) << "seed " << seed << " case " << i << ", " << n;
      }
    }
  }
  FirstSamples still({.start = 0, .step = 0}, -5, 3);  // every sample lies at 0
  EXPECT_EQ(still.In(2, 9), 2);
  still.Next();
  EXPECT_EQ(still.In(2, 9), 2);
  still.Next();
  EXPECT_EQ(still.In(2, 9), 9);
}

}  // namespace
}  // namespace slabstream
