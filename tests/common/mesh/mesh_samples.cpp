#include "tests/common/mesh/mesh_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/mesh/lattice.h"

namespace slabstream {
namespace {

using Corners = std::array<PointNumber, 8>;  // of a hexahedron, in VTK's order

void Split(int vtk_type, const std::vector<PointNumber>& points, Mesh& mesh) {
  SplitCell(*FindCellKind(vtk_type), points, mesh.tetrahedra);
}

// Points are numbered by x, then y, then z, so a pair of wedges cuts the faces of the hexahedron from the corners 0 and 4, like its
// neighbours.
void AddWedges(const Corners& c, Mesh& mesh) {
  Split(13, {c[0], c[1], c[2], c[4], c[5], c[6]}, mesh);
  Split(13, {c[0], c[2], c[3], c[4], c[6], c[7]}, mesh);
}

void AddPyramids(const Corners& c, Mesh& mesh) {
  const auto centre = PointNumber(mesh.points.size());
  Vector3<float> sum;
  for (const PointNumber corner : c) sum = sum + mesh.points[corner];
  mesh.points.push_back(sum / 8.0F);
  for (const auto& face : FindCellKind(12)->faces) Split(14, {c[face[0]], c[face[1]], c[face[2]], c[face[3]], centre}, mesh);
}

float StoredSample(const VoxelBlock& block, const Index3& voxel) {
  return VisitScalarType(block.type,
                         [&](auto* tag) { return float(block.samples<std::remove_cvref_t<decltype(*tag)>>()[block.Offset(voxel)]); });
}

}  // namespace

Mesh MakeTetrahedralCube(const Index3& size, int cells_per_side, Random& random, double jitter,
                         const std::function<double(const Vec3&)>& value) {
  Mesh mesh;
  const int points = cells_per_side + 1;
  const auto number = [&](int x, int y, int z) { return PointNumber((z * points + y) * points + x); };
  for (int z = 0; z < points; ++z) {
    for (int y = 0; y < points; ++y) {
      for (int x = 0; x < points; ++x) {
        const auto along = [&](int i, std::int32_t side) {
          const bool inside = i > 0 && i < cells_per_side;
          return float((i + (inside ? random.Real(-jitter, jitter) : 0)) * side / cells_per_side - 0.5);
        };
        mesh.points.push_back({along(x, size.x), along(y, size.y), along(z, size.z)});
      }
    }
  }
  for (int z = 0; z < cells_per_side; ++z) {
    for (int y = 0; y < cells_per_side; ++y) {
      for (int x = 0; x < cells_per_side; ++x) {
        const Corners c = {number(x, y, z),     number(x + 1, y, z),     number(x + 1, y + 1, z),     number(x, y + 1, z),
                           number(x, y, z + 1), number(x + 1, y, z + 1), number(x + 1, y + 1, z + 1), number(x, y + 1, z + 1)};
        switch (random.Integer(0, 3)) {
          case 0: Split(11, {c[0], c[1], c[3], c[2], c[4], c[5], c[7], c[6]}, mesh); break;
          case 1: AddWedges(c, mesh); break;
          case 2: AddPyramids(c, mesh); break;
          default: Split(12, {c.begin(), c.end()}, mesh);
        }
      }
    }
  }
  for (PointNumber point = 0; point < mesh.points.size(); ++point) mesh.values.push_back(float(value(PlaceOfPoint(mesh, point))));
  return mesh;
}

Mesh WithCellValues(Mesh mesh, const std::function<double(std::size_t)>& value) {
  mesh.at = ValuesAt::kCells;
  mesh.values.clear();
  for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) mesh.values.push_back(float(value(cell)));
  return mesh;
}

Mesh GridOf(const Volume& volume, std::int32_t step) {
  const Index3 size = volume.description.geometry.size;
  std::array<std::vector<double>, 3> places;  // of points, by axis
  for (const Axis axis : kAxes) {
    std::vector<double>& along = places[std::size_t(Number(axis))];
    along.push_back(-0.5);
    for (std::int32_t i = 0; i < size[axis]; i += step) along.push_back(i);
    along.push_back(size[axis] - 0.5);
  }
  Mesh mesh;
  const auto number = [&](std::size_t x, std::size_t y, std::size_t z) {
    return PointNumber((z * places[1].size() + y) * places[0].size() + x);
  };
  for (std::size_t z = 0; z < places[2].size(); ++z) {
    for (std::size_t y = 0; y < places[1].size(); ++y) {
      for (std::size_t x = 0; x < places[0].size(); ++x) {
        const Vec3 at = {places[0][x], places[1][y], places[2][z]};
        mesh.points.push_back({float(at.x), float(at.y), float(at.z)});
        Index3 voxel;
        for (const Axis axis : kAxes) voxel[axis] = std::clamp(std::int32_t(std::lround(at[axis])), 0, size[axis] - 1);
        mesh.values.push_back(StoredSample(volume.block, voxel));
        if (x == 0 || y == 0 || z == 0) continue;
        const Corners c = {number(x - 1, y - 1, z - 1), number(x, y - 1, z - 1), number(x, y, z - 1), number(x - 1, y, z - 1),
                           number(x - 1, y - 1, z),     number(x, y - 1, z),     number(x, y, z),     number(x - 1, y, z)};
        Split(12, {c.begin(), c.end()}, mesh);
      }
    }
  }
  return mesh;
}

Volume AsGrid(const Volume& volume, std::int32_t step) {
  const auto cells = std::make_shared<const Mesh>(GridOf(volume, step));
  Volume grid = Resample(*cells, volume.description.geometry);
  grid.cells = cells;
  return grid;
}

Vec3 PlaceOfPoint(const Mesh& mesh, PointNumber point) {
  const Vector3<float>& p = mesh.points[point];
  return {double(p.x), double(p.y), double(p.z)};
}

}  // namespace slabstream
