#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "laboratory/measure/transform_loops.h"

namespace slabstream {
namespace {

constexpr double kRows = 3;  // of the matrix, and coordinates of a point

double SliceOf(const Index3& size) { return double(size.x) * size.y; }
Operations Products(double points) { return {9 * points, 9 * points}; }

// Equations 8 to 11 of the paper.
constexpr auto kOfProduct = [](const Index3& size) { return Products(SliceOf(size) * size.z); };
constexpr auto kOfFirstSlice = [](const Index3& size) { return Products(SliceOf(size)); };
constexpr auto kOfSeed = [](const Index3&) { return Products(1); };
constexpr auto kOfVoxels = [](const Index3& size) { return Operations{kRows * (size.x - 1), 0}; };
constexpr auto kOfBeams = [](const Index3& size) { return Operations{kRows * (size.y - 1) * size.x, 0}; };
constexpr auto kOfSlices = [](const Index3& size) { return Operations{kRows * (size.z - 1) * SliceOf(size), 0}; };
// One addition for each voxel, beam and slice; products for the step of a vector and for its lanes at first.
constexpr auto kOfRunningBeams = [](const Index3& size) {
  return Operations{kRows * (SliceOf(size) * size.z + double(size.y) * size.z + size.z), kRows * 2};
};

void FirstSliceVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  ProductVector(matrix, {size.x, size.y, 1}, points);
}

}  // namespace

const std::vector<TransformMethod>& TransformMethods() {
  static const std::vector<TransformMethod> methods = {
      {"product, no vectors", {{"product", ProductScalar, kOfProduct}}},
      {"phases, no vectors",
       {{"seed", SeedPhase, kOfSeed},
        {"voxel", VoxelPhase, kOfVoxels},
        {"beam", BeamPhaseScalar, kOfBeams},
        {"slice", SlicePhaseScalar, kOfSlices}}},
      {"product", {{"product", ProductVector, kOfProduct}}},
      {"phases",
       {{"seed", SeedPhase, kOfSeed},
        {"voxel", VoxelPhase, kOfVoxels},
        {"beam", BeamPhaseVector, kOfBeams},
        {"slice", SlicePhaseVector, kOfSlices}}},
      {"phases, first slice by products", {{"first slice", FirstSliceVector, kOfFirstSlice}, {"slice", SlicePhaseVector, kOfSlices}}},
      {"running beams", {{"running beams", RunningBeamsVector, kOfRunningBeams}}},
  };
  return methods;
}

const TransformMethod& FindTransformMethod(std::string_view name) {
  const auto found = std::ranges::find(TransformMethods(), name, &TransformMethod::name);
  CHECK(found != TransformMethods().end()) << name;
  return *found;
}

double LargestOffset(const TransformMatrix& matrix, const Index3& size, const TransformedPoints& points) {
  double largest = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::array<double, 4> row = {matrix[c][0], matrix[c][1], matrix[c][2], matrix[c][3]};
    std::size_t i = 0;
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        const double beam = row[1] * y + row[2] * z + row[3];
        for (int x = 0; x < size.x; ++x, ++i) largest = std::max(largest, std::abs(points.components[c][i] - (row[0] * x + beam)));
      }
    }
  }
  return largest;
}

}  // namespace slabstream
