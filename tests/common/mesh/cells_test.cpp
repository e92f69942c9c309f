// Cells are split into tetrahedra that fill them, and neighbours cut the face between them alike.
#include "common/mesh/cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "common/math/vec.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

// Corners of a cell of side 1 of each kind, in VTK's order, and its volume.
struct Example {
  int vtk_type;
  std::vector<Vec3> corners;
  double volume;
};
const std::vector<Example>& Examples() {
  static const std::vector<Example> examples = {
      {10, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 1.0 / 6},
      {11, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}}, 1},
      {12, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}, 1},
      {13, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, 0.5},
      {14, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}}, 1.0 / 3}};
  return examples;
}

double VolumeOf(const Tetrahedron& t, const std::map<PointNumber, Vec3>& places) {
  const Vec3 a = places.at(t[0]);
  return std::abs(Dot(places.at(t[1]) - a, Cross(places.at(t[2]) - a, places.at(t[3]) - a))) / 6;
}

std::vector<PointNumber> Shuffled(Random& random, std::size_t count) {
  std::vector<PointNumber> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0U);
  for (std::size_t i = count; i > 1; --i) std::swap(numbers[i - 1], numbers[random.Integer<std::size_t>(0, i - 1)]);
  return numbers;
}

using Triangle = std::set<PointNumber>;
// The triangles of tetrahedra whose points all are among `face`.
std::set<Triangle> TrianglesIn(const std::vector<Tetrahedron>& tetrahedra, const std::set<PointNumber>& face) {
  std::set<Triangle> triangles;
  for (const Tetrahedron& t : tetrahedra) {
    for (std::size_t leave_out = 0; leave_out < 4; ++leave_out) {
      Triangle triangle(t.begin(), t.end());
      triangle.erase(t[leave_out]);
      if (std::ranges::includes(face, triangle)) triangles.insert(triangle);
    }
  }
  return triangles;
}

TEST(Cells, AreFilledByTheirTetrahedraHoweverTheirPointsAreNumbered) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (const Example& example : Examples()) {
    const CellKind& kind = *FindCellKind(example.vtk_type);
    SCOPED_TRACE(kind.name);
    ASSERT_EQ(std::size_t(kind.points), example.corners.size());
    for (int round = 0; round < 200; ++round) {
      const std::vector<PointNumber> numbers = Shuffled(random, example.corners.size());
      std::map<PointNumber, Vec3> places;
      for (std::size_t i = 0; i < numbers.size(); ++i) places[numbers[i]] = example.corners[i];
      std::vector<Tetrahedron> tetrahedra;
      SplitCell(kind, numbers, tetrahedra);
      double volume = 0;
      for (const Tetrahedron& t : tetrahedra) {
        EXPECT_GT(VolumeOf(t, places), 1e-9);
        volume += VolumeOf(t, places);
      }
      // Each part has a volume and all of them that of the cell: they cannot overlap, since all have the same point.
      EXPECT_NEAR(volume, example.volume, 1e-12);
    }
  }
}

// Two cells of any kinds that share a face: each is put on it with the points of the face numbered alike.
TEST(Cells, CutTheFaceBetweenThemAlike) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 2000; ++round) {
    const Example& a = Examples()[random.Integer<std::size_t>(0, Examples().size() - 1)];
    const Example& b = Examples()[random.Integer<std::size_t>(0, Examples().size() - 1)];
    const CellKind &kind_a = *FindCellKind(a.vtk_type), &kind_b = *FindCellKind(b.vtk_type);
    const auto& face_a = kind_a.faces[random.Integer<std::size_t>(0, kind_a.faces.size() - 1)];
    const auto& face_b = kind_b.faces[random.Integer<std::size_t>(0, kind_b.faces.size() - 1)];
    if (face_a.size() != face_b.size()) continue;
    SCOPED_TRACE(std::string(kind_a.name) + " and " + std::string(kind_b.name));
    const std::vector<PointNumber> numbers = Shuffled(random, 16);
    std::vector<PointNumber> points_a(numbers.begin(), numbers.begin() + kind_a.points);
    std::vector<PointNumber> points_b(numbers.begin() + kind_a.points, numbers.begin() + kind_a.points + kind_b.points);
    // The neighbour may begin the face at another point, and goes round it either way.
    const std::size_t turn = random.Integer<std::size_t>(0, face_a.size() - 1);
    const bool backwards = random.Chance(0.5);
    std::set<PointNumber> face;
    for (std::size_t i = 0; i < face_a.size(); ++i) {
      const std::size_t j = (turn + (backwards ? face_a.size() - i : i)) % face_a.size();
      points_b[face_b[j]] = points_a[face_a[i]];
      face.insert(points_a[face_a[i]]);
    }
    std::vector<Tetrahedron> parts_a, parts_b;
    SplitCell(kind_a, points_a, parts_a);
    SplitCell(kind_b, points_b, parts_b);
    EXPECT_EQ(TrianglesIn(parts_a, face).size(), face.size() - 2);
    EXPECT_EQ(TrianglesIn(parts_a, face), TrianglesIn(parts_b, face));
  }
}

TEST(Cells, WithoutAVolumeMakeNothing) {
  for (const CellKind& kind : CellKinds()) {
    std::vector<PointNumber> points(std::size_t(kind.points));
    std::iota(points.begin(), points.end(), 0U);
    std::vector<Tetrahedron> parts;
    SplitCell(kind, points, parts);
    EXPECT_EQ(parts.empty(), kind.vtk_type < 10) << kind.name;
  }
}

}  // namespace
}  // namespace slabstream
