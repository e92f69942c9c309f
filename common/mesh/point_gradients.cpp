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

// `number_of`: a point's number in the grid.
void AddCellValues(const Mesh& mesh, const auto& number_of, MeansOfCells<double>& means) {
  for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
    if (!IsSeen(mesh, cell)) continue;
    const double volume = VolumeOf(mesh, mesh.tetrahedra[cell]);
    for (const PointNumber point : mesh.tetrahedra[cell]) means.Add(number_of(point), volume * double(mesh.values[cell]), volume);
  }
}

void AddCellGradients(const Mesh& mesh, const auto& values, const auto& number_of, MeansOfCells<Vec3>& means) {
  for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
    if (!IsSeen(mesh, cell)) continue;
    const CellGradient gradient = GradientOf(mesh, mesh.tetrahedra[cell], values);
    for (const PointNumber point : mesh.tetrahedra[cell]) means.Add(number_of(point), gradient.by_volume, gradient.volume);
  }
}

constexpr auto kOwnNumber = [](PointNumber point) { return point; };

double MeanOf(double sum, double volume) { return volume > 0 ? sum / volume : 0; }
Vec3 MeanOf(const Vec3& sum, double volume) {
  const Vec3 mean = volume > 0 ? (1 / volume) * sum : Vec3{};
  return std::isfinite(Length(mean)) ? mean : Vec3{};
}

}  // namespace

template <class Sum>
std::vector<Sum> MeansOfCells<Sum>::Take() {
  for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] = MeanOf(sums_[i], volumes_[i]);
  return std::move(sums_);
}
template class MeansOfCells<double>;
template class MeansOfCells<Vec3>;

namespace {

AlignedVector<Vector3<float>> GradientsOf(const Mesh& mesh, const auto& values) {
  MeansOfCells<Vec3> means(0, PointNumber(mesh.points.size()));
  AddCellGradients(mesh, values, kOwnNumber, means);
  const std::vector<Vec3> gradients = means.Take();
  double longest = 0;
  for (const Vec3& gradient : gradients) longest = std::max(longest, Length(gradient));
  AlignedVector<Vector3<float>> shares(gradients.size());
  std::ranges::transform(gradients, shares.begin(), [&](const Vec3& gradient) { return ShareOf(gradient, longest); });
  return shares;
}

}  // namespace

void AddValues(const Mesh& part, std::span<const PointNumber> numbers, MeansOfCells<double>& values) {
  AddCellValues(
      part, [&](PointNumber point) { return numbers[point]; }, values);
}

void AddGradients(const Mesh& part, std::span<const PointNumber> numbers, std::span<const double> values, MeansOfCells<Vec3>& gradients) {
  AddCellGradients(
      part, values, [&](PointNumber point) { return numbers[point]; }, gradients);
}

AlignedVector<Vector3<float>> PointGradients(const Mesh& mesh) {
  if (mesh.at == ValuesAt::kPoints) return GradientsOf(mesh, mesh.values);
  MeansOfCells<double> values(0, PointNumber(mesh.points.size()));
  AddCellValues(mesh, kOwnNumber, values);
  return GradientsOf(mesh, values.Take());
}

}  // namespace slabstream
