// The box of a volume in its picture: against the camera that made the picture, and against rays through the box; and the axes that are
// drawn along it.
#include "client/pictures/volume_box.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "client/pictures/composed_picture.h"
#include "client/pictures/picture_labels.h"
#include "tests/common/view/random_view.h"

namespace slabstream {
namespace {

using testing::ElementsAre;

constexpr ImageSize kPane{400, 300};

// A box of 100 x 60 x 40 mm from (-20, 10, 5), seen along +y, with z upwards: 2 pixels a mm, its middle in the middle.
PictureGeometry FrontView() {
  PictureGeometry geometry;
  geometry.world = World::kScene;
  geometry.unit = LengthUnit::kMillimetre;
  geometry.target = {30, 40, 25};
  geometry.pixel_size = 0.5;
  geometry.box_corner = {-20, 10, 5};
  geometry.box_edges = {Vec3{100, 0, 0}, Vec3{0, 60, 0}, Vec3{0, 0, 40}};
  return geometry;
}

TEST(VolumeBoxTest, CornersLieWhereTheCameraProjectsThem) {
  Random random(301);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    const VolumeGeometry volume = RandomGeometry(random);
    const Camera camera = MakeCamera(RandomViewOf(volume, random), kPane, volume);
    const std::optional<VolumeBox> box = VolumeBox::Of(GeometryOf(camera, volume), kPane);
    ASSERT_TRUE(box);
    const Vec3 place = {double(random.Integer(0, 1)), random.Real(0, 1), random.Real(0, 1)};
    const Camera::ImagePoint expected = camera.Project(place * ToVec3(volume.size) - Vec3{0.5, 0.5, 0.5});
    const InkPoint found = box->At(place);
    EXPECT_NEAR(found.x, expected.x, 1e-6 * (1 + std::abs(expected.x)));
    EXPECT_NEAR(found.y, expected.y, 1e-6 * (1 + std::abs(expected.y)));
  }
}

TEST(VolumeBoxTest, ABoxThatIsNotKnownOrNotBeforeTheEyeIsNone) {
  EXPECT_FALSE(VolumeBox::Of({}, kPane));
  PictureGeometry geometry = FrontView();
  EXPECT_TRUE(VolumeBox::Of(geometry, kPane));
  geometry.projection = Projection::kPerspective;
  geometry.target_depth = 31;
  EXPECT_TRUE(VolumeBox::Of(geometry, kPane));
  geometry.target_depth = 29;  // less than half of its length
  EXPECT_FALSE(VolumeBox::Of(geometry, kPane));
}

// An edge is hidden if the line of sight to it leaves the box there; it is of the outline if that line touches the box there alone.
TEST(VolumeBoxTest, EdgesAreHiddenAsTheLineOfSightSays) {
  Random random(302);
  SCOPED_TRACE(random.trace());
  std::map<int, int> hidden_edges;
  for (int i = 0; i < 500; ++i) {
    const VolumeGeometry volume = RandomGeometry(random);
    const PictureGeometry geometry = GeometryOf(MakeCamera(RandomViewOf(volume, random), kPane, volume), volume);
    const VolumeBox box = VolumeBox::Of(geometry, kPane).value();
    const auto point_at = [&](const Vec3& place) {
      const auto& [x, y, z] = geometry.box_edges;
      return geometry.box_corner + place.x * x + place.y * y + place.z * z;
    };
    int hidden = 0;
    for (const VolumeBox::Edge& edge : box.Edges()) {
      Vec3 middle = edge.begin;
      middle[edge.axis] = 0.5;
      Vec3 to_viewer = -geometry.forward;
      if (geometry.projection == Projection::kPerspective) {
        to_viewer = geometry.target - geometry.target_depth * geometry.forward - point_at(middle);
      }
      // The line of sight in coordinates of the box, and whether a step along it leads inside.
      Vec3 step;
      for (const Axis axis : kAxes) {
        const Vec3& along = geometry.box_edges[std::size_t(Number(axis))];
        step[axis] = Dot(to_viewer, along) / Dot(along, along);
      }
      const auto leads_inside = [&](double sign) {
        return std::ranges::all_of(
            kAxes, [&](Axis axis) { return axis == edge.axis || (edge.begin[axis] == 0 ? sign * step[axis] > 0 : sign * step[axis] < 0); });
      };
      EXPECT_EQ(edge.hidden, leads_inside(1));
      EXPECT_EQ(edge.outline, !leads_inside(1) && !leads_inside(-1));
      hidden += edge.hidden ? 1 : 0;
    }
    ++hidden_edges[hidden];
  }
  // 3 meet in the farthest corner; in perspective, a view of two faces or one hides more.
  EXPECT_GT(hidden_edges[3], 300);
  for (const auto& [count, views] : hidden_edges) EXPECT_THAT(count, testing::AnyOf(3, 5, 8)) << views;
}

TEST(VolumeBoxTest, AViewAlongAnAxisHidesWhatLiesBehindTheFrontFace) {
  const VolumeBox box = VolumeBox::Of(FrontView(), kPane).value();
  for (const VolumeBox::Edge& edge : box.Edges()) {
    const bool front = edge.axis != Axis::kY && edge.begin.y == 0;
    EXPECT_EQ(edge.hidden, !front);
    EXPECT_EQ(edge.outline, front);
  }
  EXPECT_FALSE(box.LabelledEdge(Axis::kY));
  EXPECT_EQ(box.LabelledEdge(Axis::kX)->begin, (Vec3{0, 0, 0}));  // below
  EXPECT_EQ(box.LabelledEdge(Axis::kZ)->begin, (Vec3{0, 0, 0}));  // on the left
}

TEST(VolumeBoxTest, TheLabelledEdgeLiesBelowOrOnTheLeftAndShows) {
  const VolumeGeometry volume = {{100, 100, 100}};
  for (const double fov : {1.0, 30.0, 60.0}) {
    ViewParameters view{.projection = Projection::kPerspective, .azimuth_degrees = 45, .elevation_degrees = 35, .fov_degrees = fov};
    view.zoom = 0.5;
    const VolumeBox box = VolumeBox::Of(GeometryOf(MakeCamera(view, kPane, volume), volume), kPane).value();
    for (const Axis axis : {Axis::kX, Axis::kY}) {
      const Stroke line = box.LineOf(box.LabelledEdge(axis).value(), 0);
      EXPECT_GT(line.begin.y + line.end.y, kPane.height) << fov;
    }
    const Stroke line = box.LineOf(box.LabelledEdge(Axis::kZ).value(), 0);
    EXPECT_LT(line.begin.x + line.end.x, kPane.width) << fov;
  }
  PictureGeometry geometry = FrontView();
  geometry.target.z += 80;  // its lower edge lies below the picture
  EXPECT_EQ(VolumeBox::Of(geometry, kPane)->LabelledEdge(Axis::kX)->begin.z, 1);
}

TEST(VolumeBoxTest, AxesAlongTheWorldsHaveItsCoordinates) {
  PictureGeometry geometry = FrontView();
  VolumeBox box = VolumeBox::Of(geometry, kPane).value();
  EXPECT_THAT(box.ValuesOf(Axis::kX), ElementsAre(-20, 80));
  EXPECT_THAT(box.ValuesOf(Axis::kZ), ElementsAre(5, 45));
  EXPECT_EQ(box.NameOf(Axis::kZ), "z");
  geometry.world = World::kPatient;
  EXPECT_EQ(VolumeBox::Of(geometry, kPane)->NameOf(Axis::kX), "R");
  // A box that is turned about z: lengths along x and y, coordinates along z.
  geometry.box_edges = {Vec3{80, 60, 0}, Vec3{-36, 48, 0}, Vec3{0, 0, 40}};
  box = VolumeBox::Of(geometry, kPane).value();
  EXPECT_THAT(box.ValuesOf(Axis::kX), ElementsAre(0, 100));
  EXPECT_THAT(box.ValuesOf(Axis::kY), ElementsAre(0, 60));
  EXPECT_THAT(box.ValuesOf(Axis::kZ), ElementsAre(5, 45));
  EXPECT_EQ(box.NameOf(Axis::kX), "RA");
}

TEST(VolumeBoxTest, LinesAreClippedToThePicture) {
  Random random(303);
  SCOPED_TRACE(random.trace());
  constexpr PixelBounds kAround{-5, -5, 405, 305};
  const auto inside = [](InkPoint p) { return p.x >= -5 && p.y >= -5 && p.x <= 405 && p.y <= 305; };
  for (int i = 0; i < 500; ++i) {
    const auto point = [&] { return InkPoint{random.Real(-900, 1300), random.Chance(0.2) ? 100 : random.Real(-700, 900)}; };
    const Stroke line{point(), point(), 2};
    const std::optional<Stroke> clipped = Clipped(line, kAround);
    const auto at = [&](double t) { return InkPoint{std::lerp(line.begin.x, line.end.x, t), std::lerp(line.begin.y, line.end.y, t)}; };
    double first = 2, last = -1;
    for (double t = 0; t <= 1; t += 1e-4) {
      if (!inside(at(t))) continue;
      first = std::min(first, t);
      last = t;
    }
    if (last < 0) continue;  // it passes by, or touches a corner
    ASSERT_TRUE(clipped);
    EXPECT_NEAR(std::hypot(clipped->begin.x - at(first).x, clipped->begin.y - at(first).y), 0, 0.4);
    EXPECT_NEAR(std::hypot(clipped->end.x - at(last).x, clipped->end.y - at(last).y), 0, 0.4);
  }
  EXPECT_FALSE(Clipped({{-50, 10}, {-10, 200}, 1}, kAround));
  EXPECT_FALSE(Clipped({{-100, 0}, {0, -100}, 1}, kAround));
}

std::vector<Mark> MarksAlong(VolumeAxes axes, const PictureGeometry& geometry, ImageSize size = kPane, Annotations others = {}) {
  others.axes = axes;
  return MarksOf({.annotations = others}, size, {&geometry, 1}).value();
}

std::vector<TextLine> TextsIn(const std::vector<Mark>& marks) {
  std::vector<TextLine> texts;
  for (const Mark& mark : marks) {
    for (const auto& shape : mark.shapes) {
      if (const auto* text = std::get_if<TextLine>(&shape)) texts.push_back(*text);
    }
  }
  return texts;
}

TEST(VolumeAxesTest, NumbersStandWhereTheirCoordinatesAre) {
  int along_x = 0, along_z = 0;
  for (const TextLine& text : TextsIn(MarksAlong(VolumeAxes::kTicks, FrontView()))) {
    const double x = text.begin.x + 0.5 * text.width, y = text.begin.y - 0.365 * text.size;  // its middle
    if (text.text.find("mm") != std::string::npos) continue;
    const double value = std::stod(text.text);
    if (y > 190) {
      EXPECT_NEAR(x, 200 + 2 * (value - 30), 1) << text.text;
      ++along_x;
    } else {
      EXPECT_NEAR(y, 150 - 2 * (value - 25), 1) << text.text;
      EXPECT_LT(text.begin.x + text.width, 100) << "beside the box";
      ++along_z;
    }
  }
  EXPECT_GE(along_x, 3);
  EXPECT_GE(along_z, 3);
}

std::vector<std::string> NamesIn(const std::vector<Mark>& marks) {
  std::vector<std::string> names;
  for (const TextLine& text : TextsIn(marks)) {
    if (text.text.find_first_of("xyzRAS") != std::string::npos) names.push_back(text.text);
  }
  return names;
}

TEST(VolumeAxesTest, EachAxisHasItsNameAndUnit) {
  PictureGeometry geometry = FrontView();
  EXPECT_THAT(NamesIn(MarksAlong(VolumeAxes::kGrid, geometry)), ElementsAre("x (mm)", "z (mm)"));
  EXPECT_THAT(TextsIn(MarksAlong(VolumeAxes::kBox, geometry)), testing::IsEmpty());
  geometry.unit = LengthUnit::kFile;
  EXPECT_THAT(NamesIn(MarksAlong(VolumeAxes::kTicks, geometry)), ElementsAre("x", "z"));
  geometry.unit = LengthUnit::kVoxel;
  EXPECT_THAT(NamesIn(MarksAlong(VolumeAxes::kTicks, geometry, {400, 300})), ElementsAre("x (voxels)", "z (voxels)"));
  geometry.world = World::kPatient;
  geometry.unit = LengthUnit::kMillimetre;
  EXPECT_THAT(NamesIn(MarksAlong(VolumeAxes::kTicks, geometry)), ElementsAre("R (mm)", "S (mm)"));
}

TEST(VolumeAxesTest, TextsNeverOverlapAndLieWithinThePicture) {
  Random random(304);
  SCOPED_TRACE(random.trace());
  int texts_in_all = 0;
  for (int i = 0; i < 300; ++i) {
    const VolumeGeometry volume = RandomGeometry(random);
    const ImageSize size = {random.Integer(60, 1600), random.Integer(60, 1200)};
    ViewParameters view = RandomViewOf(volume, random);
    view.zoom = random.Real(0.5, 1);
    const PictureGeometry geometry = GeometryOf(MakeCamera(view, size, volume), volume);
    const Annotations others{.scale_bar = true, .orientation_marker = true, .title = "A title"};
    const std::vector<TextLine> texts = TextsIn(MarksAlong(VolumeAxes::kTicks, geometry, size, others));
    const std::size_t of_axes = texts.size() - TextsIn(MarksAlong(VolumeAxes::kOff, geometry, size, others)).size();
    const auto area = [](const TextLine& t) {
      return PixelBounds{int(t.begin.x), int(t.begin.y - 0.73 * t.size), int(t.begin.x + t.width), int(t.begin.y)};
    };
    for (std::size_t a = 0; a < of_axes; ++a) {  // which come first
      EXPECT_TRUE((PixelBounds{0, 0, size.width, size.height}.Contains(area(texts[a])))) << texts[a].text;
      for (std::size_t b = a + 1; b < texts.size(); ++b) {
        EXPECT_TRUE(Intersection(area(texts[a]), area(texts[b])).empty()) << texts[a].text << " and " << texts[b].text;
      }
      ++texts_in_all;
    }
  }
  EXPECT_GT(texts_in_all, 1500);
}

// What lies behind the volume shows where the picture lets something through, and nowhere else.
TEST(VolumeAxesTest, NothingBelowThePictureShowsOnOpaquePixels) {
  Random random(305);
  SCOPED_TRACE(random.trace());
  const VolumeGeometry volume = RandomGeometry(random);
  ViewParameters view{.azimuth_degrees = 30, .elevation_degrees = 20};
  const PictureGeometry geometry = GeometryOf(MakeCamera(view, kPane, volume), volume);
  LocalImage pixels = MakeLocalImage(PixelFormat::kRgba, {0, 0, kPane.width, kPane.height});
  for (std::size_t i = 0; i < pixels.rgba.size(); i += 4) {
    const float alpha = i / 4 % 3 == 0 ? 1.0F : i / 4 % 3 == 1 ? 0.5F : 0.0F;
    for (std::size_t c = 0; c < 3; ++c) pixels.rgba[i + c] = alpha * float(random.Real(0, 1));
    pixels.rgba[i + 3] = alpha;
  }
  const PictureImage image(pixels);
  const PictureFormat format{.background = {1, 1, 1, 1}, .annotations = {.axes = VolumeAxes::kGrid}};
  std::vector<Mark> marks = MarksOf(format, kPane, {&geometry, 1}).value();
  const ComposedPicture whole = ComposedPicture::Make(image, kPane, format, geometry).value();
  std::erase_if(marks, [](const Mark& mark) { return mark.under; });
  const ComposedPicture front = ComposedPicture::WithMarks(image, kPane, format.background, marks).value();
  std::vector<float> row(4 * kPane.width), without(row.size());
  int shown = 0;
  for (int y = 0; y < kPane.height; ++y) {
    whole.Row(y, row, {});
    front.Row(y, without, {});
    for (std::size_t x = 0; x < std::size_t(kPane.width); ++x) {
      const std::size_t at = std::size_t(y) * std::size_t(kPane.width) + x;
      const bool same = std::equal(&row[4 * x], &row[4 * x] + 4, &without[4 * x]);
      if (pixels.rgba[4 * at + 3] == 1) {
        ASSERT_TRUE(same) << x << " " << y;
      }
      shown += same ? 0 : 1;
    }
  }
  EXPECT_GT(shown, 500);
}

// Long lines are drawn row by row, and look like short ones.
TEST(VolumeAxesTest, LinesCoverWhatStrokesCover) {
  Random random(306);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const auto point = [&] { return InkPoint{random.Real(-20, 80), random.Real(-20, 60)}; };
    Stroke stroke{point(), point(), random.Real(0.5, 6)};
    if (i % 5 == 0) stroke.end.y = stroke.begin.y;
    if (i % 5 == 1) stroke.end.x = stroke.begin.x;
    if (i % 5 == 2) stroke.end = stroke.begin;
    const Ink ink = StrokeInk(stroke.begin, stroke.end, stroke.width);
    for (int y = 0; y < 40; ++y) {
      std::vector<float> row(60);
      CoverRow(stroke, y, row);
      for (int x = 0; x < 60; ++x) {
        const PixelBounds& b = ink.bounds;
        const bool within = x >= b.x_begin && x < b.x_end && y >= b.y_begin && y < b.y_end;
        const float expected = within ? ink.coverage[std::size_t(y - b.y_begin) * std::size_t(b.width()) + std::size_t(x - b.x_begin)] : 0;
        ASSERT_FLOAT_EQ(row[std::size_t(x)], expected) << x << " " << y;
      }
    }
  }
  std::vector<float> row(60);
  CoverRow({{-1e7, -1e7}, {1e7, 1e7}, 2}, 30, row);
  EXPECT_EQ(row[30], 1);
}

}  // namespace
}  // namespace slabstream
