#include "data/isosurface/surface_maker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/parallel/task_arena.h"
#include "tests/data/isosurface/surface.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

// The places where blocks begin along each axis, and the end.
using Cuts = std::array<std::vector<std::int32_t>, 3>;

Cuts WholeAsOneBlock(const Box& domain) {
  return {{{domain.begin.x, domain.end.x}, {domain.begin.y, domain.end.y}, {domain.begin.z, domain.end.z}}};
}
Cuts RandomCuts(Random& random, const Box& domain) {
  Cuts cuts;
  for (const Axis axis : kAxes) {
    for (std::int32_t at = domain.begin[axis]; at < domain.end[axis]; at += random.Integer(1, 6))
      cuts.at(std::size_t(Number(axis))).push_back(at);
    cuts.at(std::size_t(Number(axis))).push_back(domain.end[axis]);
  }
  return cuts;
}

struct Wanted {
  double isovalue = 0;
  bool caps = false;
};

SurfacePart Extract(const Volume& volume, const Wanted& wanted, const std::function<Cuts(const Box&)>& cut = WholeAsOneBlock) {
  SurfaceMaker maker(volume.description, wanted.isovalue, wanted.caps);
  const Cuts cuts = cut(maker.domain());
  SurfacePart all;
  for (std::size_t y = 0; y + 1 < cuts[1].size(); ++y) {
    for (std::size_t x = 0; x + 1 < cuts[0].size(); ++x) {
      for (std::size_t z = 0; z + 1 < cuts[2].size(); ++z) {
        const Box block = {{cuts[0][x], cuts[1][y], cuts[2][z]}, {cuts[0][x + 1], cuts[1][y + 1], cuts[2][z + 1]}};
        const Box samples = Grown(block, kSurfaceReach, volume.block.box);
        const Result<SurfacePart> part = maker.Add(CutBlock(volume.block, samples), block);
        EXPECT_TRUE(part.ok());
        all.vertices.insert(all.vertices.end(), part->vertices.begin(), part->vertices.end());
        all.triangles.insert(all.triangles.end(), part->triangles.begin(), part->triangles.end());
      }
    }
  }
  return all;
}

void ExpectSound(const SurfacePart& surface) {
  std::vector<int> used(surface.vertices.size());
  for (const SurfaceTriangle& triangle : surface.triangles) {
    for (const std::int32_t corner : triangle) {
      ASSERT_GE(corner, 0);
      ASSERT_LT(corner, std::int32_t(used.size()));
      ++used[std::size_t(corner)];
    }
  }
  EXPECT_EQ(std::ranges::count(used, 0), 0) << "vertices of no triangle";
  std::vector<std::array<float, 3>> positions;
  for (const SurfaceVertex& vertex : surface.vertices) {
    EXPECT_TRUE(std::isfinite(Length(Point(vertex.position))));
    EXPECT_NEAR(Length(Point(vertex.normal)), 1, 1e-5);
    positions.push_back(vertex.position);
  }
  std::ranges::sort(positions);
  EXPECT_EQ(std::ranges::adjacent_find(positions), positions.end()) << "two vertices at one place";
}

void ExpectClosed(const SurfacePart& surface) {
  const EdgeCounts edges = CountEdges(surface);
  EXPECT_EQ(edges.open, 0);
  EXPECT_EQ(edges.repeated, 0);
}

TEST(SurfaceMaker, EveryCellHasAClosedSurfaceWithCaps) {
  for (int inside = 1; inside < 256; ++inside) {
    const Volume volume =
        MakeTestVolume({2, 2, 2}, ScalarType::kUint8, [&](const Index3& v) { return inside >> (v.y + 2 * v.z + 4 * v.x) & 1; });
    const SurfacePart surface = Extract(volume, {0.5, true});
    ExpectClosed(surface);
    ExpectSound(surface);
    EXPECT_GT(Measure(surface).volume, 0) << inside;
  }
}

TEST(SurfaceMaker, RandomVolumesHaveNoHolesAndBlocksAndThreadsDoNotMatter) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 60; ++i) {
    const Index3 size = {random.Integer(1, 21), random.Integer(1, 12), random.Integer(1, 12)};
    const ScalarType type = kTypes[random.Integer(0, 2)];
    const int most = random.Chance(0.5) ? 3 : 200;  // few values: many samples lie at the isovalue
    const double share_of_nan = random.Chance(0.5) ? 0.1 : 0;
    const Volume volume = MakeTestVolume(size, type, [&](const Index3&) -> double {
      if (type == ScalarType::kFloat32 && random.Chance(share_of_nan))
        return random.Chance(0.5) ? kNaN : random.Chance(0.5) ? kInfinity : -kInfinity;
      return random.Integer(0, most);
    });
    const Wanted wanted = {random.Integer(0, 2 * most + 1) / 2.0, random.Chance(0.5)};
    const SurfacePart surface = Extract(volume, wanted);
    const EdgeCounts edges = CountEdges(surface);
    EXPECT_EQ(edges.repeated, 0);
    if (wanted.caps) {
      EXPECT_EQ(edges.open, 0);
      EXPECT_GE(Measure(surface).volume, 0);
    }
    if (CountIn(size) > 0 && Least(ToVec3(size)) > 1) ExpectSound(surface);
    for (const std::array<std::int32_t, 2>& edge : edges.open_edges) {
      const Vec3 a = Point(surface.vertices[std::size_t(edge[0])].position), b = Point(surface.vertices[std::size_t(edge[1])].position);
      bool on_border = false;
      for (const Axis axis : kAxes) on_border = on_border || (a[axis] == b[axis] && (a[axis] == 0 || a[axis] == size[axis] - 1));
      EXPECT_TRUE(on_border);
    }
    const SurfacePart in_blocks = Extract(volume, wanted, [&](const Box& domain) { return RandomCuts(random, domain); });
    EXPECT_EQ(Sorted(in_blocks), Sorted(surface));
    EXPECT_EQ(in_blocks.vertices.size(), surface.vertices.size());
    for (const int threads : {1, 3}) {
      TaskArena arena(threads);
      const SurfacePart same = arena.Run([&] { return Extract(volume, wanted); });
      EXPECT_EQ(same.vertices, surface.vertices);
      EXPECT_EQ(same.triangles, surface.triangles);
    }
  }
}

TEST(SurfaceMaker, MakersThatFollowEachOtherShareTheVerticesOfTheSliceBetweenThem) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 60; ++i) {
    const Index3 size = {random.Integer(1, 14), random.Integer(1, 12), random.Integer(2, 14)};
    const Volume volume = MakeTestVolume(size, ScalarType::kUint8, [&](const Index3&) { return random.Integer(0, 3); });
    const Wanted wanted = {random.Integer(0, 7) / 2.0, random.Chance(0.5)};
    const SurfacePart expected = Extract(volume, wanted);
    Cuts cuts;
    SurfacePart all;
    std::vector<std::int32_t> before;  // the last slice of the maker before, in `all`
    for (std::int32_t begin = 0; begin < size.z;) {
      SurfaceMaker maker(volume.description, wanted.isovalue, wanted.caps);
      const Box& domain = maker.domain();
      if (begin == 0) cuts = RandomCuts(random, domain);
      const std::int32_t end = std::min(begin + random.Integer(1, 6), size.z);
      std::vector<std::int32_t> slices = {begin == 0 ? domain.begin.z : begin, end == size.z ? domain.end.z : end};
      if (end - begin > 2) slices.insert(slices.begin() + 1, random.Integer(begin + 1, end - 1));
      const auto own = std::int32_t(all.vertices.size());
      for (std::size_t y = 0; y + 1 < cuts[1].size(); ++y) {
        for (std::size_t x = 0; x + 1 < cuts[0].size(); ++x) {
          const auto column = [&](std::int32_t from, std::int32_t to) {
            return Box{{cuts[0][x], cuts[1][y], from}, {cuts[0][x + 1], cuts[1][y + 1], to}};
          };
          const auto samples = [&](const Box& block) { return CutBlock(volume.block, Grown(block, kSurfaceReach, volume.block.box)); };
          if (begin > 0) maker.Follow(samples(column(begin - 1, begin)), column(begin - 1, begin));
          for (std::size_t z = 0; z + 1 < slices.size(); ++z) {
            const Box block = column(slices[z], slices[z + 1]);
            const Result<SurfacePart> part = maker.Add(samples(block), block);
            all.vertices.insert(all.vertices.end(), part->vertices.begin(), part->vertices.end());
            for (SurfaceTriangle triangle : part->triangles) {
              for (std::int32_t& corner : triangle)
                corner = corner >= 0 ? own + corner : before.at(std::size_t(std::int64_t{corner} - kOthersVertex));
              all.triangles.push_back(triangle);
            }
          }
        }
      }
      before = maker.LastSlice();
      for (std::int32_t& vertex : before) vertex += own;
      begin = end;
    }
    EXPECT_EQ(Sorted(all), Sorted(expected));
    EXPECT_EQ(all.vertices.size(), expected.vertices.size());
    if (wanted.caps) ExpectClosed(all);
  }
}

// Distances in the world from a point, less than `radius` inside.
template <class Distance>
Volume Sample(const VolumeGeometry& geometry, const Distance& distance) {
  return MakeVolume(geometry, ScalarType::kFloat32,
                    [&](const Index3& v) { return -distance(geometry.ToWorld(geometry.stretch.ToData(ToVec3(v)))); });
}

TEST(SurfaceMaker, AreaAndVolumeOfASphereConvergeWithOrderTwo) {
  constexpr double kRadius = 0.4, kArea = 4 * std::numbers::pi * kRadius * kRadius, kVolume = kArea * kRadius / 3;
  AreaAndVolume before;
  for (const int side : {12, 24, 48, 96}) {
    const double step = 1.0 / side;
    const VolumeGeometry geometry = {Uniform(side), {step, step, step}, {.origin = {0.013, 0.007, 0}}};
    const Vec3 centre = geometry.ToWorld(geometry.centre());
    const SurfacePart surface = Extract(Sample(geometry, [&](const Vec3& p) { return Length(p - centre); }), {-kRadius});
    ExpectClosed(surface);
    EXPECT_EQ(EulerCharacteristic(surface), 2);
    const AreaAndVolume found = Measure(surface), error = {std::abs(found.area - kArea), std::abs(found.volume - kVolume)};
    if (side > 12) {
      EXPECT_LT(error.area, before.area / 3.3) << side;
      EXPECT_LT(error.volume, before.volume / 3.3) << side;
    }
    before = error;
  }
  EXPECT_LT(before.area, kArea * 1e-3);
  EXPECT_LT(before.volume, kVolume * 1e-3);
}

TEST(SurfaceMaker, ATorusHasOneHandle) {
  const VolumeGeometry geometry = {{40, 41, 20}};
  const Vec3 centre = geometry.centre();
  const SurfacePart surface = Extract(Sample(geometry,
                                             [&](const Vec3& p) {
                                               const Vec3 d = p - centre;
                                               return std::hypot(std::hypot(d.x, d.y) - 12, d.z);
                                             }),
                                      {-5});
  ExpectClosed(surface);
  EXPECT_EQ(EulerCharacteristic(surface), 0);
}

TEST(SurfaceMaker, LiesInTheWorldWithNormalsTowardsLowerValues) {
  const double c = std::cos(0.4), s = std::sin(0.4);
  const Orientation turned = {World::kPatient, {-30, 100, 7}, {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}}};
  Stretch::Places places;
  for (int i = 0; i < 40; ++i) places[1].push_back(i + 0.3 * std::sin(i));
  for (const bool rectilinear : {false, true}) {
    VolumeGeometry geometry = {{50, 40, 24}, {0.5, 0.7, 1.25}, turned};
    if (rectilinear) geometry.stretch = Stretch::Make(places, geometry.size).value();
    const Vec3 centre = geometry.ToWorld(geometry.centre());
    constexpr double kRadius = 9;
    const SurfacePart surface = Extract(Sample(geometry, [&](const Vec3& p) { return Length(p - centre); }), {-kRadius});
    ExpectClosed(surface);
    ExpectSound(surface);
    EXPECT_NEAR(Measure(surface).volume, 4.0 / 3 * std::numbers::pi * kRadius * kRadius * kRadius, 30);
    for (const SurfaceVertex& vertex : surface.vertices) {
      const Vec3 outward = Point(vertex.position) - centre;
      EXPECT_NEAR(Length(outward), kRadius, 0.03);
      EXPECT_GT(Dot(Normalized(outward), Point(vertex.normal)), 0.99);
    }
  }
}

TEST(SurfaceMaker, CapsLieOnTheBorderOfTheVolume) {
  const Volume volume = MakeTestVolume({4, 5, 6}, ScalarType::kUint16, [](const Index3&) { return 9; });
  EXPECT_TRUE(Extract(volume, {9}).vertices.empty());
  const SurfacePart surface = Extract(volume, {9, true});
  ExpectClosed(surface);
  Vec3 least = {9, 9, 9}, most = {-9, -9, -9};
  for (const SurfaceVertex& vertex : surface.vertices) {
    for (const Axis axis : kAxes) {
      least[axis] = std::min<double>(least[axis], vertex.position.at(std::size_t(Number(axis))));
      most[axis] = std::max<double>(most[axis], vertex.position.at(std::size_t(Number(axis))));
    }
  }
  EXPECT_EQ(least, (Vec3{-0.5, -0.5, -0.5}));
  EXPECT_EQ(most, (Vec3{3.5, 4.5, 5.5}));
}

TEST(SurfaceMaker, ValuesMayFallWhereSamplesRise) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (const double scale : {-2.0, 0.5}) {
    const ValueMapping mapping = {scale, 100};
    Volume stored = MakeTestVolume({9, 8, 7}, ScalarType::kUint8, [&](const Index3&) { return random.Integer(0, 9); });
    const Volume values = MakeTestVolume(stored.description.geometry.size, ScalarType::kFloat32, [&](const Index3& v) {
      return mapping.FromStored(stored.block.samples<std::uint8_t>()[stored.block.Offset(v)]);
    });
    stored.description.mapping = mapping;
    const double isovalue = mapping.FromStored(random.Integer(1, 8));
    const SurfacePart a = Extract(stored, {isovalue}), b = Extract(values, {isovalue});
    ASSERT_EQ(a.triangles, b.triangles);
    for (std::size_t i = 0; i < a.vertices.size(); ++i) {
      EXPECT_LT(Length(Point(a.vertices[i].position) - Point(b.vertices[i].position)), 1e-6);
      EXPECT_LT(Length(Point(a.vertices[i].normal) - Point(b.vertices[i].normal)), 1e-5);
    }
  }
}

}  // namespace
}  // namespace slabstream
