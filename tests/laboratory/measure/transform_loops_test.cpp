#include "laboratory/measure/transform_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/random.h"
#include "tests/support/simd_targets.h"

namespace slabstream {
namespace {

TransformMatrix RandomMatrix(Random& random) {
  TransformMatrix matrix{};
  for (auto& row : matrix) {
    for (std::size_t i = 0; i < 3; ++i) row[i] = float(random.Real(-2, 2));
    row[3] = float(random.Real(-300, 300));
  }
  return matrix;
}

std::vector<Index3> Sizes(Random& random) {
  std::vector<Index3> sizes = {{1, 1, 1}, {2, 3, 5}, {8, 8, 8}, {17, 1, 9}, {1, 31, 2}, {7, 64, 1}, {33, 16, 65}, {100, 100, 10}};
  for (int i = 0; i < 20; ++i) sizes.push_back({random.Integer(1, 70), random.Integer(1, 70), random.Integer(1, 70)});
  return sizes;
}

// The header's bound: for each addition a unit in the last place of the largest number that can occur.
double Bound(const TransformMatrix& matrix, const Index3& size, double additions) {
  double largest = 0;
  for (const auto& row : matrix) {
    largest = std::max(largest, std::abs(row[0]) * double(size.x) + std::abs(row[1]) * double(size.y) + std::abs(row[2]) * double(size.z) +
                                    std::abs(row[3]));
  }
  return (additions + 4) * largest * 0x1p-23;
}

TransformedPoints PointsOf(std::string_view method, const TransformMatrix& matrix, const Index3& size) {
  TransformedPoints points(size);
  FindTransformMethod(method).Run(matrix, size, points);
  return points;
}

TEST(TransformMethods, AgreeWithTheProductInDoublePrecision) {
  Random random(41);
  SCOPED_TRACE(random.trace());
  ForEachTarget([&] {
    for (const Index3& size : Sizes(random)) {
      const TransformMatrix matrix = RandomMatrix(random);
      for (const TransformMethod& method : TransformMethods()) {
        const bool product = method.name.starts_with("product"), first_slice = method.name.ends_with("first slice by products");
        const double additions = product ? 0 : first_slice ? size.z : size.x + size.y + size.z;
        EXPECT_LE(LargestOffset(matrix, size, PointsOf(method.name, matrix, size)), Bound(matrix, size, additions))
            << method.name << ", " << size.x << " x " << size.y << " x " << size.z;
      }
    }
  });
}

TEST(TransformMethods, PhasesAreTheSameBitsWithAndWithoutVectors) {
  Random random(42);
  SCOPED_TRACE(random.trace());
  ForEachTarget([&] {
    for (const Index3& size : Sizes(random)) {
      const TransformMatrix matrix = RandomMatrix(random);
      const TransformedPoints vectors = PointsOf("phases", matrix, size), scalars = PointsOf("phases, no vectors", matrix, size);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_TRUE(std::equal(vectors.components[c].begin(), vectors.components[c].begin() + std::ptrdiff_t(CountIn(size)),
                               scalars.components[c].begin()))
            << size.x << " x " << size.y << " x " << size.z;
      }
    }
  });
}

TEST(TransformMethods, StepsThatAreExactLeaveNoError) {
  constexpr TransformMatrix kExact = {{{0.5F, -0.25F, 2, 80}, {1, 0.75F, -1.5F, -3}, {0.125F, 4, 1, 0}}};
  const Index3 size = {130, 67, 41};
  for (const TransformMethod& method : TransformMethods()) {
    EXPECT_EQ(LargestOffset(kExact, size, PointsOf(method.name, kExact, size)), 0) << method.name;
  }
}

TEST(TransformMethods, ErrorsOfRunningSumsGrowWithTheirLength) {
  constexpr TransformMatrix kMatrix = {{{0.7F, -0.4F, 0.2F, 80}, {0.1F, 0.6F, -0.7F, 150}, {0.5F, 0.4F, 0.8F, 10}}};
  const auto offset = [&](std::string_view method, int n) {
    return LargestOffset(kMatrix, {n, n, n}, PointsOf(method, kMatrix, {n, n, n}));
  };
  EXPECT_GT(offset("phases", 128), 4 * offset("phases", 16));
  EXPECT_GT(offset("phases", 128), 4 * offset("product", 128));
}

TEST(TransformMethods, OperationsAreThoseOfThePaper) {
  Random random(43);
  SCOPED_TRACE(random.trace());
  for (const Index3& size : Sizes(random)) {
    const auto voxels = double(CountIn(size));
    // "For the remaining N^3 - 1 grid points we need 3 N^3 additions at most."
    double additions = 0;
    for (const TransformPass& pass : FindTransformMethod("phases").passes) {
      const Operations operations = pass.operations(size);
      if (pass.name == "seed") {
        EXPECT_EQ(operations.additions, 9);
        EXPECT_EQ(operations.products, 9);
        continue;
      }
      additions += operations.additions;
      EXPECT_EQ(operations.products, 0) << pass.name;
    }
    EXPECT_EQ(additions, 3 * (voxels - 1));
    EXPECT_EQ(FindTransformMethod("product").passes.front().operations(size).products, 9 * voxels);
  }
}

}  // namespace
}  // namespace slabstream
