#include "worker/light/shape_extinction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/parallel/parallel.h"
#include "common/shapes/packed_shape.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSlabSlices = 8;  // a task's
constexpr double kLeastRadius = 0.75;    // voxels; a smaller one lets light through between the rays of a sweep

struct LightShape {
  ShapeView view;
  const ShapeLook* look = nullptr;
  AffineMap map;          // from positions of `view` to the light volume
  double world_unit = 1;  // in that of the frame
};

// A vertex in the light volume. Lengths are in the unit of the frame, and so are places, along the voxels' axes.
struct Vertex {
  Vec3 at;
  double radius = 0, opacity = 1;
};

Vertex Between(const Vertex& a, const Vertex& b) {
  return {0.5 * (a.at + b.at), 0.5 * (a.radius + b.radius), 0.5 * (a.opacity + b.opacity)};
}

// Optical depth of a share of the light that is taken.
double DepthOf(double opacity) { return -std::log1p(-std::min(opacity, kMostOpacity)); }

// Adds to the slices [begin, end) alone.
class SlabOfMatter {
 public:
  SlabOfMatter(std::int32_t begin, std::int32_t end, Extinction& extinction)
      : slab_{{0, 0, begin}, {extinction.size.x, extinction.size.y, end}},
        extinction_(extinction),
        voxel_(std::max({extinction.spacing.x, extinction.spacing.y, extinction.spacing.z})) {}

  void Add(const LightShape& shape) {
    for (const ShapePiece& piece : shape.view.pieces) {
      const auto corner = [](const std::array<float, 3>& p) { return Vec3{double(p[0]), double(p[1]), double(p[2])}; };
      const auto [low, high] = shape.map.Bounds(corner(piece.low), corner(piece.high));
      const Vec3 diagonal = extinction_.spacing * (high - low);
      if (!Reaches(extinction_.spacing * low + 0.5 * diagonal, 0.5 * Length(diagonal) + RadiusOf(shape, piece.radius))) continue;
      for (std::uint32_t part = 0; part < piece.parts; ++part) AddPart(shape, piece, part);
    }
  }

 private:
  double RadiusOf(const LightShape& shape, float of_vertex) const {
    const ShapeLook& look = *shape.look;
    if (shape.view.info.kind == ShapeKind::kMesh) return 0;
    if (look.width == 0 && shape.view.info.has_radii) return std::max(0.0, double(of_vertex) * shape.world_unit);
    return 0.5 * (look.width > 0 && !look.width_in_pixels ? look.width : voxel_);
  }
  // Whether something no farther from `centre` than `radius` may change the slab.
  bool Reaches(const Vec3& centre, double radius) const {
    const double reach = radius + (kLeastRadius + 0.5) * voxel_;
    return std::ranges::all_of(kAxes, [&](Axis axis) {
      const double spacing = extinction_.spacing[axis];
      return centre[axis] + reach > slab_.begin[axis] * spacing && centre[axis] - reach < (slab_.end[axis] - 1) * spacing;
    });
  }

  void AddPart(const LightShape& shape, const ShapePiece& piece, std::uint32_t part) {
    const ShapeView& view = shape.view;
    const std::size_t corners = CornersOf(view.info.kind);
    const bool by_vertex = shape.look->coloring == ShapeColoring::kVertices && !view.colors.empty();
    std::array<Vertex, 3> vertices;
    bool finite = true;
    for (std::size_t c = 0; c < std::max(corners, std::size_t{1}); ++c) {
      const std::size_t local = corners == 0 ? part : view.corners[corners * (std::size_t{piece.first_part} + part) + c];
      const std::size_t i = piece.first_vertex + local;
      const Vec3 p = {double(view.positions[0][i]), double(view.positions[1][i]), double(view.positions[2][i])};
      vertices[c] = {extinction_.spacing * shape.map.To(p), RadiusOf(shape, view.radii.empty() ? 0 : view.radii[i]),
                     shape.look->opacity * (by_vertex ? view.colors[i][3] / 255.0 : 1)};
      finite = finite && std::isfinite(Dot(vertices[c].at, vertices[c].at) + vertices[c].radius);
    }
    if (!finite) return;
    const auto& [a, b, c] = vertices;
    if (corners == 3) {
      AddTriangle(a, b, c, 0.5 * Length(Cross(b.at - a.at, c.at - a.at)));
    } else if (corners == 2) {
      AddTube(a, b, Length(b.at - a.at));
    } else {
      const double radius = std::max(kLeastRadius * voxel_, a.radius), share = a.radius / radius;
      AddBall(a.at, radius, DepthOf(a.opacity * share * share) * std::numbers::pi * radius * radius);
    }
  }

  // Halves the longest edge until it is no longer than a voxel.
  void AddTriangle(const Vertex& a, const Vertex& b, const Vertex& c, double area) {
    const double ab = Length(b.at - a.at), bc = Length(c.at - b.at), ca = Length(a.at - c.at);
    if (bc > ab && bc >= ca) return AddTriangle(b, c, a, area);
    if (ca > ab) return AddTriangle(c, a, b, area);
    const Vertex middle = Between(a, b);
    if (!Reaches(middle.at, ab)) return;
    if (ab > voxel_) {
      AddTriangle(a, middle, c, area / 2);
      AddTriangle(middle, b, c, area / 2);
      return;
    }
    AddBall((1.0 / 3) * (a.at + b.at + c.at), kLeastRadius * voxel_, DepthOf((a.opacity + b.opacity + c.opacity) / 3) * area);
  }

  void AddTube(const Vertex& a, const Vertex& b, double length) {
    const Vertex middle = Between(a, b);
    if (!Reaches(middle.at, length + std::max(a.radius, b.radius))) return;
    const double radius = std::max(kLeastRadius * voxel_, middle.radius);
    if (length > 0.7 * radius) {
      AddTube(a, middle, length / 2);
      AddTube(middle, b, length / 2);
      return;
    }
    AddBall(middle.at, radius, DepthOf(middle.opacity * middle.radius / radius) * 2 * radius * length);
  }

  // Spreads this optical depth times area evenly over a ball, whose border is a voxel thick.
  void AddBall(const Vec3& centre, double radius, double amount) {
    const Vec3& spacing = extinction_.spacing;
    const double reach = radius + 0.5 * voxel_;
    Box box = slab_;
    for (const Axis axis : kAxes) {
      const auto voxel = [&](double place) {
        return std::int32_t(std::clamp(std::ceil(place / spacing[axis]), double(slab_.begin[axis]), double(slab_.end[axis])));
      };
      box.begin[axis] = voxel(centre[axis] - reach);
      box.end[axis] = voxel(centre[axis] + reach);
    }
    const double each = amount / (4 * std::numbers::pi / 3 * radius * (radius * radius + 0.25 * voxel_ * voxel_));
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        float* const row = extinction_.each.data() + NumberIn(extinction_.size, {0, y, z});
        const double dy = y * spacing.y - centre.y, dz = z * spacing.z - centre.z, square = dy * dy + dz * dz;
        for (std::int32_t x = box.begin.x; x < box.end.x; ++x) {
          const double dx = x * spacing.x - centre.x;
          row[x] += float(each * std::clamp((reach - std::sqrt(dx * dx + square)) / voxel_, 0.0, 1.0));
        }
      }
    }
  }

  const Box slab_;
  Extinction& extinction_;
  const double voxel_;  // its longest side
};

}  // namespace

void AddShapes(std::span<const std::shared_ptr<const VoxelBlock>> bytes, const FrameSetup& setup, Extinction& extinction) {
  const GridMap light = MapBetween(setup.description.geometry, setup.light->description.geometry);
  std::vector<LightShape> shapes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const Result<ShapeView> view = ViewShape(bytes[i]->bytes);
    if (!view.ok() || setup.shapes[i].look.unlit) continue;  // whoever draws it tells why
    const AffineMap& to_data = setup.shapes[i].to_data;
    LightShape& shape = shapes.emplace_back(LightShape{.view = *view, .look = &setup.shapes[i].look});
    for (std::size_t axis = 0; axis < 3; ++axis) shape.map.steps[axis] = light.scale * to_data.steps[axis];
    shape.map.offset = light.scale * to_data.To(view->origin) + light.offset;
    const auto side = [&](std::size_t axis) { return extinction.spacing * shape.map.steps[axis]; };
    shape.world_unit = std::cbrt(std::abs(Dot(side(0), Cross(side(1), side(2)))));
  }
  ParallelFor(0, (extinction.size.z + kSlabSlices - 1) / kSlabSlices, [&](std::int32_t slab) {
    SlabOfMatter matter(slab * kSlabSlices, std::min((slab + 1) * kSlabSlices, extinction.size.z), extinction);
    for (const LightShape& shape : shapes) matter.Add(shape);
  });
}

}  // namespace slabstream
