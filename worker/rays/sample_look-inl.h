// How samples look by a RayLook: their entry, gradient, opacity and light. Included once for each instruction set, hence the unusual
// include guard.
#include <bit>
#include <limits>

#include "worker/kernels/power-inl.h"
#include "worker/light/light_at-inl.h"
#include "worker/rays/ray_look.h"
#include "worker/rays/ray_packet-inl.h"

#if defined(SLABSTREAM_WORKER_RAYS_SAMPLE_LOOK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RAYS_SAMPLE_LOOK_INL_H_
#undef SLABSTREAM_WORKER_RAYS_SAMPLE_LOOK_INL_H_
#else
#define SLABSTREAM_WORKER_RAYS_SAMPLE_LOOK_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// The entry of RayLook::entries by which samples of these values look, before it is cut to a whole number.
HWY_INLINE Floats EntryAt(const RayLook& look, Floats value) {
  const auto number = hn::Add(hn::Mul(hn::Sub(value, Set(look.origin)), Set(look.scale)), Set(look.rounding));
  return hn::Min(hn::Max(number, hn::Zero(FloatTag())), Set(look.last));
}
// That entry, times four. Values are finite.
HWY_INLINE Ints EntryOf(const RayLook& look, Floats value) { return hn::ShiftLeft<2>(Truncated(EntryAt(look, value))); }
// 0 where a value is not finite.
HWY_INLINE Ints EntryOf(const RayLook& look, Floats value, Mask finite) {
  return hn::ShiftLeft<2>(Truncated(hn::IfThenElseZero(finite, EntryAt(look, value))));
}

// Differences of stored samples over two voxels, plain or smoothed, interpolated at a position: twice the slopes.
struct Gradient {
  Floats x, y, z;
};

// Smoothed over the neighbours along an axis (Zucker and Hummel 1981).
HWY_INLINE Floats Smoothed(Floats before, Floats at, Floats after) {
  return hn::Add(hn::Mul(Set(0.5F), at), hn::Mul(Set(0.25F), hn::Add(before, after)));
}

// Differences as they are: those of an even grid.
struct Unscaled {
  HWY_INLINE Floats operator()(std::size_t /*axis*/, std::size_t /*side*/, Floats difference) const { return difference; }
};
// `scale` turns a difference over two voxels along an axis, round the lower (0) or upper (1) voxel beside the sample, to one of data space.
// kSmooth: each of the two slices is smoothed along the other axes.
template <bool kSmooth, class T, class Scale>
HWY_INLINE Gradient GradientAmong(const Neighbours<T>& n, const CellPlace& place, const Scale& scale) {
  using Four = Floats[4];  // voxels along an axis; the sample is between the middle two
  const auto value = [&](std::size_t axis, const Four& of) SLABSTREAM_INLINED {
    if constexpr (!kSmooth) return Lerp(place.fraction[axis], of[1], of[2]);
    return Lerp(place.fraction[axis], Smoothed(of[0], of[1], of[2]), Smoothed(of[1], of[2], of[3]));
  };
  const auto slope = [&](std::size_t axis, const Four& of) SLABSTREAM_INLINED {
    return Lerp(place.fraction[axis], scale(axis, 0, hn::Sub(of[2], of[0])), scale(axis, 1, hn::Sub(of[3], of[1])));
  };
  Four x, y, z;  // by slice: slopes along x and y, and the values of which those along z are the differences
  for (int k = 0; k < 4; ++k) {
    Four slopes, values;  // by row
    for (int j = 0; j < 4; ++j) {
      const bool inner = j % 3 != 0 && k % 3 != 0;
      if (!kSmooth && j % 3 == 0 && k % 3 == 0) {  // nothing takes them
        slopes[j] = values[j] = hn::Zero(FloatTag());
        continue;
      }
      const SampleRow four = inner ? n.inner[k - 1][j - 1] : n.RowAt(j, k);
      const Four row = {four.first, four.a, four.b, four.last};
      slopes[j] = slope(0, row);
      values[j] = value(0, row);
    }
    x[k] = value(1, slopes);
    y[k] = slope(1, values);
    z[k] = value(1, values);
  }
  return {value(2, x), value(2, y), slope(2, z)};
}
// A function of its own that takes copies: so the code for plain gradients keeps them in registers. `owned`: as in IndexBefore.
template <class T, class Scale = Unscaled>
HWY_NOINLINE Gradient SmoothGradientAt(const RayBox& box, SamplePlace place, Mask owned, Scale scale = {}) {
  return GradientAmong<true>(LoadNeighbours<T>(box, place, owned), place, scale);
}
template <class T, class Scale = Unscaled>
HWY_INLINE Gradient GradientAt(const RayBox& box, const SamplePlace& place, Mask owned, bool smooth, const Scale& scale = {}) {
  if (smooth) return SmoothGradientAt<T>(box, place, owned, scale);
  return GradientAmong<false>(LoadNeighbours<T>(box, place, owned), place, scale);
}

// `a` where the mask is set, otherwise `b`.
HWY_INLINE Gradient Choose(Mask mask, const Gradient& a, const Gradient& b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y), hn::IfThenElse(mask, a.z, b.z)};
}

// The gradient's magnitude in gradient_unit per unit of length, times two; 0 where it is not finite.
HWY_INLINE Floats SlopeOf(const RayLook& look, const Gradient& g) {
  const auto square = [&](Floats slope, std::size_t axis) HWY_ATTR {
    const auto physical = hn::Mul(slope, Set(look.inverse_spacing[axis]));
    return hn::Mul(physical, physical);
  };
  const auto magnitude = hn::Sqrt(hn::Add(hn::Add(square(g.x, 0), square(g.y, 1)), square(g.z, 2)));
  return hn::IfThenElseZero(hn::Le(magnitude, Set(std::numeric_limits<float>::max())), magnitude);
}

// The opacity of a way, of samples with this gradient. `opacity`: as in RayLook::entries if there are gradient factors; `exponent`: as
// RayLook::step_exponent of a step.
HWY_INLINE Floats OpacityByGradient(const RayLook& look, Floats opacity, const Gradient& g, Floats exponent) {
  const FloatTag df;
  const auto number = hn::Min(hn::MulAdd(SlopeOf(look, g), Set(look.gradient_scale), Set(0.5F)), Set(look.gradient_last));
  const auto factor = hn::GatherIndex(df, look.gradient_factors.data(), hn::ConvertTo(IntTag(), number));
  return hn::Sub(Set(1), PowerOfFraction(hn::Sub(Set(1), hn::Mul(opacity, factor)), exponent));
}
HWY_INLINE Floats OpacityByGradient(const RayLook& look, Floats opacity, const Gradient& g) {
  return OpacityByGradient(look, opacity, g, Set(look.step_exponent));
}

// The entry of a RegionTable, times four, by which samples look; values are finite.
HWY_INLINE Ints RegionOf(const RayLook& look, Floats value, const Gradient& g) {
  const FloatTag df;
  const IntTag di;
  const RegionTable& table = *look.regions;
  const auto place = [&](Floats number, int count) HWY_ATTR {
    return hn::ConvertTo(di, hn::Min(hn::Max(hn::Add(number, Set(0.5F)), hn::Zero(df)), Set(float(count - 1))));
  };
  const auto row = place(hn::Mul(hn::Sub(value, Set(table.origin)), Set(table.scale)), RegionTable::kValues);
  const auto steep = place(hn::Sqrt(hn::Mul(SlopeOf(look, g), Set(0.5F * look.gradient_unit * table.slope_scale))), RegionTable::kSlopes);
  static_assert(RegionTable::kSlopes == 256);
  return hn::ShiftLeft<2>(hn::Add(hn::ShiftLeft<8>(row), steep));
}

struct Light {
  Floats diffuse, specular;
};

// fraction^shininess. Whole numbers take a few multiplications (Knuth, The Art of Computer Programming, 4.6.3).
HWY_INLINE Floats Shine(const RayLook& look, Floats fraction) {
  if (look.whole_shininess == 0) return PowerOfFraction(fraction, Set(look.shininess));
  auto power = fraction;
  for (unsigned bit = std::bit_floor(unsigned(look.whole_shininess)) / 2; bit != 0; bit /= 2) {
    power = hn::Mul(power, power);
    if ((unsigned(look.whole_shininess) & bit) != 0) power = hn::Mul(power, fraction);
  }
  return power;
}

// 1 / sqrt(v) to 2^-21, of normal numbers.
HWY_INLINE Floats InverseRoot(Floats v) {
  const auto root = hn::ApproximateReciprocalSqrt(v);
  return hn::Mul(root, hn::NegMulAdd(hn::Mul(hn::Mul(v, Set(0.5F)), root), root, Set(1.5F)));  // a step of Newton's method
}

// `open`: share of what surfaces scatter. reached(number of a light): the share of its light.
template <class Reached>
HWY_INLINE Light LightFrom(const RayLook& look, const Gradient& g, Floats open, Reached&& reached) {
  const FloatTag df;
  const auto dot = [&](const Float3& v)
                       HWY_ATTR { return hn::MulAdd(g.x, Set(v[0]), hn::MulAdd(g.y, Set(v[1]), hn::Mul(g.z, Set(v[2])))); };
  const auto nx = hn::Mul(g.x, Set(look.inverse_spacing[0])), ny = hn::Mul(g.y, Set(look.inverse_spacing[1])),
             nz = hn::Mul(g.z, Set(look.inverse_spacing[2]));
  const auto square = hn::MulAdd(nx, nx, hn::MulAdd(ny, ny, hn::Mul(nz, nz)));
  const auto has_gradient =
      hn::And(hn::Ge(square, Set(std::numeric_limits<float>::min())), hn::Le(square, Set(std::numeric_limits<float>::max())));
  const auto per_length = InverseRoot(hn::IfThenElse(has_gradient, square, Set(1)));
  const auto n_v = hn::Mul(dot(look.viewer), per_length);
  auto lit = hn::Zero(df), lit_without = hn::Zero(df), shine = hn::Zero(df);
  for (std::size_t i = 0; i < look.lights.size(); ++i) {
    const RayLook::Light& light = look.lights[i];
    const auto share = reached(int(i));
    const auto n_l = hn::Mul(dot(light.direction), per_length);
    lit = hn::MulAdd(share, hn::Abs(n_l), lit);
    lit_without = hn::Add(lit_without, share);
    const auto r_v = hn::MulSub(hn::Add(n_l, n_l), n_v, Set(light.to_viewer));
    shine = hn::MulAdd(share, Shine(look, hn::Min(hn::Max(r_v, hn::Zero(df)), Set(1))), shine);
  }
  const auto facing = hn::IfThenElse(has_gradient, lit, hn::Mul(lit_without, Set(0.5F)));
  return {hn::Mul(open, hn::MulAdd(facing, Set(look.diffuse), Set(look.ambient))),
          hn::IfThenElseZero(has_gradient, hn::Mul(shine, Set(look.specular)))};
}
HWY_INLINE Light LightOf(const RayLook& look, const Gradient& g) {
  return LightFrom(look, g, Set(1), [](int) HWY_ATTR { return Set(1); });
}

// The light on matter without surfaces, at places whose positions `light` maps: the mean of the lights.
HWY_INLINE Light MatterLightAt(const FrameLight::View& light, const SamplePlace& place) {
  const FloatTag df;
  const auto& [x, y, z] = place.position;
  const auto at = PlaceInLight(df, light, x, y, z);
  const auto first = SharesAt(df, light, at, 0);
  auto sum = first.reached;
  for (int i = 1; i < light.lights; ++i) sum = hn::Add(sum, SharesAt(df, light, at, i).reached);
  return {hn::Mul(first.open, hn::Mul(sum, Set(1.0F / float(light.lights)))), hn::Zero(df)};
}

// LightOf with shadows and ambient occlusion, at places whose positions `light` maps.
HWY_INLINE Light LightAt(const RayLook& look, const Gradient& g, const FrameLight::View& light, const SamplePlace& place) {
  if (!look.phong) return MatterLightAt(light, place);
  const FloatTag df;
  const auto& [x, y, z] = place.position;
  const auto at = PlaceInLight(df, light, x, y, z);
  const auto first = SharesAt(df, light, at, 0);
  const auto reached = [&](int number)
                           HWY_ATTR { return number == 0 || light.lights == 1 ? first.reached : SharesAt(df, light, at, number).reached; };
  return LightFrom(look, g, first.open, reached);
}

// The light on samples with this gradient. `light`: null: no shadows and no occlusion; place_of(): where the samples are.
template <class PlaceOf>
HWY_INLINE Light LightOn(const RayLook& look, const FrameLight::View* light, const Gradient& g, PlaceOf&& place_of) {
  return light != nullptr ? LightAt(look, g, *light, place_of()) : LightOf(look, g);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
