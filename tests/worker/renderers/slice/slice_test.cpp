// Slicing of unstructured grids as a renderer: analytic truth, cells that fit together, any boxes, and ray casting beside it.
#include <gtest/gtest.h>

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "common/mesh/point_gradients.h"
#include "common/view/phong.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/renderers.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/rays/pixel_ray.h"
#include "tests/worker/renderers/render_support.h"
#include "worker/rays/ray_look.h"
#include "worker/renderers/slice/cell_bins.h"
#include "worker/renderers/slice/frame_space.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr unsigned kSeed = 71;

using Field = std::function<double(const Vec3&)>;

// MakeTetrahedralCube, with values where the points or the cells' middles are.
std::shared_ptr<const Mesh> MakeCube(const Index3& size, int side, double jitter, const Field& value, std::mt19937& random,
                                     ValuesAt at = ValuesAt::kPoints) {
  Random cells(random());
  Mesh mesh = MakeTetrahedralCube(size, side, cells, jitter, value);
  if (at == ValuesAt::kPoints) return std::make_shared<const Mesh>(std::move(mesh));
  const auto middle = [&](std::size_t cell) {
    Vec3 sum;
    for (const PointNumber point : mesh.tetrahedra[cell]) sum = sum + PlaceOfPoint(mesh, point);
    return value(0.25 * sum);
  };
  return std::make_shared<const Mesh>(WithCellValues(mesh, middle));
}

// The volume of a grid. Its voxels matter to the range of values alone.
Volume GridVolume(const Index3& size, std::shared_ptr<const Mesh> cells, double greatest, const Vec3& spacing = {1, 1, 1}) {
  Volume volume = MakeVolume({size, spacing}, ScalarType::kFloat32, [&](const Index3& v) { return v == Index3{0, 0, 0} ? 0 : greatest; });
  volume.cells = std::move(cells);
  return volume;
}

FrameSetup SliceSetup(const Volume& volume, SetupOptions options, double planes_per_voxel = 1) {
  options.renderer = FindRenderer("slice");
  FrameSetup setup = MakeSetup(volume, options);
  setup.parameters = {planes_per_voxel};
  return setup;
}

TEST(Slice, HomogeneousCubeLooksTheSameFromEverySide) {
  std::mt19937 random(kSeed);
  for (const Projection projection : kProjections) {
    for (const Vec3 spacing : {Vec3{1, 1, 1}, Vec3{1, 1.5, 0.7}}) {
      for (const double rate : {1.0, 0.5, 2.0}) {
        SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " rate " << rate << ' ' << NameOf(projection));
        const Field field = [](const Vec3&) { return 100; };
        const Volume grid = GridVolume({26, 20, 24}, MakeCube({26, 20, 24}, 7, 0.2, field, random), 100, spacing);
        std::vector<ViewParameters> views = RandomViews(projection, 6, random);
        for (const double azimuth : {0, 90}) views.push_back({.projection = projection, .azimuth_degrees = azimuth});
        const auto setup = [&](const SetupOptions& options, int) { return SliceSetup(grid, options, rate); };
        // Rays shorter than 1.1 times the distance of planes along them may pass between planes.
        const auto length = [&](const FrameSetup& of, int x, int y) {
          const double inside = LengthInside(of, x, y);
          const double step = (projection == Projection::kPerspective ? Length(of.camera.RayAt(x, y).direction * spacing) : 1) / rate;
          return inside < 1.1 * step * Least(spacing) ? 0 : inside;
        };
        ExpectOpacityOfLength(grid, views, {.setup = setup, .length = length});
      }
    }
  }
}

// The definition (docs/rendering.md), sample by sample: the cell that holds the sample's position, wherever it is in the list.
std::array<double, 4> ReferencePixel(const Mesh& mesh, const AlignedVector<Vector3<float>>& gradients, const FrameSetup& setup,
                                     const RayLook& look, const ViewRays& rays, int x, int y) {
  const Phong phong(setup.shading, setup.camera.view_direction);
  const PixelRay ray = RayOf(rays, x, y);
  const auto at = [&](double k) {
    return Vec3{double(ray.first[0]) + k * double(ray.move[0]), double(ray.first[1]) + k * double(ray.move[1]),
                double(ray.first[2]) + k * double(ray.move[2])};
  };
  double enter = -1e300, leave = 1e300;  // in numbers of planes
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    const double a = (-0.5 - double(ray.first[i])) / double(ray.move[i]);
    const double b = (setup.description.geometry.size[axis] - 0.5 - double(ray.first[i])) / double(ray.move[i]);
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  const double first = std::ceil(enter), last = std::floor(leave);
  const Camera::Ray central = setup.camera.RayAt(x + 0.5, y + 0.5);
  const double slant = setup.camera.projection == Projection::kPerspective ? Length(central.direction * setup.camera.spacing) : 1;
  std::array<double, 4> sum{};
  for (double k = first; k <= last; ++k) {
    const Vec3 p = at(k);
    double inside = -1e300, value = 0;  // the least barycentric coordinate, in the cell where that is the greatest
    Vec3 gradient;
    for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
      std::array<Vec3, 4> corner;
      for (std::size_t c = 0; c < 4; ++c) {
        const Vector3<float>& q = mesh.points[mesh.tetrahedra[i][c]];
        corner[c] = {double(q.x), double(q.y), double(q.z)};
      }
      const Vec3 a = corner[1] - corner[0], b = corner[2] - corner[0], c = corner[3] - corner[0], d = p - corner[0];
      const double volume = Dot(a, Cross(b, c));
      const double u = Dot(d, Cross(b, c)) / volume, v = Dot(a, Cross(d, c)) / volume, w = Dot(a, Cross(b, d)) / volume;
      const double weights[4] = {1 - u - v - w, u, v, w}, least = *std::ranges::min_element(weights);
      if (!(least > inside)) continue;
      inside = least;
      value = 0;
      for (std::size_t n = 0; n < 4; ++n)
        value += weights[n] * double(mesh.values[mesh.at == ValuesAt::kCells ? i : mesh.tetrahedra[i][n]]);
      gradient = {};
      for (std::size_t n = 0; n < 4; ++n) {
        const Vector3<float>& g = gradients[mesh.tetrahedra[i][n]];
        gradient = gradient + weights[n] * Vec3{double(g.x), double(g.y), double(g.z)};
      }
    }
    if (inside < -1e-6) continue;
    const auto entry =
        std::size_t(std::clamp((value - double(look.origin)) * double(look.scale) + double(look.rounding), 0.0, double(look.last)));
    double length = slant;
    if (k == first) length += slant * std::clamp(first - enter - 0.5, -0.5, 0.5);
    if (k == last) length += slant * std::clamp(leave - last - 0.5, -0.5, 0.5);
    const double alpha = 1 - std::pow(1 - double(look.entries[4 * entry + 3]), length);
    const PhongFactors light = phong.AtNormal(Normalized(gradient / setup.camera.spacing));
    for (std::size_t c = 0; c < 3; ++c) {
      const double color = double(look.entries[4 * entry + c]) * double(light.diffuse) + double(light.specular);
      sum[c] += (1 - sum[3]) * alpha * std::clamp(color, 0.0, 1.0);
    }
    sum[3] += (1 - sum[3]) * alpha;
  }
  return sum;
}

TEST(Slice, AgreesWithTheDefinition) {
  std::mt19937 random(kSeed);
  const Index3 size = {18, 14, 16};
  for (const ValuesAt at : {ValuesAt::kPoints, ValuesAt::kCells}) {
    const Field field = [](const Vec3& p) { return 100 + 99 * std::sin(p.x + 2 * p.y - 0.7 * p.z); };
    const Volume grid = GridVolume(size, MakeCube(size, 4, 0.2, field, random, at), 200, {1, 1.3, 0.8});
    for (const Projection projection : kProjections) {
      for (int i = 0; i < 3; ++i) {
        SetupOptions options;
        options.view = RandomView(projection, random);
        options.view.zoom = 1.5;
        options.size = {90, 60};
        options.transfer = Ramp(0.3);
        if (i == 0) options.shading.model = ShadingModel::kNone;
        if (i == 2) options.shading.lights = {{1, 0.5, 0.25}, {-1, 2, 0}};
        const double rate = std::array{1.0, 0.5, 2.0}[std::size_t(i)];
        const FrameSetup setup = SliceSetup(grid, options, rate);
        const LocalImage image = RenderWhole(grid, setup);
        const RayLook look = MakeRayLook(Classify(setup.transfer, setup.description, setup.range), setup.transfer, setup.description,
                                         setup.camera, setup.shading, rate);
        const slice::FrameSpace space(setup.camera, setup.description.geometry, rate, {});
        const AlignedVector<Vector3<float>> gradients = PointGradients(*grid.cells);
        int different = 0, pixels = 0;
        for (int y = 1; y < setup.camera.height; y += 3) {
          for (int x = 1; x < setup.camera.width; x += 3) {
            if (LengthInside(setup, x, y) < 1e-3) continue;
            ++pixels;
            const std::array<double, 4> expected = ReferencePixel(*grid.cells, gradients, setup, look, space.rays(), x, y);
            const auto found = PixelOf(image, x, y);
            bool same = true;
            for (std::size_t c = 0; c < 4; ++c) same = same && std::abs(double(found[c]) - expected[c]) < 2e-4;
            different += same ? 0 : 1;
          }
        }
        // Samples that lie within rounding of a border, of a face between values of cells, or of two entries.
        EXPECT_LE(different, pixels / 100) << "seed " << kSeed << " view " << i << ' ' << NameOf(projection) << ' ' << NameOf(at) << " of "
                                           << pixels;
        EXPECT_GT(pixels, 200);
      }
    }
  }
}

// The integral of emission and extinction along a ray, cell by cell, without planes, tables or shared faces.
std::array<double, 4> IntegralAlongRay(const Mesh& mesh, const FrameSetup& setup, int x, int y) {
  const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
  const Vec3& spacing = setup.description.geometry.spacing;
  const double voxels = Length(ray.direction * spacing) / Least(spacing);  // voxel lengths for a step of 1
  struct Piece {
    double begin, end, value_begin, value_end;
  };
  std::vector<Piece> pieces;
  for (const std::array<PointNumber, 4>& cell : mesh.tetrahedra) {
    const Vec3 origin = PlaceOfPoint(mesh, cell[0]);
    const Vec3 a = PlaceOfPoint(mesh, cell[1]) - origin, b = PlaceOfPoint(mesh, cell[2]) - origin, c = PlaceOfPoint(mesh, cell[3]) - origin;
    const double volume = Dot(a, Cross(b, c));
    const auto weights = [&](const Vec3& d) {
      const double u = Dot(d, Cross(b, c)) / volume, v = Dot(a, Cross(d, c)) / volume, w = Dot(a, Cross(b, d)) / volume;
      return std::array{-u - v - w, u, v, w};
    };
    std::array<double, 4> at = weights(ray.origin - origin), by = weights(ray.direction);  // of the point at t: at + t by
    at[0] += 1;
    Piece piece = {-1e300, 1e300, 0, 0};
    for (std::size_t i = 0; i < 4; ++i) {
      if (by[i] > 0) piece.begin = std::max(piece.begin, -at[i] / by[i]);
      if (by[i] < 0) piece.end = std::min(piece.end, -at[i] / by[i]);
    }
    if (!(piece.begin < piece.end)) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto value = double(mesh.values[cell[i]]);
      piece.value_begin += value * (at[i] + piece.begin * by[i]);
      piece.value_end += value * (at[i] + piece.end * by[i]);
    }
    pieces.push_back(piece);
  }
  std::ranges::sort(pieces, {}, &Piece::begin);
  std::array<double, 4> sum{};
  constexpr int kSteps = 64;
  for (const Piece& piece : pieces) {
    for (int i = 0; i < kSteps; ++i) {
      const double value = std::lerp(piece.value_begin, piece.value_end, (i + 0.5) / kSteps);
      const Rgb color = setup.transfer.Color(value);
      const double length = (piece.end - piece.begin) / kSteps * voxels, alpha = 1 - std::pow(1 - setup.transfer.Opacity(value), length);
      const double share = (1 - sum[3]) * alpha;
      sum = {sum[0] + share * double(color.r), sum[1] + share * double(color.g), sum[2] + share * double(color.b), sum[3] + share};
    }
  }
  return sum;
}

TEST(Slice, ApproachesTheIntegralAlongRays) {
  std::mt19937 random(kSeed);
  const Index3 size = {18, 14, 16};
  const Field field = [](const Vec3& p) { return 100 + 99 * std::sin(0.4 * p.x + 0.3 * p.y - 0.2 * p.z); };
  const Volume grid = GridVolume(size, MakeCube(size, 4, 0.2, field, random), 200, {1, 1.3, 0.8});
  for (const Projection projection : kProjections) {
    SetupOptions options;
    options.view = RandomView(projection, random);
    options.size = {60, 60};
    options.transfer = Ramp(0.3);
    options.shading.model = ShadingModel::kNone;
    std::vector<double> errors;  // root mean squares, at 1, 4 and 16 planes a voxel length
    for (const double rate : {1.0, 4.0, 16.0}) {
      const FrameSetup setup = SliceSetup(grid, options, rate);
      const LocalImage image = RenderPicture(grid, setup);
      double sum = 0;
      int pixels = 0;
      for (int y = 0; y < setup.camera.height; y += 3) {
        for (int x = 0; x < setup.camera.width; x += 3) {
          if (LengthInside(setup, x, y) < 2) continue;
          const std::array<double, 4> expected = IntegralAlongRay(*grid.cells, setup, x, y);
          for (std::size_t c = 0; c < 4; ++c) sum += std::pow(double(PixelOf(image, x, y)[c]) - expected[c], 2) / 4;
          ++pixels;
        }
      }
      ASSERT_GT(pixels, 50);
      errors.push_back(std::sqrt(sum / pixels));
    }
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << ' ' << NameOf(projection) << ": " << errors[0] << ' ' << errors[1] << ' '
                                      << errors[2]);
    EXPECT_LT(errors[0], 0.005);
    EXPECT_LT(errors[1], 0.0005);
    EXPECT_LT(errors[2], 0.00005);
  }
}

// Opacity and so extinction are proportional to a linear field, for small opacities: alpha = 1 - exp(-(integral of the extinction)).
TEST(Slice, LinearFieldHasTheAnalyticIntegral) {
  std::mt19937 random(kSeed);
  constexpr double kOpacity = 0.02;  // of a voxel length, at 200
  const Index3 size = {24, 24, 24};
  const Field field = [](const Vec3& p) { return 40 + 3 * p.x + 2 * p.y + 1.5 * p.z; };
  for (const double jitter : {0.0, 0.2}) {
    const Volume grid = GridVolume(size, MakeCube(size, 6, jitter, field, random), 200);
    for (const Projection projection : kProjections) {
      for (int i = 0; i < 6; ++i) {
        SetupOptions options;
        options.view = RandomView(projection, random);
        options.transfer = Ramp(kOpacity);
        const FrameSetup setup = SliceSetup(grid, options, 2);
        const LocalImage image = RenderPicture(grid, setup);
        for (int y = 0; y < setup.camera.height; ++y) {
          for (int x = 0; x < setup.camera.width; ++x) {
            const double length = LengthInside(setup, x, y);
            if (length < 2) continue;
            // The field in the middle of the ray's part inside.
            const Camera::Ray ray = setup.camera.RayAt(x + 0.5, y + 0.5);
            double enter = -1e300, leave = 1e300;
            for (const Axis axis : kAxes) {
              const double a = (-0.5 - ray.origin[axis]) / ray.direction[axis],
                           b = (size[axis] - 0.5 - ray.origin[axis]) / ray.direction[axis];
              enter = std::max(enter, std::min(a, b));
              leave = std::min(leave, std::max(a, b));
            }
            const double mean = field(ray.origin + 0.5 * (enter + leave) * ray.direction);
            const double expected = -std::expm1(std::log1p(-kOpacity * mean / 200) * length);
            ASSERT_NEAR(PixelOf(image, x, y)[3], expected, 0.01 * expected)
                << "seed " << kSeed << " view " << i << " pixel " << x << ' ' << y << ' ' << NameOf(projection);
          }
        }
      }
    }
  }
}

// Each ray's number of samples is that of planes inside the cube: none is lost between cells, and none counts twice.
TEST(Slice, CellsFitTogether) {
  std::mt19937 random(kSeed);
  constexpr double kOpacity = 0.001;
  const Index3 size = {20, 20, 20};
  const std::pair<double, double> kAngles[] = {{0, 0}, {90, 0}, {180, 0}, {0, 90}, {0, -90}, {45, 0}, {45, 35.26438968}, {135, 45}};
  for (const double jitter : {0.0, 0.2}) {
    for (const int side : {10, 20}) {
      const Field field = [](const Vec3&) { return 100; };
      const Volume grid = GridVolume(size, MakeCube(size, side, jitter, field, random), 100);
      for (int i = 0; i < 12; ++i) {
        SetupOptions options;
        options.size = {80, 80};
        if (i < 8) {
          options.view = {.azimuth_degrees = kAngles[i].first, .elevation_degrees = kAngles[i].second};
          options.view.zoom = i % 2 == 0 ? 1.0 : std::sqrt(3.0);
        } else {
          options.view = RandomView(Projection::kOrthographic, random);
        }
        options.transfer = Uniform(kOpacity, {1, 1, 1});
        const FrameSetup setup = SliceSetup(grid, options, 2);
        const LocalImage image = RenderWhole(grid, setup);
        for (int y = 0; y < setup.camera.height; ++y) {
          for (int x = 0; x < setup.camera.width; ++x) {
            const double length = LengthInside(setup, x, y);
            if (length < 0.6) continue;
            // With ends that stand for the length up to the border, opacities tell the length to far less than a sample.
            const double found = std::log1p(-double(PixelOf(image, x, y)[3])) / std::log1p(-kOpacity);
            ASSERT_NEAR(found, length, 0.05) << "seed " << kSeed << " view " << i << " side " << side << " jitter " << jitter << " pixel "
                                             << x << ' ' << y;
          }
        }
      }
    }
  }
}

TEST(Slice, ValuesOfCellsAreConstantInThem) {
  std::mt19937 random(kSeed);
  const Index3 size = {16, 16, 16};
  // Opaque: the picture shows the cells at the front.
  const Field field = [](const Vec3& p) { return p.x < 7.5 ? 50 : 150; };
  const Volume grid = GridVolume(size, MakeCube(size, 4, 0, field, random, ValuesAt::kCells), 200);
  SetupOptions options;
  options.view.zoom = 1.7;
  options.transfer = Ramp(0);
  options.transfer.opacities = {{0, 1, 0.5, 0}, {200, 1, 0.5, 0}};
  options.shading.model = ShadingModel::kNone;
  const FrameSetup setup = SliceSetup(grid, options);
  const LocalImage image = RenderPicture(grid, setup);
  const Rgb left = options.transfer.Color(50), right = options.transfer.Color(150);
  for (int x = 4; x < 60; ++x) {
    const auto pixel = PixelOf(image, x, 32);
    EXPECT_NEAR(pixel[0], x < 32 ? left.r : right.r, 1e-3F) << x;
    EXPECT_NEAR(pixel[1], x < 32 ? left.g : right.g, 1e-3F) << x;
  }
}

// All that an opaque grid with a linear field shows is lit by one normal, and it does not matter to which side that points.
TEST(Slice, ALinearFieldIsLitByOneNormal) {
  std::mt19937 random(kSeed);
  const Vec3 spacing = {1, 1.5, 0.75}, gradient = {3, 2, -1};
  const Rgb color = {0.4F, 0.6F, 0.2F};
  for (const double sign : {1.0, -1.0}) {
    const Field field = [&](const Vec3& p) { return 100 + sign * Dot(gradient, p); };
    const Volume grid = GridVolume({24, 20, 24}, MakeCube({24, 20, 24}, 6, 0.2, field, random), 300, spacing);
    for (const Projection projection : kProjections) {
      for (int i = 0; i < 4; ++i) {
        SetupOptions options;
        options.view = RandomView(projection, random);
        options.view.zoom = 3;
        options.transfer = Uniform(1, color);
        options.shading.shininess = 8;
        if (i % 2 == 1) options.shading.lights = {{1, -0.5, 0.25}, {0, 1, 1}};
        const FrameSetup setup = SliceSetup(grid, options);
        const LocalImage image = RenderPicture(grid, setup);
        const PhongFactors light = Phong(options.shading, setup.camera.view_direction).AtNormal(Normalized(gradient / spacing));
        for (int y = 28; y < 36; ++y) {
          for (int x = 28; x < 36; ++x) {
            const std::array<float, 4> pixel = PixelOf(image, x, y);
            ASSERT_NEAR(pixel[0], std::clamp(color.r * light.diffuse + light.specular, 0.0F, 1.0F), 1e-3) << "seed " << kSeed;
            ASSERT_NEAR(pixel[2], std::clamp(color.b * light.diffuse + light.specular, 0.0F, 1.0F), 1e-3) << "seed " << kSeed;
          }
        }
      }
    }
  }
}

TEST(Slice, AnyBoxesMakeOnePicture) {
  std::mt19937 random(kSeed);
  const Index3 size = {30, 26, 34};
  for (const ValuesAt at : {ValuesAt::kPoints, ValuesAt::kCells}) {
    const Field field = [](const Vec3& p) { return 100 + 99 * std::sin(0.5 * p.x) * std::cos(0.4 * p.y + 0.3 * p.z); };
    const Volume grid = GridVolume(size, MakeCube(size, 9, 0.2, field, random, at), 200);
    for (const Projection projection : kProjections) {
      for (int i = 0; i < 6; ++i) {
        SetupOptions options;
        options.view = RandomView(projection, random);
        if (i == 0) options.view = {.projection = projection};
        options.view.zoom = std::array{1.0, 0.4, 5.0}[std::size_t(i) % 3];
        options.transfer = Ramp(0.5);
        options.termination = i % 2 == 0 ? 0 : 1.0 / 1024;
        if (i == 1) options.shading.model = ShadingModel::kNone;
        if (i >= 3) {
          options.clipping = RandomClipping(grid.description.geometry, random);
          options.clipping.mode = i == 4 ? ClipMode::kCutAway : ClipMode::kKeep;
        }
        const FrameSetup setup = SliceSetup(grid, options, std::array{1.0, 0.4, 3.0}[std::size_t(i / 2)]);
        SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " view " << i << ' ' << NameOf(projection));
        const LocalImage one = RenderWhole(grid, setup);
        const float tolerance = 2e-5F + float(options.termination);
        EXPECT_LE(LargestDifference(one, RenderByBoxes(grid, setup, CutAtRandom(grid.block.box, 11, random))), tolerance);
        EXPECT_LE(LargestDifference(one, RenderByBoxes(grid, setup, CutIntoSlabs(grid, 13, kAxes[std::size_t(i) % 3]))), tolerance);
      }
    }
  }
}

// Where all of a ray's samples belong to one box, its pixel has the same bits.
TEST(Slice, PixelsOfOneBoxHaveTheSameBits) {
  std::mt19937 random(kSeed);
  const Index3 size = {30, 30, 30};
  const Field field = [](const Vec3& p) { return 100 + 99 * std::sin(0.5 * p.x + p.y - 0.7 * p.z); };
  const Volume grid = GridVolume(size, MakeCube(size, 9, 0.2, field, random), 200);
  SetupOptions options;
  options.size = {150, 150};  // several tiles, and chunks of planes
  options.transfer = Ramp(0.1);
  const FrameSetup setup = SliceSetup(grid, options, 2);  // along y, so boxes along x are columns of pixels
  const LocalImage one = RenderWhole(grid, setup);
  EXPECT_EQ(LargestDifference(one, RenderByBoxes(grid, setup, CutIntoSlabs(grid, 7, Axis::kX))), 0);
}

TEST(Slice, ClipsLikeRayCasting) {
  std::mt19937 random(kSeed);
  const VolumeGeometry geometry{{30, 26, 34}, {1, 1, 1}};
  const auto value = [](const Index3& v) { return 20 + 2 * v.x + 1.5 * v.y + v.z; };
  const Volume volume = AsGrid(MakeVolume(geometry, ScalarType::kFloat32, value), 1);
  for (const Projection projection : kProjections) {
    for (int i = 0; i < 8; ++i) {
      SetupOptions options;
      options.view = RandomView(projection, random);
      options.view.zoom = 1;
      options.clipping = RandomClipping(geometry, random);
      options.clipping.mode = i % 2 == 0 ? ClipMode::kKeep : ClipMode::kCutAway;
      options.transfer = Ramp(0.1);
      options.shading.model = ShadingModel::kNone;
      const LocalImage cast = RenderPicture(volume, RaycastSetup(volume, options, 2));
      const LocalImage sliced = RenderPicture(volume, SliceSetup(volume, options, 2));
      double sum = 0;
      for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) sum += std::pow(double(PixelOf(cast, x, y)[3] - PixelOf(sliced, x, y)[3]), 2);
      }
      EXPECT_LT(std::sqrt(sum / (64 * 64)), 0.004) << "seed " << kSeed << " view " << i << ' ' << NameOf(projection);
    }
  }
}

TEST(Slice, IsNearRayCastingOfSmoothVolumes) {
  std::mt19937 random(kSeed);
  const auto value = [](const Index3& v) {
    return 100 + 35 * std::sin(0.3 * v.x + 1) + 35 * std::sin(0.25 * v.y + 0.1 * v.z) + 30 * std::cos(0.28 * v.z);
  };
  const Volume volume = AsGrid(MakeVolume({{40, 36, 44}, {1, 1, 1}}, ScalarType::kFloat32, value), 1);
  for (const Projection projection : kProjections) {
    for (int i = 0; i < 4; ++i) {
      SetupOptions options;
      options.view = RandomView(projection, random);
      options.view.zoom = 1;
      options.size = {128, 128};
      options.shading.model = i % 2 == 0 ? ShadingModel::kNone : ShadingModel::kPhong;
      const LocalImage cast = RenderPicture(volume, RaycastSetup(volume, options, 2));
      const LocalImage sliced = RenderPicture(volume, SliceSetup(volume, options, 2));
      double sum = 0;
      for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 128; ++x) {
          const auto a = PixelOf(cast, x, y), b = PixelOf(sliced, x, y);
          for (std::size_t c = 0; c < 4; ++c) sum += std::pow(double(a[c] - b[c]), 2);
        }
      }
      // Gradients of the volume are central differences, those of the grid means over cells, which differ most at the border.
      EXPECT_LT(std::sqrt(sum / (4 * 128 * 128)), i % 2 == 0 ? 0.005 : 0.02)
          << "seed " << kSeed << " view " << i << ' ' << NameOf(projection);
    }
  }
}

TEST(Slice, EveryInstructionSetMakesOnePicture) {
  std::mt19937 random(kSeed);
  const Index3 size = {30, 26, 34};
  const Field field = [](const Vec3& p) { return 100 + 99 * std::sin(0.5 * p.x + p.y - 0.7 * p.z); };
  const Volume grid = GridVolume(size, MakeCube(size, 9, 0.2, field, random), 200);
  for (const Projection projection : kProjections) {
    SetupOptions options;
    options.view = RandomView(projection, random);
    if (projection == Projection::kPerspective) options.clipping = RandomClipping(grid.description.geometry, random);
    const FrameSetup setup = SliceSetup(grid, options);
    const LocalImage best = RenderWhole(grid, setup);
    ForEachTarget([&] { EXPECT_LE(LargestDifference(best, RenderWhole(grid, setup)), 2e-5F) << "seed " << kSeed; });
  }
}

TEST(Slice, HiddenTilesChangeNothingElse) {
  std::mt19937 random(kSeed);
  const Index3 size = {30, 26, 34};
  const Field field = [](const Vec3& p) { return 100 + 99 * std::sin(0.5 * p.x + p.y); };
  const Volume grid = GridVolume(size, MakeCube(size, 9, 0.2, field, random), 200);
  for (const double part : {0.3, 1.0}) {
    SetupOptions options;
    options.view = RandomView(Projection::kPerspective, random);
    options.size = {200, 180};
    const FrameSetup setup = SliceSetup(grid, options);
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " part " << part);
    ExpectHiddenTilesChangeNothingElse(grid, setup, part, random);
  }
}

TEST(Slice, TerminationChangesChannelsByNoMoreThanItself) {
  std::mt19937 random(kSeed);
  const Index3 size = {30, 30, 30};
  const Field field = [](const Vec3& p) { return 100 + 99 * std::sin(0.5 * p.x + p.y); };
  const Volume grid = GridVolume(size, MakeCube(size, 9, 0.2, field, random), 200);
  for (const Projection projection : kProjections) {
    SetupOptions options;
    options.view = RandomView(projection, random);
    options.transfer = Ramp(0.9);
    const LocalImage all = RenderWhole(grid, SliceSetup(grid, options));
    options.termination = 0.01;
    EXPECT_LE(LargestDifference(all, RenderWhole(grid, SliceSetup(grid, options))), 0.01F + 1e-5F);
  }
}

// Whatever cells a peer sends, the picture is finite and opacities lie in [0, 1].
// What a file of cells that lie over each other may take is bounded before it is taken.
TEST(Slice, TilesOfCellsAreLimited) {
  std::mt19937 random(kSeed);
  const Index3 size = {20, 20, 20};
  const auto cube = MakeCube(
      size, 6, 0.2, [](const Vec3& p) { return 100 + 5 * p.x; }, random);
  const Volume grid = GridVolume(size, cube, 200);
  const FrameSetup setup = SliceSetup(grid, {});
  const slice::FrameSpace space(setup.camera, setup.description.geometry, 1, {});
  slice::FramePoints points;
  space.Place(cube->points, points);
  std::vector<std::uint32_t> cells;
  const auto make = [&](std::size_t most) {
    const RayReach reach = space.ReachOf({-0.5, -0.5, -0.5}, {19.5, 19.5, 19.5});
    return slice::CellBins::Make(
        points.bounds, cube->tetrahedra, cells, reach.pixels, reach.begin, reach.end, [](const PixelBounds&) { return false; }, most);
  };
  for (std::uint32_t cell = 0; cell < cube->tetrahedra.size(); ++cell) cells.push_back(cell);
  const Result<slice::CellBins> bins = make(slice::CellBins::kMostEntries);
  ASSERT_EQ(bins.status(), Status::Ok());
  std::size_t entries = 0;
  for (std::int32_t tile = 0; tile < bins->tiles(); ++tile) entries += bins->VoxelsOf(tile).size();
  EXPECT_GE(entries, cells.size());
  EXPECT_EQ(make(entries).status(), Status::Ok());
  EXPECT_EQ(make(entries - 1).status().code(), StatusCode::kInvalidArgument);
  for (int copy = 0; copy < 100; ++copy) cells.insert(cells.end(), cells.begin(), cells.begin() + std::ptrdiff_t(cube->tetrahedra.size()));
  EXPECT_EQ(make(100 * entries).status().code(), StatusCode::kInvalidArgument);
}

TEST(Slice, DrawsBadCellsWithoutHarm) {
  std::mt19937 random(kSeed);
  const Index3 size = {20, 20, 20};
  const auto sound = MakeCube(
      size, 5, 0.2, [](const Vec3& p) { return 100 + 5 * p.x; }, random);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  const auto draw = [&](const Mesh& mesh, const ViewParameters& view) {
    SetupOptions options;
    options.view = view;
    const Volume grid = GridVolume(size, std::make_shared<Mesh>(mesh), 200);
    const LocalImage image = RenderPicture(grid, SliceSetup(grid, options));
    float most = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        for (const float channel : PixelOf(image, x, y)) {
          EXPECT_TRUE(channel >= 0 && channel <= 1) << channel << " at " << x << ' ' << y;
          most = std::max(most, channel);
        }
      }
    }
    return most;
  };
  for (const Projection projection : kProjections) {
    for (const double zoom : {0.1, 1.0, 50.0, 1e4}) {
      ViewParameters view = RandomView(projection, random);
      view.zoom = zoom;
      SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " zoom " << zoom << ' ' << NameOf(projection));
      EXPECT_GT(draw(*sound, view), 0);
      EXPECT_EQ(draw({}, view), 0);
      Mesh bad = *sound;  // values that are not finite, or hardly
      for (std::size_t i = 0; i < bad.values.size(); ++i)
        bad.values[i] = std::array{kNan, kInfinity, -kInfinity, 100.0F, 3e38F, -3e38F}[random() % 6];
      draw(bad, view);
      std::ranges::fill(bad.values, kNan);
      EXPECT_EQ(draw(bad, view), 0);
      bad = *sound;  // flat cells
      for (Vector3<float>& p : bad.points) p.z = 3;
      draw(bad, view);
      for (Vector3<float>& p : bad.points) p = {1, 2, 3};
      EXPECT_EQ(draw(bad, view), 0);
      bad = *sound;  // overlapping cells, inside out
      std::ranges::shuffle(bad.points, random);
      draw(bad, view);
      for (Vector3<float>& p : bad.points) p = {1e3F * p.x, -1e3F * p.y, 1e20F * p.z};
      draw(bad, view);
      for (Vector3<float>& p : bad.points) p = {1e15F * p.x, 1e30F * p.y, 1e-20F * p.z};
      draw(bad, view);
    }
  }
}

TEST(Slice, RefusesDatasetsWithoutCells) {
  const Volume volume = MakeBlock({{9, 8, 7}, {1, 1, 1}});
  const FrameSetup setup = SliceSetup(volume, {});
  const auto data = BoxFor(*setup.renderer, volume, volume.block.box);
  RankReport report;
  const auto result = MakeRenderer(*setup.renderer)->Render(*data, volume.block.box, setup, {}, RenderControl(), report);
  EXPECT_EQ(result.status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace slabstream
