#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/shapes/surfaces.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <vector>

#include "common/view/phong.h"
#include "worker/kernels/power-inl.h"
#include "worker/light/light_at-inl.h"
#include "worker/shapes/surfaces.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 16>;
using IntTag = hn::RebindToSigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;

HWY_INLINE Floats Set(double value) { return hn::Set(FloatTag(), float(value)); }
HWY_INLINE Floats Cross2(Floats ax, Floats ay, Floats bx, Floats by) { return hn::Sub(hn::Mul(ax, by), hn::Mul(ay, bx)); }
HWY_INLINE Floats Dot3(const Floats (&a)[3], Floats x, Floats y, Floats z) {
  return hn::Add(hn::Add(hn::Mul(a[0], x), hn::Mul(a[1], y)), hn::Mul(a[2], z));
}
HWY_INLINE Floats PerLength(Floats square) { return hn::Div(Set(1), hn::Sqrt(square)); }

// Adds weight * ShapeNormalOf(packed).
HWY_INLINE void AddNormal(Ints packed, Floats weight, Floats (&sum)[3]) {
  const IntTag di;
  const FloatTag df;
  const auto u = hn::Mul(hn::ConvertTo(df, hn::ShiftRight<16>(hn::ShiftLeft<16>(packed))), Set(1.0 / 32767));
  const auto v = hn::Mul(hn::ConvertTo(df, hn::ShiftRight<16>(packed)), Set(1.0 / 32767));
  const auto z = hn::Sub(hn::Sub(Set(1), hn::Abs(u)), hn::Abs(v)), below = hn::Max(hn::Neg(z), hn::Zero(df));
  const auto x = hn::Sub(u, hn::CopySign(below, u)), y = hn::Sub(v, hn::CopySign(below, v));
  const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
  const auto none = hn::RebindMask(df, hn::Eq(packed, hn::Set(di, std::int32_t(0x80008000))));
  const auto scale = hn::IfThenZeroElse(none, hn::Mul(weight, PerLength(square)));
  sum[0] = hn::Add(sum[0], hn::Mul(x, scale));
  sum[1] = hn::Add(sum[1], hn::Mul(y, scale));
  sum[2] = hn::Add(sum[2], hn::Mul(z, scale));
}

void Weigh(const SceneShape& shape, double left, double top, std::size_t begin, std::size_t end, Surfaces& surfaces) {
  const FloatTag df;
  const IntTag di;
  // Rows of the map to homogeneous pixels of the tile.
  Row4 row_x, row_y;
  for (std::size_t i = 0; i < 4; ++i) {
    row_x[i] = shape.x[i] - left * shape.w[i];
    row_y[i] = shape.y[i] - top * shape.w[i];
  }
  const auto apply = [](const Row4& row, const Floats(&p)[3]) HWY_ATTR {
    return hn::Add(hn::Add(hn::Mul(Set(row[0]), p[0]), hn::Mul(Set(row[1]), p[1])), hn::Mul(Set(row[2]), p[2]));
  };
  const auto* const normals = reinterpret_cast<const std::int32_t*>(shape.view.normals.data());
  const auto zero = hn::Zero(df);
  for (std::size_t i = begin; i < end; i += hn::Lanes(df)) {
    Ints vertex[3];
    Floats p[3][3];
    for (std::size_t v = 0; v < 3; ++v) {
      // Behind the end there may be anything.
      vertex[v] = hn::IfThenElseZero(hn::FirstN(di, end - i), hn::Load(di, &surfaces.vertex[v][i]));
      for (std::size_t axis = 0; axis < 3; ++axis) p[v][axis] = hn::GatherIndex(df, shape.view.positions[axis].data(), vertex[v]);
    }
    const auto column = hn::Load(df, &surfaces.column[i]), row = hn::Load(df, &surfaces.row[i]);
    const auto place = [&](const Floats(&at)[3], double offset, Floats(&to)[2]) HWY_ATTR {
      const auto w = hn::Add(apply(shape.w, at), Set(offset * shape.w[3]));
      to[0] = hn::Sub(hn::Add(apply(row_x, at), Set(offset * row_x[3])), hn::Mul(column, w));
      to[1] = hn::Sub(hn::Add(apply(row_y, at), Set(offset * row_y[3])), hn::Mul(row, w));
    };
    // Homogeneous, from the pixel's centre: the first vertex, and from there to the others.
    Floats a[2], b[2], c[2];
    place(p[0], 1, a);
    const Floats to_b[3] = {hn::Sub(p[1][0], p[0][0]), hn::Sub(p[1][1], p[0][1]), hn::Sub(p[1][2], p[0][2])};
    const Floats to_c[3] = {hn::Sub(p[2][0], p[0][0]), hn::Sub(p[2][1], p[0][1]), hn::Sub(p[2][2], p[0][2])};
    place(to_b, 0, b);
    place(to_c, 0, c);
    const auto all = Cross2(b[0], b[1], c[0], c[1]), of_b = Cross2(c[0], c[1], a[0], a[1]), of_c = Cross2(a[0], a[1], b[0], b[1]);
    const auto of_a = hn::Sub(hn::Sub(all, of_b), of_c);
    const auto inside = [&](Floats weight) HWY_ATTR { return hn::Max(hn::IfThenElse(hn::Lt(all, zero), hn::Neg(weight), weight), zero); };
    Floats weights[3] = {inside(of_a), inside(of_b), inside(of_c)};
    const auto sum = hn::Add(hn::Add(weights[0], weights[1]), weights[2]);
    const auto usual = hn::And(hn::Gt(sum, zero), hn::Lt(sum, Set(1e38)));
    Floats n[3] = {zero, zero, zero};
    for (std::size_t v = 0; v < 3; ++v) {
      weights[v] = hn::IfThenElse(usual, hn::Div(weights[v], sum), Set(1.0 / 3));
      hn::Store(weights[v], df, &surfaces.weight[v][i]);
      AddNormal(hn::GatherIndex(di, normals, vertex[v]), weights[v], n);
    }
    Floats turned[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int to = int(axis);
      turned[axis] = Dot3(n, Set(shape.turn_normal[0][to]), Set(shape.turn_normal[1][to]), Set(shape.turn_normal[2][to]));
    }
    const auto square = Dot3(turned, turned[0], turned[1], turned[2]);
    const auto per_length = hn::IfThenElseZero(hn::Gt(square, zero), PerLength(square));
    for (std::size_t axis = 0; axis < 3; ++axis) hn::Store(hn::Mul(turned[axis], per_length), df, &surfaces.normal[axis][i]);
  }
}

// The plane's values at positions, bilinearly; NaN: one of the samples is.
HWY_INLINE Floats PlaneValuesAt(const ShapeView::Plane& plane, const Floats (&p)[3]) {
  const FloatTag df;
  const IntTag di;
  const auto along = [&](const Row4& row, std::int32_t count, Ints& first, Ints& second) HWY_ATTR {
    const auto place = hn::Add(Dot3(p, Set(row[0]), Set(row[1]), Set(row[2])), Set(row[3]));
    const auto inside = hn::Min(hn::Max(place, hn::Zero(df)), Set(count - 1));
    first = hn::Min(hn::ConvertTo(di, inside), hn::Set(di, std::max(count - 2, 0)));
    second = hn::Min(hn::Add(first, hn::Set(di, 1)), hn::Set(di, count - 1));
    return hn::Sub(inside, hn::ConvertTo(df, first));
  };
  Ints left, right, upper, lower;
  const auto s = along(plane.column, plane.columns, left, right), t = along(plane.row, plane.rows, upper, lower);
  const auto row = [&](Ints of) HWY_ATTR {
    const auto begin = hn::Mul(of, hn::Set(di, plane.columns));
    const auto a = hn::GatherIndex(df, plane.samples.data(), hn::Add(begin, left));
    return hn::Add(a, hn::Mul(s, hn::Sub(hn::GatherIndex(df, plane.samples.data(), hn::Add(begin, right)), a)));
  };
  const auto a = row(upper);
  return hn::Add(a, hn::Mul(t, hn::Sub(row(lower), a)));
}

void ColorThem(const SceneShape& shape, std::size_t begin, std::size_t end, Surfaces& surfaces) {
  const FloatTag df;
  const IntTag di;
  const ShapeLook& look = shape.look;
  const Floats one_color[3] = {Set(double(look.color.r)), Set(double(look.color.g)), Set(double(look.color.b))};
  const bool by_vertex = look.coloring == ShapeColoring::kVertices && !shape.view.colors.empty();
  const bool by_plane = !shape.view.plane.samples.empty();
  const bool by_value =
      look.coloring == ShapeColoring::kValues && (by_plane || !shape.view.values.empty()) && look.map.size() == kShapeMapColors;
  for (std::size_t i = begin; i < end; i += hn::Lanes(df)) {
    Floats color[3] = {one_color[0], one_color[1], one_color[2]};
    auto opacity = Set(look.opacity);
    Ints vertex[3];
    Floats weight[3];
    for (std::size_t v = 0; v < 3; ++v) {
      vertex[v] = hn::IfThenElseZero(hn::FirstN(di, end - i), hn::Load(di, &surfaces.vertex[v][i]));
      weight[v] = hn::Load(df, &surfaces.weight[v][i]);
    }
    if (by_vertex) {
      Floats sum[4] = {hn::Zero(df), hn::Zero(df), hn::Zero(df), hn::Zero(df)};
      for (std::size_t v = 0; v < 3; ++v) {
        auto rgba = hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(shape.view.colors.data()), vertex[v]);
        for (Floats& channel : sum) {
          channel = hn::Add(channel, hn::Mul(weight[v], hn::ConvertTo(df, hn::And(rgba, hn::Set(di, 255)))));
          rgba = hn::ShiftRight<8>(rgba);
        }
      }
      for (std::size_t c = 0; c < 3; ++c) color[c] = hn::Mul(sum[c], Set(1.0 / 255));
      // An alpha that is 255 everywhere stays 1, whatever the weights are.
      if (shape.view.see_through) opacity = hn::Min(hn::Mul(opacity, hn::Mul(sum[3], Set(1.0 / 255))), Set(1));
    } else if (by_value) {
      // Of what an array has for each vertex.
      const auto mean = [&](const float* array) HWY_ATTR {
        auto sum = hn::Zero(df);
        for (std::size_t v = 0; v < 3; ++v) {
          const auto of_vertex = hn::GatherIndex(df, array, vertex[v]);
          sum = hn::Add(sum, hn::IfThenElseZero(hn::Gt(weight[v], hn::Zero(df)), hn::Mul(weight[v], of_vertex)));
        }
        return sum;
      };
      Floats value;
      if (by_plane) {
        const Floats p[3] = {mean(shape.view.positions[0].data()), mean(shape.view.positions[1].data()),
                             mean(shape.view.positions[2].data())};
        value = PlaneValuesAt(shape.view.plane, p);
        opacity = hn::IfThenElseZero(hn::Eq(value, value), opacity);
      } else {
        value = mean(shape.view.values.data());
      }
      const auto last = double(look.map.size() - 1);
      const auto at = hn::Mul(hn::Sub(value, Set(look.low)), Set(last / (look.high - look.low)));
      const auto known = hn::Eq(at, at);
      const auto within = hn::IfThenElseZero(known, hn::Min(hn::Max(at, hn::Zero(df)), Set(last)));
      const auto below = hn::Min(hn::ConvertTo(di, within), hn::Set(di, std::int32_t(last) - 1));
      const auto t = hn::Sub(within, hn::ConvertTo(df, below));
      const auto first = hn::Add(hn::Add(below, below), below);
      const float* const map = &look.map.data()->r;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto low = hn::GatherIndex(df, map + c, first), high = hn::GatherIndex(df, map + 3 + c, first);
        color[c] = hn::IfThenElse(known, hn::Add(low, hn::Mul(t, hn::Sub(high, low))), color[c]);
      }
    }
    for (std::size_t c = 0; c < 3; ++c) hn::Store(color[c], df, &surfaces.color[c][i]);
    hn::Store(opacity, df, &surfaces.opacity[i]);
  }
}

void Depths(const FrameMap& map, std::size_t count, Surfaces& surfaces) {
  const hn::CappedTag<double, 8> d;
  const hn::Rebind<float, decltype(d)> df;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    auto depth = hn::PromoteTo(d, hn::Load(df, &surfaces.key[i]));
    if (map.perspective()) {
      const auto w = hn::Div(hn::Set(d, -1), depth);
      depth = hn::Div(hn::Sub(w, hn::Set(d, map.w_0)), hn::Set(d, map.w_per_depth));
    }
    hn::Store(hn::DemoteTo(df, depth), df, &surfaces.depth[i]);
  }
}

void Shares(const FrameLight::View& light, const FrameMap::Ray& corner, const FrameMap::Ray& right, const FrameMap::Ray& down,
            const Vec3& spacing, double way, int lights, std::size_t count, Surfaces& surfaces) {
  const FloatTag df;
  for (std::size_t i = 0; i < count; i += hn::Lanes(df)) {
    const auto column = hn::Load(df, &surfaces.column[i]), row = hn::Load(df, &surfaces.row[i]), depth = hn::Load(df, &surfaces.depth[i]);
    const auto along = [&](double at, double by_column, double by_row)
                           HWY_ATTR { return hn::Add(hn::Add(Set(at), hn::Mul(Set(by_column), column)), hn::Mul(Set(by_row), row)); };
    Floats p[3], normal[3];
    auto away = hn::Zero(df);  // of the normal from the eye
    for (int axis = 0; axis < 3; ++axis) {
      const auto origin = along(corner.origin[axis], right.origin[axis], down.origin[axis]);
      const auto direction = along(corner.direction[axis], right.direction[axis], down.direction[axis]);
      p[axis] = hn::Add(origin, hn::Mul(depth, direction));
      normal[axis] = hn::Load(df, &surfaces.normal[std::size_t(axis)][i]);
      away = hn::Add(away, hn::Mul(normal[axis], hn::Mul(Set(spacing[axis]), direction)));
    }
    const auto one = Set(1);
    auto inside = hn::Lt(hn::Zero(df), one);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto q = hn::Add(hn::Mul(p[axis], Set(double(light.scale[axis]))), Set(double(light.offset[axis])));
      inside = hn::And(inside, hn::And(hn::Ge(q, Set(-0.5)), hn::Le(q, Set(double(light.last[axis]) + 0.5))));
    }
    const auto off = hn::IfThenElse(hn::Lt(away, hn::Zero(df)), Set(way), Set(-way));
    for (int axis = 0; axis < 3; ++axis) p[axis] = hn::Add(p[axis], hn::Mul(off, hn::Mul(normal[axis], Set(1 / spacing[axis]))));
    const auto place = PlaceInLight(df, light, p[0], p[1], p[2]);
    for (int n = 0; n < lights; ++n) {
      const auto shares = SharesAt(df, light, place, light.lights == 1 ? 0 : n);
      if (n == 0) hn::Store(hn::IfThenElse(inside, shares.open, one), df, &surfaces.open[i]);
      hn::Store(hn::IfThenElse(inside, shares.reached, one), df, &surfaces.reached[std::size_t(n)][i]);
    }
  }
}

void LightThem(const Material& material, bool phong, const std::vector<Vec3>& lights, const Vec3& to_viewer, bool shares, std::size_t count,
               Surfaces& surfaces) {
  const FloatTag df;
  const auto zero = hn::Zero(df), one = Set(1);
  for (std::size_t i = 0; i < count; i += hn::Lanes(df)) {
    const Floats normal[3] = {hn::Load(df, &surfaces.normal[0][i]), hn::Load(df, &surfaces.normal[1][i]),
                              hn::Load(df, &surfaces.normal[2][i])};
    const auto along = [&](const Vec3& v) HWY_ATTR { return Dot3(normal, Set(v.x), Set(v.y), Set(v.z)); };
    const auto n_v = along(to_viewer);
    auto lit = zero, all = zero, shine = zero;
    for (std::size_t n = 0; n < lights.size(); ++n) {
      const auto reached = shares ? hn::Load(df, &surfaces.reached[n][i]) : one;
      const auto n_l = along(lights[n]);
      const auto r_v = hn::Sub(hn::Mul(hn::Add(n_l, n_l), n_v), Set(Dot(lights[n], to_viewer)));
      lit = hn::Add(lit, hn::Mul(reached, hn::Abs(n_l)));
      all = hn::Add(all, reached);
      if (phong) {
        const auto power = PowerOfFraction(hn::Min(hn::Max(r_v, zero), one), Set(double(material.shininess)));
        shine = hn::Add(shine, hn::Mul(reached, power));
      }
    }
    // Without a normal: |N.L| is 1/2 on average. Unlit: the mean of the lights.
    auto diffuse = hn::Mul(all, Set(1 / double(lights.size())));
    auto specular = zero;
    if (phong) {
      const auto has_normal = hn::Gt(Dot3(normal, normal[0], normal[1], normal[2]), zero);
      const auto facing = hn::IfThenElse(has_normal, lit, hn::Mul(all, Set(0.5)));
      diffuse = hn::Add(Set(double(material.ambient)), hn::Mul(facing, Set(double(material.diffuse))));
      specular = hn::IfThenElseZero(has_normal, hn::Mul(shine, Set(double(material.specular))));
    }
    if (shares) diffuse = hn::Mul(diffuse, hn::Load(df, &surfaces.open[i]));
    for (auto& color : surfaces.color) {
      const auto value = hn::Add(hn::Mul(hn::Load(df, &color[i]), diffuse), specular);
      hn::Store(hn::Min(hn::Max(value, zero), one), df, &color[i]);
    }
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
static_assert(sizeof(Rgb) == 3 * sizeof(float));

HWY_EXPORT(Weigh);
HWY_EXPORT(ColorThem);
HWY_EXPORT(LightThem);
HWY_EXPORT(Shares);
HWY_EXPORT(Depths);

void Surfaces::Resize(std::size_t count, std::size_t lights) {
  const auto resize = [&](auto& each) { each.resize(count); };
  const auto resize_all = [&](auto& all) { std::ranges::for_each(all, resize); };
  // Of no surface, too, a place is finite.
  column.assign(count, 0);
  row.assign(count, 0);
  key.assign(count, -1);
  resize(depth);
  resize_all(vertex);
  resize_all(weight);
  resize_all(normal);
  resize_all(color);
  resize(opacity);
  if (lights == 0) return;
  resize(open);
  for (std::size_t n = 0; n < lights; ++n) resize(reached[n]);
}

void WeighTriangles(const SceneShape& shape, double left, double top, std::size_t begin, std::size_t end, Surfaces& surfaces) {
  HWY_DYNAMIC_DISPATCH(Weigh)(shape, left, top, begin, end, surfaces);
}

void ColorSurfaces(const SceneShape& shape, std::size_t begin, std::size_t end, Surfaces& surfaces) {
  HWY_DYNAMIC_DISPATCH(ColorThem)(shape, begin, end, surfaces);
}

void FindDepths(const FrameMap& map, std::size_t count, Surfaces& surfaces) { HWY_DYNAMIC_DISPATCH(Depths)(map, count, surfaces); }

void FindShares(const ShapeScene& scene, double left, double top, std::size_t count, Surfaces& surfaces) {
  const FrameMap& map = scene.map;
  const FrameMap::Ray corner = map.RayAt(left, top);
  const FrameMap::Ray right = {map.w_0 * map.steps[0], map.w_per_depth * map.steps[0]};
  const FrameMap::Ray down = {map.w_0 * map.steps[1], map.w_per_depth * map.steps[1]};
  const auto lights = int(std::ranges::count_if(surfaces.reached, [](const auto& each) { return !each.empty(); }));
  HWY_DYNAMIC_DISPATCH(Shares)(scene.light->Seen(), corner, right, down, scene.camera.spacing, scene.light_way, lights, count, surfaces);
}

void LightSurfaces(const Shading& shading, const Vec3& to_viewer, bool shares, std::size_t count, Surfaces& surfaces) {
  const bool phong = shading.model == ShadingModel::kPhong;
  if (!phong && !shares) return;
  HWY_DYNAMIC_DISPATCH(LightThem)(shading.On(), phong, Phong(shading, -to_viewer).lights(), to_viewer, shares, count, surfaces);
}

}  // namespace slabstream
#endif
