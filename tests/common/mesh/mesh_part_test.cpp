#include "common/mesh/mesh_part.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "common/mesh/lattice.h"
#include "common/mesh/point_gradients.h"
#include "tests/common/mesh/mesh_samples.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

Mesh SomeMesh(Random& random, const Index3& size) {
  Mesh mesh = MakeTetrahedralCube(size, random.Integer(1, 9), random, 0.2, [&](const Vec3&) { return random.Real(0, 1); });
  if (random.Chance(0.3)) mesh.values[0] = std::numeric_limits<float>::quiet_NaN();
  if (random.Chance(0.5)) mesh = WithCellValues(mesh, [](std::size_t cell) { return double(cell); });
  if (random.Chance(0.7)) {
    VolumeGeometry lattice;
    lattice.size = size;
    SortByPlace(lattice, mesh);
  }
  return mesh;
}

Box SomeBox(Random& random, const Index3& size) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.begin[axis] = random.Integer(0, size[axis] - 1);
    box.end[axis] = random.Integer(box.begin[axis] + 1, size[axis]);
  }
  return box;
}

// Bit for bit, since a value may be NaN.
bool Same(const Mesh& a, const Mesh& b) {
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  return a.points == b.points && a.tetrahedra == b.tetrahedra && a.at == b.at && std::ranges::equal(a.values, b.values, {}, bits, bits) &&
         a.gradients == b.gradients;
}

TEST(MeshCutter, CutsTheCellsThatTouchTheBoxInTheirOrder) {
  Random random(91);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 40; ++round) {
    const Index3 size = {random.Integer(1, 40), random.Integer(1, 40), random.Integer(1, 40)};
    const auto mesh = std::make_shared<const Mesh>(SomeMesh(random, size));
    const Box box = SomeBox(random, size);
    std::vector<std::size_t> touching;
    std::vector<bool> kept(mesh->points.size());
    for (std::size_t cell = 0; cell < mesh->tetrahedra.size(); ++cell) {
      const Tetrahedron& t = mesh->tetrahedra[cell];
      bool touches = true;
      for (int axis = 0; axis < 3; ++axis) {
        const auto along = [&](PointNumber point) { return mesh->points[point][axis]; };
        touches = touches && std::ranges::any_of(t, [&](PointNumber p) { return along(p) >= float(box.begin[axis]) - 0.5F; }) &&
                  std::ranges::any_of(t, [&](PointNumber p) { return along(p) <= float(box.end[axis]) - 0.5F; });
      }
      if (!touches) continue;
      touching.push_back(cell);
      for (const PointNumber point : t) kept[point] = true;
    }
    Mesh expected;
    expected.at = mesh->at;
    std::vector<PointNumber> numbers(kept.size());
    for (std::size_t point = 0; point < kept.size(); ++point) {
      if (!kept[point]) continue;
      numbers[point] = PointNumber(expected.points.size());
      expected.points.push_back(mesh->points[point]);
      if (mesh->at == ValuesAt::kPoints) expected.values.push_back(mesh->values[point]);
    }
    for (const std::size_t cell : touching) {
      const Tetrahedron& t = mesh->tetrahedra[cell];
      expected.tetrahedra.push_back({numbers[t[0]], numbers[t[1]], numbers[t[2]], numbers[t[3]]});
      if (mesh->at == ValuesAt::kCells) expected.values.push_back(mesh->values[cell]);
    }
    const AlignedVector<Vector3<float>> gradients = PointGradients(*mesh);
    for (std::size_t point = 0; point < kept.size(); ++point) {
      if (kept[point]) expected.gradients.push_back(gradients[point]);
    }
    EXPECT_TRUE(Same(MeshCutter(mesh).Cut(box), expected));
  }
}

TEST(MeshCutter, OfTheWholeLatticeTakesTheWholeMeshAndOfNothingNothing) {
  Random random(92);
  SCOPED_TRACE(random.trace());
  const Index3 size = {20, 30, 40};
  const auto mesh = std::make_shared<const Mesh>(SomeMesh(random, size));
  const MeshCutter cutter(mesh);
  Mesh lit = *mesh;
  lit.gradients = PointGradients(*mesh);
  EXPECT_TRUE(Same(cutter.Cut({{0, 0, 0}, size}), lit));
  EXPECT_TRUE(cutter.Cut({{5, 5, 5}, {5, 9, 9}}).tetrahedra.empty());
  EXPECT_GE(cutter.bytes(), mesh->bytes());
}

TEST(MeshBytes, BecomeTheSameMesh) {
  Random random(93);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 20; ++round) {
    const Index3 size = {random.Integer(1, 20), random.Integer(1, 20), random.Integer(1, 20)};
    Mesh mesh = round == 0 ? Mesh() : SomeMesh(random, size);
    if (round % 2 == 0) mesh.gradients = PointGradients(mesh);
    const Result<Mesh> decoded = DecodeMesh(EncodeMesh(mesh));
    ASSERT_TRUE(decoded.ok()) << decoded.status().message();
    EXPECT_TRUE(Same(*decoded, mesh));
  }
}

// The message with which bytes are refused.
std::string Refusal(const Mesh& mesh) {
  const Result<Mesh> decoded = DecodeMesh(EncodeMesh(mesh));
  EXPECT_EQ(decoded.status().code(), StatusCode::kDataLoss);
  return decoded.status().message();
}

TEST(MeshBytes, SayWhatIsWrongWithThem) {
  Mesh good;
  good.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  good.tetrahedra = {{0, 1, 2, 3}};
  good.values = {1, 2, 3, 4};
  Mesh mesh = good;
  mesh.points[2].y = std::numeric_limits<float>::infinity();
  EXPECT_EQ(Refusal(mesh), "mesh: point 2 is not finite");
  mesh = good;
  mesh.tetrahedra[0][1] = 4;
  EXPECT_EQ(Refusal(mesh), "mesh: tetrahedron 0 has point 4, must be below 4");
  mesh = good;
  mesh.tetrahedra[0][1] = 3;
  EXPECT_EQ(Refusal(mesh), "mesh: tetrahedron 0 has a point twice: 0, 3, 2, 3");
  std::vector<std::byte> bytes = EncodeMesh(good);
  bytes.pop_back();
  EXPECT_EQ(DecodeMesh(bytes).status().message(), "mesh: has 103 bytes, must have 104 for 4 points and 1 tetrahedra");
  bytes.resize(5);
  EXPECT_EQ(DecodeMesh(bytes).status().message(), "mesh: has 5 bytes, must have at least 24");
  bytes = EncodeMesh(good);
  bytes[7] = std::byte{1};
  EXPECT_THAT(DecodeMesh(bytes).status().message(), HasSubstr("points, must have at most 2147483648"));
  bytes = EncodeMesh(good);
  bytes[16] = std::byte{2};
  EXPECT_EQ(DecodeMesh(bytes).status().message(), "mesh: values are at 2, must be at 0 or 1");
  bytes = EncodeMesh(good);
  bytes[20] = std::byte{2};
  EXPECT_EQ(DecodeMesh(bytes).status().message(), "mesh: lit is 2, must be 0, or 1 if there are points");
  bytes[20] = std::byte{1};
  EXPECT_EQ(DecodeMesh(bytes).status().message(), "mesh: has 104 bytes, must have 152 for 4 points and 1 tetrahedra");
}

TEST(MeshBytes, ThatAreCutOffOrAlteredDoNoHarm) {
  Random random(94);
  SCOPED_TRACE(random.trace());
  Mesh mesh = MakeTetrahedralCube({4, 4, 4}, 2, random, 0.2, [](const Vec3& p) { return p.x; });
  mesh.gradients = PointGradients(mesh);
  const std::vector<std::byte> good = EncodeMesh(mesh);
  for (std::size_t length = 0; length < good.size(); ++length) EXPECT_FALSE(DecodeMesh(std::span(good).first(length)).ok());
  for (int i = 0; i < 5000; ++i) {
    std::vector<std::byte> bytes = good;
    for (int changes = random.Integer(1, 4); changes > 0; --changes) {
      // Every other one in the counts and the first points.
      const std::size_t end = random.Chance(0.5) ? 48 : bytes.size();
      bytes[random.Integer<std::size_t>(0, end - 1)] = std::byte(random.Integer(0, 255));
    }
    const Result<Mesh> decoded = DecodeMesh(bytes);
    if (!decoded.ok()) {
      EXPECT_EQ(decoded.status().code(), StatusCode::kDataLoss);
      continue;
    }
    for (const Tetrahedron& t : decoded->tetrahedra) {
      EXPECT_TRUE(std::ranges::all_of(t, [&](PointNumber point) { return point < decoded->points.size(); }));
    }
    EXPECT_EQ(EncodeMesh(*decoded), bytes);
  }
}

}  // namespace
}  // namespace slabstream
