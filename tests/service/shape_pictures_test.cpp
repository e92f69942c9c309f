// Shapes in pictures of the service: where rays meet them, what lies in front and behind, and that none of it depends on who draws what.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "client/embedded/embedded_service.h"
#include "data/catalogue/shape_data.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/service/pictures.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"
#include "tests/worker/shapes/shape_pictures.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::Plane;
using testing::SphereMesh;

constexpr int kSize = 48;  // voxels a side

std::shared_ptr<const Volume> Block(std::uint8_t value) {
  auto volume = std::make_shared<Volume>();
  volume->description.geometry.size = Uniform(kSize);
  volume->block = MakeVoxelBlock(volume->description.geometry.bounds(), ScalarType::kUint8);
  std::ranges::fill(volume->block.bytes, std::byte{value});
  return volume;
}

class ShapesInPictures : public ::testing::Test {
 protected:
  void Add(const std::string& name, const Shape& shape) {
    catalogue_[name] = DataSource([shape](const TellRead&) { return DataOfShape(shape); });
  }
  void Start(int workers) {
    EmbeddedOptions options;
    options.workers = workers;
    options.coordinator.catalogue = catalogue_;
    options.coordinator.catalogue["ball"] = [volume = volume_]() -> Result<std::shared_ptr<const Volume>> { return volume; };
    service_ = EmbeddedService::Start(context_, std::move(options)).value();
    client_.emplace(service_->Connect().value());
  }
  Picture Render(const FrameRequest& request) {
    Result<Picture> picture = client_->Render(request, seconds(60));
    CHECK(picture.ok()) << picture.status().message();
    return *std::move(picture);
  }
  // By who draws.
  LocalImage RenderBy(int workers, FrameRequest request, int groups) {
    Start(workers);
    request.policy.groups = groups;
    return *Render(request).image.floats();
  }

  Context context_;
  std::shared_ptr<const Volume> volume_ = Block(0);
  std::map<std::string, DataSource> catalogue_;
  std::unique_ptr<EmbeddedService> service_;
  std::optional<Client> client_;
};

// A block of one value: a voxel length of it takes `opacity` of the light, in its own colour.
FrameRequest RequestOf(const RendererKind* renderer, double opacity, double azimuth) {
  FrameRequest request = TestRequest(renderer, azimuth);
  request.transfer.choice = TransferFunction{.colors = {{0, {0, 0, 1}}, {255, {0, 0, 1}}}, .opacities = {{0, opacity}, {255, opacity}}};
  request.shading.model = ShadingModel::kNone;
  request.view.elevation_degrees = 0;
  request.termination = 0;
  return request;
}

std::vector<const RendererKind*> Blending() { return {FindRenderer("splat"), FindRenderer("raycast")}; }

// The plane y = kSize / 2 - 0.5 halves the block.
Shape Middle() { return Plane({23.5, 23.5, 23.5}, {200, 0, 0}, {0, 0, 200}, 3); }

TEST_F(ShapesInPictures, FogHidesAnOpaquePlaneByWhatLiesInFront) {
  Add("plane", Middle());
  volume_ = Block(100);
  for (const RendererKind* renderer : Blending()) {
    for (const double azimuth : {0.0, 25.0}) {
      FrameRequest request = RequestOf(renderer, 0.05, azimuth);
      request.shapes = {{.shape = "plane", .color = Rgb{1, 0, 0}}};
      for (const int workers : {1, 3, 8}) {
        SCOPED_TRACE(::testing::Message() << renderer->name() << ", azimuth " << azimuth << ", " << workers << " workers");
        const LocalImage image = RenderBy(workers, request, 2);
        const PixelValue middle = PixelAt(image, 48, 40);
        const double through = std::pow(0.95, 24 / std::cos(azimuth * std::numbers::pi / 180));
        EXPECT_NEAR(middle.rgba[0], through, 0.01);
        EXPECT_NEAR(middle.rgba[2], 1 - through, 0.01);
        EXPECT_NEAR(middle.rgba[3], 1, 1e-5);
      }
    }
  }
}

TEST_F(ShapesInPictures, ATranslucentPlaneTakesItsShareAmongTheSamples) {
  Add("plane", Middle());
  volume_ = Block(100);
  for (const RendererKind* renderer : Blending()) {
    FrameRequest request = RequestOf(renderer, 0.02, 0);
    request.shapes = {{.shape = "plane", .color = Rgb{1, 0, 0}, .opacity = 0.25}};
    for (const int workers : {1, 3, 8}) {
      SCOPED_TRACE(::testing::Message() << renderer->name() << ", " << workers << " workers");
      const PixelValue middle = PixelAt(RenderBy(workers, request, 1), 48, 40);
      const double half = std::pow(0.98, 24);
      EXPECT_NEAR(middle.rgba[0], half * 0.25, 0.005);
      EXPECT_NEAR(middle.rgba[3], 1 - half * 0.75 * half, 0.005);
      EXPECT_NEAR(middle.rgba[2], 1 - half + half * 0.75 * (1 - half), 0.005);
    }
  }
}

// In front of the volume and behind it, where no box has samples.
TEST_F(ShapesInPictures, ShapesOutsideTheVolumeLieInFrontAndBehind) {
  Add("front", Plane({23.5, -10, 23.5}, {200, 0, 0}, {0, 0, 200}, 1));
  Add("behind", Plane({23.5, 70, 23.5}, {200, 0, 0}, {0, 0, 200}, 1));
  volume_ = Block(100);
  for (const RendererKind* renderer : Blending()) {
    FrameRequest request = RequestOf(renderer, 0.02, 0);
    request.shapes = {{.shape = "behind", .color = Rgb{0, 1, 0}, .opacity = 0.5},
                      {.shape = "front", .color = Rgb{1, 0, 0}, .opacity = 0.5}};
    const PixelValue middle = PixelAt(RenderBy(3, request, 2), 48, 40);
    const double through = std::pow(0.98, kSize);
    EXPECT_NEAR(middle.rgba[0], 0.5, 1e-5) << renderer->name();
    EXPECT_NEAR(middle.rgba[2], 0.5 * (1 - through), 0.01) << renderer->name();
    EXPECT_NEAR(middle.rgba[1], 0.5 * through * 0.5, 0.01) << renderer->name();
    request.shapes[1].opacity = 1;
    EXPECT_THAT(PixelAt(RenderBy(3, request, 2), 48, 40).rgba, ::testing::ElementsAre(1, 0, 0, 1)) << renderer->name();
  }
}

// All renderers of voxels, both projections, boxes of any number: a mesh, tubes and balls, some of them translucent.
TEST_F(ShapesInPictures, PicturesDoNotDependOnWhoDrawsWhat) {
  volume_ = TestSphere(kSize);
  Add("mesh", SphereMesh({30, 20, 24}, 14, 24));
  Shape lines{.kind = ShapeKind::kLines, .positions = {{0, 0, 0}, {50, 45, 40}, {20, 60, 20}}, .line_begins = {0, 3}};
  Add("lines", lines);
  Add("points", Shape{.kind = ShapeKind::kPoints, .positions = {{24, 24, 24}, {10, 30, 20}, {60, 24, 24}}, .radii = {6, 3, 8}});
  for (const RendererKind* renderer : Renderers()) {
    if (!renderer->Can(Ability::kShapes) || renderer->Can(Ability::kCells)) continue;
    for (const Projection projection : renderer->projections()) {
      FrameRequest request = TestRequest(renderer, 37);
      request.view.projection = projection;
      request.shapes = {{.shape = "mesh", .color = Rgb{1, 0.5F, 0.5F}, .opacity = 0.6},
                        {.shape = "lines", .color = Rgb{1, 1, 0}, .width = 3, .width_in_pixels = true},
                        {.shape = "points"}};
      const LocalImage alone = RenderBy(1, request, 1);
      request.shapes.clear();
      EXPECT_GT(LargestDifference(alone, RenderBy(1, request, 1), request.size), 0.1F) << "no shape shows";
      request.shapes = {{.shape = "mesh", .color = Rgb{1, 0.5F, 0.5F}, .opacity = 0.6},
                        {.shape = "lines", .color = Rgb{1, 1, 0}, .width = 3, .width_in_pixels = true},
                        {.shape = "points"}};
      for (const int workers : {2, 3, 8}) {
        SCOPED_TRACE(::testing::Message() << renderer->name() << ", " << NameOf(projection) << ", " << workers << " workers");
        EXPECT_LE(LargestDifference(alone, RenderBy(workers, request, workers), request.size), AllowedDifference(request));
      }
    }
  }
}

// Without a volume in front, opaque shapes have the same bits.
TEST_F(ShapesInPictures, OpaqueShapesAreTheSameToTheLastBit) {
  Add("mesh", SphereMesh({30, 20, 24}, 14, 24));
  Add("points", Shape{.kind = ShapeKind::kPoints, .positions = {{24, 24, 24}, {10, 30, 20}}, .radii = {6, 3}});
  FrameRequest request = RequestOf(FindRenderer("raycast"), 0, 40);
  request.shapes = {{.shape = "mesh", .color = Rgb{1, 0, 0}}, {.shape = "points"}};
  const LocalImage alone = RenderBy(1, request, 1);
  std::swap(request.shapes[0], request.shapes[1]);
  for (const int workers : {1, 3, 8}) EXPECT_EQ(LargestDifference(alone, RenderBy(workers, request, 2), request.size), 0) << workers;
  request.renderer = "zbuffer";
  EXPECT_EQ(LargestDifference(RenderBy(1, request, 1), RenderBy(5, request, 3), request.size), 0);
}

// A plane between the light, which is above, and a faint block: its upper half is bright and its lower one dark, whoever draws it.
TEST_F(ShapesInPictures, APlaneDarkensTheBlockBehindIt) {
  Add("plane", Plane({23.5, 23.5, 23.5}, {60, 0, 0}, {0, 60, 0}, 3));
  volume_ = Block(100);
  for (const RendererKind* renderer : Blending()) {
    FrameRequest request = RequestOf(renderer, 0.002, 0);
    request.shading.shadows = 1;
    request.shading.lights = {{0, 0, 1}};
    const LocalImage bare = RenderBy(1, request, 1);
    for (const double opacity : {1.0, 0.5}) {
      request.shapes = {{.shape = "plane", .color = Rgb{1, 0, 0}, .opacity = opacity}};
      const LocalImage alone = RenderBy(1, request, 1);
      const auto blue = [](const LocalImage& image, int y) { return double(PixelAt(image, 48, y).rgba[2]); };
      EXPECT_NEAR(blue(alone, 32) / blue(bare, 32), 1, 0.02) << renderer->name();
      EXPECT_NEAR(blue(alone, 48) / blue(bare, 48), 1 - opacity, 0.05) << renderer->name();
      for (const int workers : {3, 8}) {
        SCOPED_TRACE(::testing::Message() << renderer->name() << ", " << workers << " workers");
        EXPECT_LE(LargestDifference(alone, RenderBy(workers, request, workers), request.size), AllowedDifference(request));
      }
    }
  }
}

// A plane that lies exactly where two boxes meet belongs to one of them.
TEST_F(ShapesInPictures, APlaneOnTheBorderOfBoxesShowsOnce) {
  volume_ = Block(100);
  for (const double y : {11.5, 23.5, 31.5}) {
    Add("plane", Plane({23.5, y, 23.5}, {200, 0, 0}, {0, 0, 200}, 1));
    for (const RendererKind* renderer : Blending()) {
      FrameRequest request = RequestOf(renderer, 0.001, 0);
      request.shapes = {{.shape = "plane", .color = Rgb{1, 0, 0}, .opacity = 0.5}};
      request.policy.axis = AxisChoice::kY;
      for (const int workers : {2, 3, 4, 6, 8}) {
        EXPECT_NEAR(PixelAt(RenderBy(workers, request, workers), 48, 40).rgba[0], 0.5, 0.03) << y << renderer->name() << workers;
      }
    }
  }
}

// A ramp along x: 5 x. Slices of it are the same as a mesh whose vertices have these values.
TEST_F(ShapesInPictures, PlanesShowTheVolume) {
  auto volume = std::make_shared<Volume>(*Block(0));
  for (std::size_t i = 0; i < volume->block.bytes.size(); ++i) volume->block.samples<std::uint8_t>()[i] = std::uint8_t(5 * (i % kSize));
  volume_ = volume;
  struct Case {
    ClipSlab slab;
    Vec3 u, v;  // sides of the same plane
  };
  const double side = kSize;
  const std::vector<Case> cases = {{{.normal = {0, 1, 0}}, {side, 0, 0}, {0, 0, side}},
                                   {{.normal = {0, -1, 0}, .index = 30}, {side, 0, 0}, {0, 0, side}},
                                   {{.normal = {1, 1, 0}, .through = Vec3{23.5, 23.5, 3}}, {side, -side, 0}, {0, 0, side}}};
  for (const Case& plane : cases) {
    const double middle = plane.slab.index.value_or(0) > 0 ? 30 : 23.5;
    Shape mesh = Plane({23.5, middle, 23.5}, plane.u, plane.v, 1);
    for (const auto& p : mesh.positions) mesh.values.push_back(float(5 * (mesh.origin.x + double(p[0]))));
    Add("mesh", mesh);
    for (const RendererKind* renderer : {FindRenderer("raycast"), FindRenderer("zbuffer"), FindRenderer("splat")}) {
      for (const double opacity : {1.0, 0.5}) {
        FrameRequest request = RequestOf(renderer, opacity == 1 ? 0 : 0.01, 20);
        request.shapes = {{.shape = "mesh", .opacity = opacity, .map = "grey", .range = ScalarRange{0, 240}}};
        const LocalImage expected = RenderBy(1, request, 1);
        request.shapes = {};
        request.planes = {{.slab = plane.slab, .opacity = opacity, .range = ScalarRange{0, 240}}};
        for (const int workers : {1, 3, 8}) {
          // Values beyond the outermost centres are not those of the ramp: half a voxel, 2.5 of 240.
          EXPECT_LE(LargestDifference(expected, RenderBy(workers, request, 2), request.size), 0.015)
              << renderer->name() << ", plane " << &plane - cases.data() << ", " << workers << " workers";
        }
      }
    }
  }
}

// Shadows and lights leave planes as they are, and nothing lies in their shadow.
TEST_F(ShapesInPictures, PlanesAreUnlit) {
  volume_ = TestSphere(kSize);
  FrameRequest request = RequestOf(FindRenderer("raycast"), 0.02, 20);
  request.planes = {{.slab = {.normal = {0, 1, 0}}}};
  request.transfer.choice = std::string("none");
  const LocalImage plain = RenderBy(1, request, 1);
  request.shading.model = ShadingModel::kPhong;
  request.shading.lights = {{1, 0, 0}};
  EXPECT_EQ(LargestDifference(plain, RenderBy(1, request, 1), request.size), 0);
  request = RequestOf(FindRenderer("raycast"), 0.02, 0);
  request.shading.shadows = 1;
  request.shading.lights = {{0, 0, 1}};
  const PixelValue bare = PixelAt(RenderBy(1, request, 1), 48, 60);
  request.planes = {{.slab = {.normal = {0, 0, 1}}}};
  EXPECT_THAT(PixelAt(RenderBy(3, request, 1), 48, 60).rgba, ::testing::Pointwise(::testing::FloatNear(1e-5), bare.rgba));
}

TEST_F(ShapesInPictures, WrongPlanesAreRefusedByName) {
  Start(1);
  const auto refused = [&](const PlaneChoice& plane) {
    FrameRequest request = TestRequest(FindRenderer("raycast"), 0);
    request.planes = {plane};
    return client_->Render(request, seconds(60)).status().message();
  };
  EXPECT_THAT(refused({.slab = {.index = kSize}}), HasSubstr("plane.index is 48, but the volume has slices 0 to 47 along z"));
  EXPECT_THAT(refused({.slab = {.normal = {}}}), HasSubstr("planes[0].slab.normal"));
  EXPECT_THAT(refused({.slab = {.thickness = 2}}), HasSubstr("planes[0].slab.thickness is 2"));
  EXPECT_THAT(refused({.map = "gray"}), HasSubstr("a plane has map 'gray', but must have one of"));
  EXPECT_THAT(refused({.range = ScalarRange{3, 3}}), HasSubstr("planes[0].range is 3 to 3, but must rise"));
  FrameRequest request = TestRequest(FindRenderer("raycast"), 0);
  request.planes.resize(kMaxPlanes + 1);
  EXPECT_THAT(client_->Render(request, seconds(60)).status().message(), HasSubstr("planes"));
}

// A square from x = `low` to `high`, before the eye.
std::string Square(int low, int high) { return fmt::format("v {0} 0 0\nv {1} 0 0\nv {1} 0 47\nv {0} 0 47\nf 1 2 3 4\n", low, high); }

// Files are times: those of the picture, or one that the picture names.
TEST_F(ShapesInPictures, ShapesHaveTimes) {
  const TemporaryDirectory folder;
  WriteFile(folder / "surf_2.obj", Square(0, 23));
  WriteFile(folder / "surf_10.obj", Square(24, 47));
  catalogue_["surf"] = DataSource(folder / "surf_*.obj", "");
  for (const int time : {0, 1}) {
    WriteFile(folder / fmt::format("cell_{}.nrrd", time),
              NrrdHeader({.size = {kSize, kSize, kSize}}, "raw") + FileBytes(kSize * kSize * kSize, 0));
  }
  catalogue_["cell"] = DataSource(folder / "cell_*.nrrd", "");
  Start(2);
  FrameRequest request = RequestOf(FindRenderer("raycast"), 0, 0);
  request.shapes = {{.shape = "surf"}};
  const auto shown = [&] {
    const LocalImage image = *Render(request).image.floats();
    return std::pair(PixelAt(image, 38, 48).rgba[3] > 0, PixelAt(image, 58, 48).rgba[3] > 0);
  };
  EXPECT_EQ(shown(), std::pair(true, false)) << "a dataset of one time shows the first one";
  request.shapes[0].time = 1;
  EXPECT_EQ(shown(), std::pair(false, true));
  request.shapes[0].time = 2;
  EXPECT_THAT(client_->Render(request, seconds(60)).status().message(), HasSubstr("shape 'surf' has time 2, must be in [0, 1]"));
  request.dataset = "cell";
  request.shapes[0].time = {};
  request.time = "1";
  EXPECT_EQ(shown(), std::pair(false, true));
  request.time = "0";
  EXPECT_EQ(shown(), std::pair(true, false));
  WriteFile(folder / "surf_11.obj", Square(0, 47));
  EXPECT_THAT(client_->Render(request, seconds(60)).status().message(), HasSubstr("shape 'surf' has 3 times, must have one or 2"));
  request.shapes[0].time = 2;
  EXPECT_EQ(shown(), std::pair(true, true));
}

TEST_F(ShapesInPictures, WrongShapesAreRefusedByName) {
  Add("mesh", SphereMesh({30, 20, 24}, 14, 24));
  Start(1);
  const auto refused = [&](const FrameRequest& request) { return client_->Render(request, seconds(60)).status().message(); };
  FrameRequest request = TestRequest(FindRenderer("raycast"), 0);
  request.shapes = {{.shape = "ball"}};
  EXPECT_THAT(refused(request), HasSubstr("shape 'ball' is a volume, but must be a mesh, lines or points"));
  request.shapes = {{.shape = "bell"}};
  EXPECT_THAT(refused(request), HasSubstr("bell"));
  request.shapes = {{.shape = "mesh", .map = "plasma"}};
  EXPECT_THAT(refused(request), HasSubstr("its vertices have no values"));
  request.shapes = {};
  request.dataset = "mesh";
  EXPECT_THAT(refused(request), HasSubstr("dataset \"mesh\" is a shape (mesh), which shows beside a volume"));
  request.dataset = "ball";
  request.shapes = {{.shape = "mesh", .opacity = 0}};
  EXPECT_THAT(refused(request), HasSubstr("shapes[0].opacity is 0, but must lie in (0, 1]"));
}

// Somebody leaves while the picture is made.
TEST_F(ShapesInPictures, AWorkerThatLeavesSpoilsNothing) {
  volume_ = TestSphere(kSize);
  Add("mesh", SphereMesh({30, 20, 24}, 14, 64));
  FrameRequest request = TestRequest(FindRenderer("raycast"), 37, 4);
  request.shapes = {{.shape = "mesh", .opacity = 0.5}};
  request.size = {512, 512};
  const LocalImage alone = RenderBy(1, request, 1);
  Start(3);
  Result<Picture> picture = Status::Cancelled("not asked");
  {
    const std::jthread asks([&] { picture = client_->Render(request, seconds(60)); });
    service_->worker(1).RequestStop();
  }
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_LE(LargestDifference(alone, picture->image, request.size), AllowedDifference(request));
}

}  // namespace
}  // namespace slabstream
