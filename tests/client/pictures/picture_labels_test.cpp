// What annotations say, against the camera of the picture and against what radiologists expect.
#include "client/pictures/picture_labels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <ostream>
#include <set>

#include "common/view/named_view.h"
#include "tests/common/view/random_view.h"

namespace slabstream {
namespace {

constexpr ImageSize kShown{400, 300};

// A letter's side, as a direction of the world.
Vec3 SideOf(char letter) {
  switch (letter) {
    case 'R': return {1, 0, 0};
    case 'L': return {-1, 0, 0};
    case 'A': return {0, 1, 0};
    case 'P': return {0, -1, 0};
    case 'S': return {0, 0, 1};
    case 'I': return {0, 0, -1};
    default: ADD_FAILURE() << letter; return {};
  }
}

struct Edges {
  std::string left, right, top, bottom;
  friend bool operator==(const Edges&, const Edges&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Edges& e) {
    return out << e.left << " " << e.right << " " << e.top << " " << e.bottom;
  }
};

Edges EdgesOf(const PictureGeometry& g) { return {PatientSides(-g.right), PatientSides(g.right), PatientSides(g.up), PatientSides(-g.up)}; }

PictureGeometry LookAt(const ViewParameters& view, const Orientation& orientation = {.world = World::kPatient}) {
  const VolumeGeometry volume = {{60, 70, 50}, {1, 1, 2}, orientation};
  return GeometryOf(MakeCamera(view, kShown, volume), volume);
}

TEST(PictureLabels, NamedViewsHaveTheSidesThatRadiologistsExpect) {
  const std::map<std::string_view, Edges> expected = {{"anterior", {"R", "L", "S", "I"}}, {"posterior", {"L", "R", "S", "I"}},
                                                      {"superior", {"L", "R", "A", "P"}}, {"inferior", {"R", "L", "A", "P"}},
                                                      {"left", {"A", "P", "S", "I"}},     {"right", {"P", "A", "S", "I"}},
                                                      {"front", {"L", "R", "S", "I"}},    {"back", {"R", "L", "S", "I"}},
                                                      {"top", {"L", "R", "A", "P"}},      {"bottom", {"L", "R", "P", "A"}}};
  ASSERT_EQ(expected.size(), kNamedViews.size());
  for (const NamedView& named : kNamedViews) {
    for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
      ViewParameters view;
      view.projection = projection;
      view.azimuth_degrees = named.azimuth_degrees;
      view.elevation_degrees = named.elevation_degrees;
      EXPECT_EQ(EdgesOf(LookAt(view)), expected.at(named.name)) << named.name;
    }
  }
}

TEST(PictureLabels, RollTurnsTheSidesClockwise) {
  ViewParameters view;
  view.azimuth_degrees = 180;
  view.roll_degrees = 90;  // what was at the top is on the right
  EXPECT_EQ(EdgesOf(LookAt(view)), (Edges{"I", "S", "R", "L"}));
}

TEST(PictureLabels, ObliqueDirectionsHaveTheNearestSideFirst) {
  const auto towards = [](double azimuth, double elevation) {
    const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
    return PatientSides({std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)});
  };
  EXPECT_EQ(towards(0, 0), "R");
  EXPECT_EQ(towards(9, 0), "R") << "almost right";
  EXPECT_EQ(towards(11, 0), "RA");
  EXPECT_EQ(towards(45, 0), "RA") << "of equals the one of the lower axis";
  EXPECT_EQ(towards(46, 0), "AR");
  EXPECT_EQ(towards(-170, 0), "L");
  EXPECT_EQ(towards(-150, 0), "LP");
  EXPECT_EQ(towards(0, -60), "IR");
  EXPECT_EQ(towards(30, 30), "RSA");
}

// The picture itself says where a side lies: a step towards it moves the target's image.
TEST(PictureLabels, AStepToASideGoesToTheEdgeThatNamesIt) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 1000; ++i) {
    const VolumeGeometry volume = RandomGeometry(random);
    const ViewParameters view = RandomViewOf(volume, random);
    const Camera camera = MakeCamera(view, kShown, volume);
    const PictureGeometry geometry = GeometryOf(camera, volume);
    const auto shown = [&](const Vec3& step) {  // of the world, from the target; pixels to the right and upwards
      const Vec3 from = volume.orientation.FromWorld(geometry.target - volume.orientation.origin);
      const double small = 1e-3 * geometry.target_depth;
      const auto [x, y, depth] = camera.Project((from + volume.orientation.FromWorld(small * step)) / volume.spacing);
      return std::pair(x - 0.5 * kShown.width, 0.5 * kShown.height - y);
    };
    const Edges edges = EdgesOf(geometry);
    std::set<char> named;
    for (const char c : edges.right + edges.left + edges.top + edges.bottom) named.insert(c);
    for (const char c : edges.right) EXPECT_GT(shown(SideOf(c)).first, 0) << c;
    for (const char c : edges.left) EXPECT_LT(shown(SideOf(c)).first, 0) << c;
    for (const char c : edges.top) EXPECT_GT(shown(SideOf(c)).second, 0) << c;
    for (const char c : edges.bottom) EXPECT_LT(shown(SideOf(c)).second, 0) << c;
    // The first letter is the side that goes there most.
    for (const char c : std::string("RLAPSI")) {
      EXPECT_LE(shown(SideOf(c)).first, shown(SideOf(edges.right[0])).first * (1 + 1e-2) + 1e-9);
      EXPECT_LE(shown(SideOf(c)).second, shown(SideOf(edges.top[0])).second * (1 + 1e-2) + 1e-9);
    }
    EXPECT_GE(named.size(), 4U);
    EXPECT_EQ(edges.left.size(), edges.right.size());
    EXPECT_EQ(edges.top.size(), edges.bottom.size());

    // So do the arrows of the axes.
    for (const ShownAxis& axis : ShownAxes(geometry)) {
      Vec3 step;
      step[axis.axis] = 1;
      const double pixels = 1e-3 * geometry.target_depth / geometry.pixel_size;  // of a step across the line of sight
      EXPECT_NEAR(axis.x, shown(step).first / pixels, 5e-3);
      EXPECT_NEAR(-axis.y, shown(step).second / pixels, 5e-3);
    }
  }
}

TEST(PictureLabels, AxesComeFarthestFirst) {
  Random random(82);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    const VolumeGeometry volume = RandomGeometry(random, random.Chance(0.5) ? World::kPatient : World::kScene);
    const Camera camera = MakeCamera(RandomViewOf(volume, random), kShown, volume);
    const PictureGeometry geometry = GeometryOf(camera, volume);
    const std::array<ShownAxis, 3> axes = ShownAxes(geometry);
    EXPECT_GE(axes[0].depth, axes[1].depth);
    EXPECT_GE(axes[1].depth, axes[2].depth);
    double squares = 0;
    std::set<std::string_view> labels;
    for (const ShownAxis& axis : axes) {
      squares += axis.x * axis.x + axis.y * axis.y;
      EXPECT_NEAR(axis.x * axis.x + axis.y * axis.y + axis.depth * axis.depth, 1, 1e-9);
      Vec3 step;
      step[axis.axis] = 1;
      EXPECT_NEAR(axis.depth, Dot(camera.view_direction, volume.orientation.FromWorld(step)), 1e-9);
      labels.insert(axis.label);
    }
    EXPECT_NEAR(squares, 2, 1e-9);
    const bool patient = geometry.world == World::kPatient;
    EXPECT_EQ(labels, patient ? (std::set<std::string_view>{"A", "R", "S"}) : (std::set<std::string_view>{"x", "y", "z"}));
  }
}

TEST(PictureLabels, AScaleBarIsARoundFifthOfTheWidth) {
  Random random(83);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 2000; ++i) {
    PictureGeometry geometry;
    geometry.pixel_size = std::exp(random.Real(-30, 30));
    const int width = random.Integer(8, kMaxImageSide);
    const std::optional<ScaleBar> bar = ChooseScaleBar(geometry, width);
    ASSERT_TRUE(bar.has_value());
    const double power = std::pow(10, std::floor(std::log10(bar->length) + 1e-9)), digit = bar->length / power;
    EXPECT_TRUE(std::abs(digit - 1) < 1e-9 || std::abs(digit - 2) < 1e-9 || std::abs(digit - 5) < 1e-9) << bar->length;
    EXPECT_NEAR(bar->pixels * geometry.pixel_size, bar->length, 1e-9 * bar->length);
    EXPECT_LE(std::abs(std::log(bar->pixels / (0.2 * width))), std::log(std::sqrt(2.5)) + 1e-9);
  }
}

TEST(PictureLabels, AScaleBarNamesItsUnit) {
  const auto label = [](LengthUnit unit, double pixel_size, Projection projection = Projection::kOrthographic) {
    PictureGeometry geometry;
    geometry.unit = unit;
    geometry.pixel_size = pixel_size;
    geometry.projection = projection;
    return ChooseScaleBar(geometry, 500)->label;
  };
  EXPECT_EQ(label(LengthUnit::kMillimetre, 0.5), "50 mm");
  EXPECT_EQ(label(LengthUnit::kMillimetre, 0.5, Projection::kPerspective), "50 mm at target");
  EXPECT_EQ(label(LengthUnit::kMillimetre, 0.0003), "0.02 mm");
  EXPECT_EQ(label(LengthUnit::kMicrometre, 0.2), "20 \u00b5m");
  EXPECT_EQ(label(LengthUnit::kNanometre, 0.01), "1 nm");
  EXPECT_EQ(label(LengthUnit::kAngstrom, 2), "200 \u00c5");
  EXPECT_EQ(label(LengthUnit::kCentimetre, 0.01), "1 cm");
  EXPECT_EQ(label(LengthUnit::kMetre, 0.01, Projection::kPerspective), "1 m at target");
  EXPECT_EQ(label(LengthUnit::kFile, 2), "200 units");
  EXPECT_EQ(label(LengthUnit::kFile, 0.01), "1 unit");
  EXPECT_EQ(label(LengthUnit::kVoxel, 0.01), "1 voxel");
  EXPECT_EQ(label(LengthUnit::kVoxel, 0.1), "10 voxels");
}

TEST(PictureLabels, NoScaleBarWhereNoLengthCanBeStated) {
  for (const double pixel_size : {1e-310, 1e308}) {
    PictureGeometry geometry;
    geometry.pixel_size = pixel_size;
    EXPECT_FALSE(ChooseScaleBar(geometry, 500).has_value()) << pixel_size;
  }
}

}  // namespace
}  // namespace slabstream
