// What the tests of shapes share: frames to draw in, simple shapes, and what a frame shows of them.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "common/shapes/packed_shape.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream::testing {

// World coordinates are lengths along the voxels' axes unless the geometry is turned.
inline FrameSetup EmptyFrame(const VolumeGeometry& geometry, const ViewParameters& view, ImageSize size, bool slices = false) {
  FrameSetup setup;
  setup.description.geometry = geometry;
  setup.camera = MakeCamera(view, size, geometry);
  if (slices) setup.sheets = MakeSheetGrid(setup.camera, geometry);
  return setup;
}

inline std::shared_ptr<const VoxelBlock> Packed(const Shape& shape) {
  auto block = std::make_shared<VoxelBlock>();
  block->bytes = PackShape(shape).value();
  block->box = {{0, 0, 0}, {std::int32_t(block->bytes.size()), 1, 1}};
  return block;
}

// Shapes in a frame.
struct Scene {
  FrameSetup setup;
  std::vector<std::shared_ptr<const VoxelBlock>> bytes = {};

  void Add(const Shape& shape, const ShapeLook& look = {}) {
    const VolumeGeometry world = {setup.description.geometry.size};
    setup.shapes.push_back({.to_data = AffineMapBetween(world, setup.description.geometry), .look = look});
    bytes.push_back(Packed(shape));
  }
  std::shared_ptr<const FrameShapes> Draw(std::shared_ptr<const FrameLight> light = nullptr) const {
    return MakeFrameShapes(setup, bytes, std::move(light)).value();
  }
};

// visit(x, y, fragments) for each pixel of the frame.
template <class Visit>
void ForEachPixel(const FrameSetup& setup, const FrameShapes& shapes, Visit&& visit) {
  const PixelBounds frame = FrameBounds(setup);
  for (std::int32_t y = 0; y < frame.y_end; ++y) {
    for (std::int32_t x = 0; x < frame.x_end; ++x) visit(x, y, shapes.TileAt(x, y).At(x, y));
  }
}

// The light that fragments take, and the colour that they show.
inline std::array<double, 4> Composited(std::span<const ShapeFragment> fragments) {
  std::array<double, 4> sum{};
  for (const ShapeFragment& fragment : fragments) {
    const double left = 1 - sum[3];
    for (std::size_t c = 0; c < 4; ++c) sum[c] += left * double(fragment.rgba[c]);
  }
  return sum;
}

inline double Coverage(const FrameSetup& setup, const FrameShapes& shapes) {
  double sum = 0;
  ForEachPixel(setup, shapes, [&](int, int, std::span<const ShapeFragment> fragments) { sum += Composited(fragments)[3]; });
  return sum;
}

inline std::array<float, 3> ToFloats(const Vec3& p) { return {float(p.x), float(p.y), float(p.z)}; }

// n x n squares, each of two triangles, of the parallelogram with these sides round `centre`.
inline Shape Plane(const Vec3& centre, const Vec3& a, const Vec3& b, std::uint32_t n) {
  Shape shape;
  shape.origin = centre;
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x) shape.positions.push_back(ToFloats((double(x) / n - 0.5) * a + (double(y) / n - 0.5) * b));
  }
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t v = y * (n + 1) + x;
      shape.triangles.push_back({v, v + 1, v + n + 1});
      shape.triangles.push_back({v + 1, v + n + 2, v + n + 1});
    }
  }
  return shape;
}

// A sphere of about 2 n^2 triangles.
inline Shape SphereMesh(const Vec3& centre, double radius, std::uint32_t n) {
  Shape shape;
  shape.origin = centre;
  for (std::uint32_t row = 0; row <= n; ++row) {
    for (std::uint32_t column = 0; column < n; ++column) {
      const double theta = std::numbers::pi * row / n, phi = 2 * std::numbers::pi * column / n;
      const Vec3 normal = {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
      shape.positions.push_back(ToFloats(radius * normal));
      shape.normals.push_back(ToFloats(normal));
    }
  }
  for (std::uint32_t row = 0; row < n; ++row) {
    for (std::uint32_t column = 0; column < n; ++column) {
      const std::uint32_t a = row * n + column, b = row * n + (column + 1) % n;
      shape.triangles.push_back({a, a + n, b});
      shape.triangles.push_back({b, a + n, b + n});
    }
  }
  return shape;
}

inline Shape Point(const Vec3& at, float radius) {
  Shape shape;
  shape.kind = ShapeKind::kPoints;
  shape.origin = at;
  shape.positions = {{0, 0, 0}};
  shape.radii = {radius};
  return shape;
}

}  // namespace slabstream::testing
