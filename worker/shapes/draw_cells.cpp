#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/shapes/draw_cells.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "worker/shapes/draw_cells.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DoubleTag = hn::CappedTag<double, 8>;
using Doubles = hn::Vec<DoubleTag>;

HWY_INLINE Doubles Set(double value) { return hn::Set(DoubleTag(), value); }

// key_at(x, y): of samples, in pixels from the tile's corner; infinity where the element is not.
template <class KeyAt>
HWY_INLINE void DrawCells(const Drawing& drawing, const PixelBounds& range, Element element, KeyAt&& key_at) {
  const DoubleTag d;
  const hn::Rebind<float, DoubleTag> df;
  const hn::Rebind<std::uint32_t, DoubleTag> du;
  TileSamples& samples = drawing.samples;
  const TileSamples::CellPoints& points = samples.cell_points();
  const std::int32_t side = samples.cell_side();
  const auto infinity = hn::Set(df, std::numeric_limits<float>::infinity());
  for (std::int32_t row = range.y_begin / side; row * side < range.y_end; ++row) {
    for (std::int32_t column = range.x_begin / side; column * side < range.x_end; ++column) {
      const std::size_t cell = samples.Cell(column, row);
      std::uint32_t hit = 0;
      alignas(64) std::array<float, kCellSamples> hit_keys;
      for (std::size_t i = 0; i < kCellSamples; i += hn::Lanes(d)) {
        const auto x = hn::Add(hn::PromoteTo(d, hn::Load(df, &points.x[i])), Set(column * side));
        const auto y = hn::Add(hn::PromoteTo(d, hn::Load(df, &points.y[i])), Set(row * side));
        const auto key = hn::DemoteTo(df, key_at(x, y));
        float* const keys = samples.keys() + cell + i;
        Element* const seen = samples.elements() + cell + i;
        const auto there = hn::Load(df, keys);
        const auto before = hn::Lt(hn::Set(du, element), hn::Load(du, seen));
        const auto nearer = hn::Or(hn::Lt(key, there), hn::And(hn::Eq(key, there), hn::RebindMask(df, before)));
        const auto mask = hn::And(nearer, hn::Lt(key, infinity));
        if (drawing.hits == nullptr) {
          hn::BlendedStore(key, mask, df, keys);
          hn::BlendedStore(hn::Set(du, element), hn::RebindMask(du, mask), du, seen);
        } else {
          alignas(8) std::uint8_t bits[8] = {};
          hn::StoreMaskBits(df, mask, bits);
          hn::Store(key, df, &hit_keys[i]);
          hit |= std::uint32_t{bits[0]} << i;
        }
      }
      if (hit != 0) AddHits(samples, column, row, hit, hit_keys, element, *drawing.hits);
    }
  }
}

void Triangle(const Drawing& drawing, const PixelBounds& range, const std::array<Line3, 3>& edges, const KeyPlane& plane, Element element) {
  const auto infinity = Set(std::numeric_limits<double>::infinity()), zero = Set(0);
  const auto at = [](const Line3& line, Doubles x, Doubles y)
                      HWY_ATTR { return hn::Add(hn::Add(hn::Mul(Set(line.x), x), hn::Mul(Set(line.y), y)), Set(line.c)); };
  DrawCells(drawing, range, element, [&](Doubles x, Doubles y) HWY_ATTR {
    auto key = hn::Min(hn::Max(at(plane.plane, x, y), Set(plane.least)), Set(plane.most));
    const auto step_x = hn::Mul(x, Set(kSteps)), step_y = hn::Mul(y, Set(kSteps));
    for (const Line3& edge : edges) {
      const auto side = at(edge, step_x, step_y);
      const bool owns = edge.x > 0 || (edge.x == 0 && edge.y > 0);
      key = hn::IfThenElse(owns ? hn::Ge(side, zero) : hn::Gt(side, zero), key, infinity);
    }
    return key;
  });
}

struct Point3 {
  Doubles x, y, z;
};
HWY_INLINE Point3 Set(const Vec3& p) { return {Set(p.x), Set(p.y), Set(p.z)}; }
HWY_INLINE Point3 Sub(const Point3& a, const Point3& b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE Doubles Dot(const Point3& a, const Point3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
// origin + x * right + y * down
HWY_INLINE Point3 Along(const Vec3& origin, const Vec3& right, const Vec3& down, Doubles x, Doubles y) {
  const auto axis = [&](double at, double r, double d)
                        HWY_ATTR { return hn::Add(hn::Add(Set(at), hn::Mul(Set(r), x)), hn::Mul(Set(d), y)); };
  return {axis(origin.x, right.x, down.x), axis(origin.y, right.y, down.y), axis(origin.z, right.z, down.z)};
}

// As Capsule::FirstOn says.
void Tube(const Drawing& drawing, const PixelBounds& range, const Capsule& capsule, Element element) {
  const FrameMap& map = drawing.scene.map;
  const PixelBounds& tile = drawing.samples.pixels();
  const Vec3& spacing = drawing.scene.camera.spacing;
  const FrameMap::Ray corner = map.RayAt(tile.x_begin, tile.y_begin);
  const Vec3 origin = spacing * corner.origin, direction = spacing * corner.direction;
  const Vec3 right = spacing * map.steps[0], down = spacing * map.steps[1];
  const auto infinity = Set(std::numeric_limits<double>::infinity()), zero = Set(0), one = Set(1);
  const Vec3 e = capsule.b - capsule.a;
  const double r = capsule.radius_b - capsule.radius_a, length = slabstream::Dot(e, e) - r * r;
  DrawCells(drawing, range, element, [&](Doubles x, Doubles y) HWY_ATTR {
    const Point3 from = Along(origin, map.w_0 * right, map.w_0 * down, x, y);
    const Point3 along = Along(direction, map.w_per_depth * right, map.w_per_depth * down, x, y);
    const auto square = Dot(along, along);
    const auto ball = [&](const Point3& p, double radius) HWY_ATTR {
      const auto half = Dot(p, along);
      const auto root = hn::Sub(hn::Mul(half, half), hn::Mul(square, hn::Sub(Dot(p, p), Set(radius * radius))));
      const auto hit = hn::Div(hn::Sub(hn::Neg(half), hn::Sqrt(hn::Max(root, zero))), square);
      return hn::IfThenElse(hn::Ge(root, zero), hit, infinity);
    };
    const Point3 p = Sub(from, Set(capsule.a));
    auto depth = hn::Min(ball(p, capsule.radius_a), ball(Sub(from, Set(capsule.b)), capsule.radius_b));
    if (length > 0) {
      const auto d = Set(length), at = hn::Add(Dot(Set(e), p), Set(capsule.radius_a * r)), slope = Dot(Set(e), along);
      const auto a = hn::Sub(hn::Mul(d, square), hn::Mul(slope, slope)), b = hn::Sub(hn::Mul(d, Dot(p, along)), hn::Mul(at, slope));
      const auto c = hn::Sub(hn::Mul(d, hn::Sub(Dot(p, p), Set(capsule.radius_a * capsule.radius_a))), hn::Mul(at, at));
      const auto root = hn::Sub(hn::Mul(b, b), hn::Mul(a, c));
      const auto hit = hn::Div(hn::Sub(hn::Neg(b), hn::Sqrt(hn::Max(root, zero))), a);
      const auto s = hn::Div(hn::Add(at, hn::Mul(hit, slope)), d);
      const auto between = hn::And(hn::Ge(root, zero), hn::And(hn::Ge(s, zero), hn::Le(s, one)));
      depth = hn::IfThenElse(between, hit, depth);
    }
    if (!map.perspective()) return depth;
    const auto w = hn::Add(hn::Mul(Set(map.w_per_depth), depth), Set(map.w_0));
    const auto seen = hn::And(hn::Lt(depth, infinity), hn::Gt(w, Set(map.least_w)));
    return hn::IfThenElse(seen, hn::Div(Set(-1), w), infinity);
  });
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Triangle);
HWY_EXPORT(Tube);

void DrawLargeTriangle(const Drawing& drawing, const PixelBounds& range, const std::array<Line3, 3>& edges, const KeyPlane& plane,
                       Element element) {
  HWY_DYNAMIC_DISPATCH(Triangle)(drawing, range, edges, plane, element);
}

void DrawCapsule(const Drawing& drawing, const PixelBounds& range, const Capsule& capsule, Element element) {
  HWY_DYNAMIC_DISPATCH(Tube)(drawing, range, capsule, element);
}

}  // namespace slabstream
#endif
