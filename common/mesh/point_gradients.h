// The gradients of a mesh's values, by which its matter is lit.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/math/vec.h"
#include "common/memory/aligned_buffer.h"
#include "common/mesh/mesh.h"

namespace slabstream {

// For each point, the mean of the gradients of its tetrahedra, weighted by their volumes: along the axes of the space that the points lie
// in, and as a share of the longest gradient of a point (only directions matter for light). Values of tetrahedra count as those of their
// points, where they have the mean of the tetrahedra weighted by volume. Tetrahedra with a value that is not finite have no gradient; a
// point of no other has the gradient 0. `mesh`: with a value for each point or tetrahedron. Any thread.
AlignedVector<Vector3<float>> PointGradients(const Mesh& mesh);

// The same of a grid whose cells are given part by part, in its order, for the points [begin, end) of it: means over their cells, weighted
// by volume. The sums are those of PointGradients, bit for bit.
template <class Sum>
class MeansOfCells {
 public:
  MeansOfCells(PointNumber begin, PointNumber end) : begin_(begin), sums_(end - begin), volumes_(end - begin) {}

  void Add(PointNumber point, const Sum& by_volume, double volume) {
    const std::size_t i = std::size_t{point} - begin_;  // above all if the point is below `begin`
    if (i >= sums_.size()) return;
    sums_[i] = sums_[i] + by_volume;
    volumes_[i] += volume;
  }
  PointNumber begin() const { return begin_; }
  PointNumber end() const { return begin_ + PointNumber(sums_.size()); }
  // Instead of the sums. Points of no cell that is seen have 0.
  std::vector<Sum> Take();

 private:
  PointNumber begin_;
  std::vector<Sum> sums_;
  std::vector<double> volumes_;
};
// `numbers`: of the part's points in the grid. The first are the values at points if they belong to cells; the second are gradients, of the
// values at the part's points.
void AddValues(const Mesh& part, std::span<const PointNumber> numbers, MeansOfCells<double>& values);
void AddGradients(const Mesh& part, std::span<const PointNumber> numbers, std::span<const double> values, MeansOfCells<Vec3>& gradients);

// A gradient as a share of the longest one.
inline Vector3<float> ShareOf(const Vec3& gradient, double longest) {
  if (!(longest > 0)) return {};
  return {float(gradient.x / longest), float(gradient.y / longest), float(gradient.z / longest)};
}

}  // namespace slabstream
