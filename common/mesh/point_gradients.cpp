#include "common/mesh/point_gradients.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "common/mesh/mesh_cell.h"

namespace slabstream {
namespace {

struct CellGradient {
  Vec3 by_volume;  // the gradient times the volume: finite in flat cells, too
  double volume;
};

// From the first point of a tetrahedron to the others.
struct Edges {
  Vec3 a, b, c;
};
Edges EdgesOf(const Mesh& mesh, const Tetrahedron& t) {
  const auto place = [&](std::size_t i) {
    const Vector3<float>& p = mesh.points[t[i]];
    return Vec3{double(p.x), double(p.y), double(p.z)};
  };
  const Vec3 origin = place(0);
  return {place(1) - origin, place(2) - origin, place(3) - origin};
}

double VolumeOf(const Mesh& mesh, const Tetrahedron& t) {
  const auto [a, b, c] = EdgesOf(mesh, t);
  return std::abs(Dot(a, Cross(b, c))) / 6;
}

CellGradient GradientOf(const Mesh& mesh, const Tetrahedron& t, const auto& values) {
  const auto [a, b, c] = EdgesOf(mesh, t);
  const auto rise = [&](std::size_t i) { return double(values[t[i]]) - double(values[t[0]]); };
  const double volume = Dot(a, Cross(b, c)) / 6;  // negative if the cell is inside out
  const Vec3 by_volume = rise(1) / 6 * Cross(b, c) + rise(2) / 6 * Cross(c, a) + rise(3) / 6 * Cross(a, b);
  return {volume < 0 ? -by_volume : by_volume, std::abs(volume)};
}

bool IsSeen(const Mesh& mesh, std::size_t cell) { return ValuesIn(mesh, cell) != kNoFiniteValue; }

// The mean values of points. Points of no tetrahedron that is seen have the value 0.
std::vector<double> ValuesAtPoints(const Mesh& mesh) {
  std::vector<double> sums(mesh.points.size()), volumes(mesh.points.size());
  for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
    if (!IsSeen(mesh, cell)) continue;
    const double volume = VolumeOf(mesh, mesh.tetrahedra[cell]);
    for (const PointNumber point : mesh.tetrahedra[cell]) {
      sums[point] += volume * double(mesh.values[cell]);
      volumes[point] += volume;
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] = volumes[i] > 0 ? sums[i] / volumes[i] : 0;
  return sums;
}

AlignedVector<Vector3<float>> GradientsOf(const Mesh& mesh, const auto& values) {
  std::vector<Vec3> gradients(mesh.points.size());
  std::vector<double> volumes(mesh.points.size());
  for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
    if (!IsSeen(mesh, cell)) continue;
    const CellGradient gradient = GradientOf(mesh, mesh.tetrahedra[cell], values);
    for (const PointNumber point : mesh.tetrahedra[cell]) {
      gradients[point] = gradients[point] + gradient.by_volume;
      volumes[point] += gradient.volume;
    }
  }
  double longest = 0;
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    gradients[i] = volumes[i] > 0 ? (1 / volumes[i]) * gradients[i] : Vec3{};
    if (!std::isfinite(Length(gradients[i]))) gradients[i] = {};
    longest = std::max(longest, Length(gradients[i]));
  }
  AlignedVector<Vector3<float>> shares(gradients.size());
  if (!(longest > 0)) return shares;
  std::ranges::transform(gradients, shares.begin(), [&](const Vec3& g) {
    return Vector3<float>{float(g.x / longest), float(g.y / longest), float(g.z / longest)};
  });
  return shares;
}

}  // namespace

AlignedVector<Vector3<float>> PointGradients(const Mesh& mesh) {
  return mesh.at == ValuesAt::kPoints ? GradientsOf(mesh, mesh.values) : GradientsOf(mesh, ValuesAtPoints(mesh));
}

}  // namespace slabstream
