// Shapes in pictures of rectilinear and unstructured grids, and of shears: planned, drawn and finished by a service.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "client/embedded/embedded_service.h"
#include "data/catalogue/shape_data.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/service/pictures.h"
#include "tests/worker/shapes/shape_pictures.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::Plane;
using testing::SphereMesh;

constexpr int kSize = 48;  // voxels a side

// Where the voxels of an axis lie: steps grow by `growth` from each one to the next.
std::vector<double> GrowingPlaces(int size, double growth) {
  std::vector<double> ends = {0};
  for (int i = 0; i <= size; ++i) ends.push_back(ends.back() + std::pow(growth, i));
  std::vector<double> places;
  for (int i = 1; i <= size; ++i) places.push_back(ends[std::size_t(i)] / ends.back() * size - 0.5);
  return places;
}

Volume Block(bool rectilinear) {
  Volume volume;
  volume.description.geometry.size = Uniform(kSize);
  if (rectilinear) {  // the 24 first voxels along y take a tenth of the length
    const std::vector<double> places = GrowingPlaces(kSize, 1.1);
    volume.description.geometry.stretch = Stretch::Make({{{}, places, places}}, Uniform(kSize)).value();
  }
  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), ScalarType::kUint8);
  std::ranges::fill(volume.block.bytes, std::byte{100});
  return volume;
}

struct Drawn {
  const char* renderer;
  Volume volume;
};
// A block as each renderer draws it.
std::vector<Drawn> Blocks() { return {{"raycast", Block(true)}, {"shear", Block(false)}, {"slice", AsGrid(Block(false), 4)}}; }

class ShapeRenderers : public ::testing::Test {
 protected:
  void Add(const std::string& name, const Shape& shape) {
    catalogue_[name] = DataSource([shape](const TellRead&) { return DataOfShape(shape); });
  }
  Result<Picture> Ask(const Volume& volume, int workers, const FrameRequest& request) {
    EmbeddedOptions options;
    options.workers = workers;
    options.coordinator.catalogue = catalogue_;
    const auto shared = std::make_shared<const Volume>(volume);
    options.coordinator.catalogue["ball"] = [shared]() -> Result<std::shared_ptr<const Volume>> { return shared; };
    const std::unique_ptr<EmbeddedService> service = EmbeddedService::Start(context_, std::move(options)).value();
    return service->Connect().value().Render(request, seconds(60));
  }
  LocalImage Render(const Volume& volume, int workers, const FrameRequest& request) {
    const Result<Picture> picture = Ask(volume, workers, request);
    CHECK(picture.ok()) << picture.status().message();
    return *picture->image.floats();
  }

  Context context_;
  std::map<std::string, DataSource> catalogue_;
};

// A block of one value: a voxel length of it takes `opacity` of the light, in its own colour.
FrameRequest RequestOf(const char* renderer, double opacity) {
  FrameRequest request = TestRequest(FindRenderer(renderer), 0);
  request.transfer.choice = TransferFunction{.colors = {{0, {0, 0, 1}}, {255, {0, 0, 1}}}, .opacities = {{0, opacity}, {255, opacity}}};
  request.shading.model = ShadingModel::kNone;
  request.view.elevation_degrees = 0;
  request.termination = 0;
  return request;
}

// The middle of a rectilinear grid is not that of its voxels: what lies in front of a plane there has the length of the world.
TEST_F(ShapeRenderers, PlanesInABlockHaveHalfOfItInFront) {
  Add("plane", Plane({23.5, 23.5, 23.5}, {200, 0, 0}, {0, 0, 200}, 3));
  for (const auto& [renderer, volume] : Blocks()) {
    FrameRequest request = RequestOf(renderer, 0.02);
    for (const double azimuth : {0.0, 25.0, 180.0}) {
      request.view.azimuth_degrees = azimuth;
      const double half = std::pow(0.98, 24 / std::abs(std::cos(azimuth * std::numbers::pi / 180)));
      for (const int workers : {1, 3, 8}) {
        SCOPED_TRACE(::testing::Message() << renderer << ", azimuth " << azimuth << ", " << workers << " workers");
        request.shapes = {{.shape = "plane", .color = Rgb{1, 0, 0}}};
        const PixelValue opaque = PixelAt(Render(volume, workers, request), 48, 40);
        EXPECT_NEAR(opaque.rgba[0], half, 0.005);
        EXPECT_NEAR(opaque.rgba[2], 1 - half, 0.005);
        EXPECT_NEAR(opaque.rgba[3], 1, 1e-5);
        request.shapes.front().opacity = 0.25;
        const PixelValue translucent = PixelAt(Render(volume, workers, request), 48, 40);
        EXPECT_NEAR(translucent.rgba[0], half * 0.25, 0.005);
        EXPECT_NEAR(translucent.rgba[2], 1 - half + half * 0.75 * (1 - half), 0.005);
        EXPECT_NEAR(translucent.rgba[3], 1 - half * 0.75 * half, 0.005);
      }
    }
  }
}

// Boxes that show nothing of the volume have workers where shapes are, which a rectilinear grid's voxels do not say.
TEST_F(ShapeRenderers, ShapesInATransparentVolumeShowAsOften) {
  for (const double y : {1.0, 11.0, 24.0, 40.0}) {
    Add("plane", Plane({23.5, y, 23.5}, {60, 0, 0}, {0, 10, 60}, 1));
    for (const auto& [renderer, volume] : Blocks()) {
      FrameRequest request = RequestOf(renderer, 0);
      request.shapes = {{.shape = "plane", .color = Rgb{1, 0, 0}, .opacity = 0.25}};
      for (const AxisChoice axis : {AxisChoice::kX, AxisChoice::kY, AxisChoice::kZ}) {
        request.policy.axis = axis;
        const LocalImage image = Render(volume, 8, request);
        for (int row = 32; row < 48; ++row) {
          for (int column = 40; column < 56; ++column) {
            ASSERT_NEAR(PixelAt(image, column, row).rgba[0], 0.25, 1e-5) << renderer << ", y " << y << ", pixel " << column << ' ' << row;
          }
        }
      }
    }
  }
}

TEST_F(ShapeRenderers, PicturesDoNotDependOnWhoDrawsWhat) {
  Add("mesh", SphereMesh({30, 20, 24}, 14, 24));
  Add("lines", Shape{.kind = ShapeKind::kLines, .positions = {{0, 0, 0}, {50, 45, 40}, {20, 60, 20}}, .line_begins = {0, 3}});
  Add("points", Shape{.kind = ShapeKind::kPoints, .positions = {{24, 24, 24}, {10, 30, 20}, {60, 24, 24}}, .radii = {6, 3, 8}});
  for (const auto& [renderer, block] : Blocks()) {
    Volume volume = block;
    volume.block.bytes = TestSphere(kSize)->block.bytes;
    if (volume.cells != nullptr) volume = AsGrid(*TestSphere(kSize));
    FrameRequest request = TestRequest(FindRenderer(renderer), 37);
    request.shapes = {{.shape = "mesh", .color = Rgb{1, 0.5F, 0.5F}, .opacity = 0.6},
                      {.shape = "lines", .color = Rgb{1, 1, 0}, .width = 3, .width_in_pixels = true},
                      {.shape = "points"}};
    const LocalImage alone = Render(volume, 1, request);
    for (const int workers : {3, 8}) {
      request.policy.groups = workers;
      EXPECT_LE(LargestDifference(alone, Render(volume, workers, request), request.size), AllowedDifference(request))
          << renderer << ", " << workers << " workers";
    }
  }
}

// A picture that fits is as wide as the shapes beside an invisible volume, wherever these lie.
TEST_F(ShapeRenderers, APictureFramesTheShapesOfARectilinearGrid) {
  for (const Vec3 centre : {Vec3{24, 24, 4}, Vec3{24, 24, 40}, Vec3{24, 24, 100}}) {
    Add("mesh", SphereMesh(centre, 8, 24));
    FrameRequest request = RequestOf("raycast", 0);
    request.view.fit = true;
    request.shapes = {{.shape = "mesh", .color = Rgb{1, 0, 0}}};
    const LocalImage image = Render(Block(true), 2, request);
    PixelBounds shown;
    for (int y = 0; y < request.size.height; ++y) {
      for (int x = 0; x < request.size.width; ++x) {
        if (PixelAt(image, x, y).rgba[3] > 0.5F) shown = Union(shown, {x, y, x + 1, y + 1});
      }
    }
    EXPECT_NEAR(shown.x_begin + shown.x_end, request.size.width, 8) << centre.z;
    EXPECT_NEAR(shown.y_begin + shown.y_end, request.size.height, 8) << centre.z;
    EXPECT_GT(shown.height(), request.size.height / 3) << centre.z;
  }
}

// Cells are drawn as cells beside shapes, too.
TEST_F(ShapeRenderers, UnstructuredGridsWithShapesAreSliced) {
  Add("mesh", SphereMesh({30, 20, 24}, 14, 24));
  FrameRequest request = RequestOf("slice", 0.02);
  request.shapes = {{.shape = "mesh", .color = Rgb{1, 0, 0}}};
  const Volume grid = AsGrid(Block(false), 4);
  const LocalImage sliced = Render(grid, 1, request);
  request.renderer = "auto";
  EXPECT_EQ(LargestDifference(sliced, Render(grid, 1, request), request.size), 0);
}

}  // namespace
}  // namespace slabstream
