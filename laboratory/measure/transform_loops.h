// Ways to transform all voxels of a slab, x fastest, into three arrays of coordinates (Yagel and Machiraju, section 3.3), for timing:
// - a matrix product for each voxel;
// - the paper's four phases. Seed: a product for the first voxel. Voxel: the first beam, each voxel from the one before it. Beam: the first
//   slice, each beam from the beam before it. Slice: each slice from the slice before it. Beams run along x here, so that they are
//   contiguous; the paper's run along y, and it says that any order of the axes will do;
// - running beams: additions along each beam, a vector at a time. One number is added from beam to beam and from slice to slice, where the
//   phases add whole beams and slices.
//
// Loops "no vectors" are compiled without automatic vectorisation. The others use Highway, for the best instruction set of the machine.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "common/volume/box.h"

namespace slabstream {

using TransformMatrix = std::array<std::array<float, 4>, 3>;  // rows of x, y and depth

struct TransformedPoints {
  explicit TransformedPoints(const Index3& size) {
    for (auto& component : components) component.resize(CountIn(size) + 64);
  }
  std::array<AlignedVector<float>, 3> components;
};

// Additions and products of floats. A matrix product of a point takes 9 of each, since its fourth coordinate is 1 and stays 1; the paper's
// equation 8 counts 12 and 16.
struct Operations {
  double additions = 0, products = 0;
};

// One pass of a method. It continues what the passes before it have written.
struct TransformPass {
  std::string_view name;
  void (*run)(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
  Operations (*operations)(const Index3& size);
};

struct TransformMethod {
  std::string_view name;
  std::vector<TransformPass> passes;

  void Run(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) const {
    for (const TransformPass& pass : passes) pass.run(matrix, size, points);
  }
};

// "product, no vectors", "phases, no vectors", "product", "phases", "running beams", and "phases, first slice by products": the paper's
// remedy against accumulated errors, a product for each voxel of the first slice instead of the first three phases.
//
// Of s + 1 numbers that are each the sum of the one before and a step, none is off by more than s units in the last place of the largest.
// So no coordinate is off by more than x + y + z of these units, beside the few of its products; after products in the first slice, z.
const std::vector<TransformMethod>& TransformMethods();
const TransformMethod& FindTransformMethod(std::string_view name);  // one of the above

// The largest distance of any coordinate of any point from the product in double precision.
double LargestOffset(const TransformMatrix& matrix, const Index3& size, const TransformedPoints& points);

// to[i] = from[i] + step. Both may be the same. Writes up to 64 floats beyond `count`.
void AddStep(const float* from, float* to, std::size_t count, float step);

// The passes.
void ProductScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void SeedPhase(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void VoxelPhase(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void BeamPhaseScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void SlicePhaseScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void ProductVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void BeamPhaseVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void SlicePhaseVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void RunningBeamsVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);

}  // namespace slabstream
