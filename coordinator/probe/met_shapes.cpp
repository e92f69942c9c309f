#include "coordinator/probe/met_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "common/frame/frame_map.h"
#include "common/frame/placed_shape.h"

namespace slabstream {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A position as the ray sees it: across it, and along it as a depth.
struct SeenPoint {
  double x, y, depth;
};
// Exactly the negative if they are exchanged: this file is compiled without fused operations.
double Cross(const SeenPoint& a, const SeenPoint& b) { return a.x * b.y - a.y * b.x; }

// The share of vertices in a point between them.
using Weights = std::array<double, 3>;
using Vertices = std::array<std::size_t, 3>;

// What has no weight may be NaN.
double Mean(std::span<const float> values, const Vertices& vertices, const Weights& weights) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += weights[i] > 0 ? weights[i] * double(values[vertices[i]]) : 0;
  return sum;
}

// Bilinear; NaN: one of the samples is.
double PlaneValueAt(const ShapeView::Plane& plane, const Vec3& position) {
  struct Between {
    std::size_t first, second;
    double t;
  };
  const auto along = [&](const Row4& row, std::int32_t count) {
    const double inside = std::clamp(Apply(row, position), 0.0, count - 1.0);
    const auto first = std::min(std::int32_t(inside), std::max(count - 2, 0));
    return Between{std::size_t(first), std::size_t(std::min(first + 1, count - 1)), inside - first};
  };
  const Between x = along(plane.column, plane.columns), y = along(plane.row, plane.rows);
  const auto row = [&](std::size_t number) {
    const float* const samples = &plane.samples[number * std::size_t(plane.columns)];
    return std::lerp(double(samples[x.first]), double(samples[x.second]), x.t);
  };
  return std::lerp(row(y.first), row(y.second), y.t);
}

// The ray against one shape, in the shape's coordinates: those of its positions. Its origin is moved to the point nearest to the shape, so
// that coordinates keep their digits.
class ShapeRay {
 public:
  ShapeRay(const FrameMap& map, const Camera& camera, const PlacedShape& shape, const Camera::Ray& ray, std::uint32_t number,
           std::vector<MetShape>& met)
      : map_(map), camera_(camera), shape_(shape), view_(shape.view), number_(number), met_(met) {
    physical_direction_ = camera.spacing * ray.direction;
    direction_ = shape.FromPhysical(physical_direction_);
    along_ = (1 / Dot(direction_, direction_)) * direction_;
    const Vec3 from = shape.FromPhysical(camera.spacing * ray.origin - shape.offset);
    const Vec3 low = view_.info.low - view_.origin, high = view_.info.high - view_.origin;
    begin_ = Dot(along_, 0.5 * (low + high) - from);
    origin_ = from + begin_ * direction_;
    constexpr double kRounding = 1e-9;  // of a coordinate
    rounding_ = kRounding * (Length(low) + Length(high));
    const Axis least = *std::ranges::min_element(kAxes, {}, [&](Axis axis) { return std::abs(direction_[axis]); });
    Vec3 across;
    across[least] = 1;
    x_axis_ = Normalized(Cross(direction_, across));
    y_axis_ = Normalized(Cross(direction_, x_axis_));
  }

  void Meet() {
    for (const ShapePiece& piece : view_.pieces) {
      if (!Reaches(piece)) continue;
      if (view_.info.kind == ShapeKind::kMesh) {
        MeetTriangles(piece);
      } else {
        MeetCapsules(piece);
      }
    }
  }

 private:
  bool Reaches(const ShapePiece& piece) const {
    const double radius = shape_.LargestRadius(camera_, piece);
    double begin = -kInfinity, end = kInfinity;
    for (int i = 0; i < 3; ++i) {
      const auto axis = std::size_t(i);
      const double reach = radius * Length(shape_.turn_normal[axis]) + rounding_;
      const double low = double(piece.low[axis]) - reach - origin_[i], high = double(piece.high[axis]) + reach - origin_[i];
      if (direction_[i] == 0) {
        if (low > 0 || high < 0) return false;
        continue;
      }
      const double a = low / direction_[i], b = high / direction_[i];
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    return begin <= end;
  }

  void MeetTriangles(const ShapePiece& piece) {
    std::array<SeenPoint, kMostOfPiece> seen;
    for (std::size_t i = 0; i < piece.vertices; ++i) {
      const Vec3 p = shape_.Position(piece.first_vertex + i) - origin_;
      seen[i] = {Dot(x_axis_, p), Dot(y_axis_, p), begin_ + Dot(along_, p)};
    }
    const std::uint8_t* corner = view_.corners.data() + 3 * std::size_t{piece.first_part};
    for (std::size_t part = 0; part < piece.parts; ++part, corner += 3) {
      const SeenPoint &a = seen[corner[0]], &b = seen[corner[1]], &c = seen[corner[2]];
      Weights weights = {Cross(b, c), Cross(c, a), Cross(a, b)};
      const double sum = weights[0] + weights[1] + weights[2];
      if (sum == 0 || !Holds(b, c, weights[0], sum) || !Holds(c, a, weights[1], sum) || !Holds(a, b, weights[2], sum)) continue;
      for (double& weight : weights) weight /= sum;
      const std::size_t first = piece.first_vertex;
      Add(weights[0] * a.depth + weights[1] * b.depth + weights[2] * c.depth, {first + corner[0], first + corner[1], first + corner[2]},
          weights);
    }
  }
  // Whether the ray lies on the inner side of the edge from `a` to `b`, which twice the area of the triangle with it tells. If it meets the
  // edge, it lies in the triangle to the right of the edge, or above it.
  static bool Holds(const SeenPoint& a, const SeenPoint& b, double twice_area, double sum) {
    const double side = sum > 0 ? 1 : -1;
    if (twice_area != 0) return side * twice_area > 0;
    return a.y == b.y ? side * (b.x - a.x) > 0 : side * (a.y - b.y) > 0;
  }

  void MeetCapsules(const ShapePiece& piece) {
    const Vec3 origin = shape_.ToPhysical(origin_);
    for (std::uint32_t part = 0; part < piece.parts; ++part) {
      const auto [along, s] = shape_.CapsuleOf(camera_, piece, part).FirstOn(origin, physical_direction_);
      if (!(along < kInfinity)) continue;
      const auto [first, last] = shape_.EndsOf(piece, part);
      Add(begin_ + along, {first, last, first}, {1 - s, s, 0});
    }
  }

  void Add(double depth, const Vertices& vertices, const Weights& weights) {
    if (!map_.Sees(depth)) return;
    MetShape met = {.depth = depth, .shape = number_, .opacity = shape_.look.opacity};
    if (shape_.look.coloring == ShapeColoring::kVertices && view_.see_through && !view_.colors.empty()) {
      // 255 if all of them are.
      const auto alpha = [&](std::size_t i) { return double(view_.colors[vertices[i]][3]); };
      const double mean = alpha(0) + weights[1] * (alpha(1) - alpha(0)) + weights[2] * (alpha(2) - alpha(0));
      met.opacity *= std::min(mean / 255, 1.0);
    }
    double value = std::numeric_limits<double>::quiet_NaN();
    if (!view_.plane.samples.empty()) {
      value = PlaneValueAt(view_.plane, origin_ + (depth - begin_) * direction_);
      // Where a plane shows values and there is none, it has a hole.
      if (shape_.look.coloring == ShapeColoring::kValues && std::isnan(value)) return;
    } else if (!view_.values.empty()) {
      value = Mean(view_.values, vertices, weights);
    }
    if (std::isfinite(value)) met.value = value;
    if (met.opacity > 0) met_.push_back(met);
  }

  const FrameMap& map_;
  const Camera& camera_;
  const PlacedShape& shape_;
  const ShapeView& view_;
  const std::uint32_t number_;
  std::vector<MetShape>& met_;
  Vec3 physical_direction_, direction_;  // by depth
  Vec3 origin_, along_;                  // depth at p: begin_ + Dot(along_, p - origin_)
  double begin_ = 0, rounding_ = 0;
  Vec3 x_axis_, y_axis_;  // across the ray
};

}  // namespace

std::vector<MetShape> MeetShapes(const FrameSetup& setup, std::span<const ShapeView> shapes, const Camera::Ray& ray) {
  CHECK_EQ(shapes.size(), setup.shapes.size());
  const FrameMap map = MakeFrameMap(setup.camera);
  std::vector<MetShape> all, met;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const PlacedShape shape = MakePlacedShape(setup.camera, setup.shapes[i], shapes[i]);
    ShapeRay(map, setup.camera, shape, ray, std::uint32_t(i), all).Meet();
  }
  std::ranges::stable_sort(all, {}, &MetShape::depth);
  const MetShape* last = nullptr;
  for (const MetShape& next : all) {
    const bool joined = last != nullptr && last->shape == next.shape && shapes[next.shape].info.kind == ShapeKind::kLines &&
                        next.depth - last->depth < map.MergedAt(last->depth);
    last = &next;
    if (joined) continue;
    met.push_back(next);
    if (next.opacity == 1) break;
  }
  return met;
}

}  // namespace slabstream
