// Along the curve of Morton (1966, "A computer oriented geodetic data base and a new technique in file sequencing").

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/mesh/lattice.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

static_assert(kMaxLatticeSide <= 1024, "a place along an axis takes ten bits");
static_assert(kMaxTetrahedra <= std::int64_t{1} << 32, "the number of a tetrahedron takes 32 bits");

// Two zeros behind each of ten bits.
constexpr std::uint32_t Spread(std::uint32_t bits) {
  bits = (bits | bits << 16) & 0x030000FF;
  bits = (bits | bits << 8) & 0x0300F00F;
  bits = (bits | bits << 4) & 0x030C30C3;
  return (bits | bits << 2) & 0x09249249;
}

// Where along the curve the voxel of a tetrahedron's centre lies.
std::uint32_t PlaceOf(const Mesh& mesh, const Tetrahedron& t, const Index3& size) {
  std::uint32_t place = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double centre = 0;
    for (const PointNumber point : t) centre += 0.25 * double(mesh.points[point][axis]);
    place |= Spread(std::uint32_t(std::clamp(std::round(centre), 0.0, size[axis] - 1.0))) << axis;
  }
  return place;
}

// Numbers points by where they first occur, and drops those of no tetrahedron.
void RenumberPoints(Mesh& mesh) {
  constexpr PointNumber kNone = ~PointNumber{0};
  std::vector<PointNumber> renumbered(mesh.points.size(), kNone);
  AlignedVector<Vector3<float>> points;
  AlignedVector<float> values;
  points.reserve(mesh.points.size());
  if (mesh.at == ValuesAt::kPoints) values.reserve(mesh.points.size());
  for (Tetrahedron& t : mesh.tetrahedra) {
    for (PointNumber& point : t) {
      PointNumber& number = renumbered[point];
      if (number == kNone) {
        number = PointNumber(points.size());
        points.push_back(mesh.points[point]);
        if (mesh.at == ValuesAt::kPoints) values.push_back(mesh.values[point]);
      }
      point = number;
    }
  }
  mesh.points = std::move(points);
  if (mesh.at == ValuesAt::kPoints) mesh.values = std::move(values);
}

}  // namespace

std::vector<std::uint32_t> PlacesOf(const Mesh& mesh, const VolumeGeometry& lattice) {
  CHECK(std::max({lattice.size.x, lattice.size.y, lattice.size.z}) <= kMaxLatticeSide);
  std::vector<std::uint32_t> places(mesh.tetrahedra.size());
  ParallelFor(0, places.size(), [&](std::size_t cell) { places[cell] = PlaceOf(mesh, mesh.tetrahedra[cell], lattice.size); });
  return places;
}

void SortByPlace(const VolumeGeometry& lattice, Mesh& mesh) {
  CHECK(std::max({lattice.size.x, lattice.size.y, lattice.size.z}) <= kMaxLatticeSide);
  const std::size_t count = mesh.tetrahedra.size();
  // The number decides between those in one voxel, so that the order is one for any number of threads.
  std::vector<std::uint64_t> order(count);
  ParallelFor(0, count,
              [&](std::size_t cell) { order[cell] = std::uint64_t{PlaceOf(mesh, mesh.tetrahedra[cell], lattice.size)} << 32 | cell; });
  ParallelSort(order);
  const auto in_order = [&](const auto& unsorted) {
    auto sorted = unsorted;
    ParallelFor(0, count, [&](std::size_t i) { sorted[i] = unsorted[order[i] & 0xFFFFFFFF]; });
    return sorted;
  };
  mesh.tetrahedra = in_order(mesh.tetrahedra);
  if (mesh.at == ValuesAt::kCells) mesh.values = in_order(mesh.values);
  RenumberPoints(mesh);
}

}  // namespace slabstream
