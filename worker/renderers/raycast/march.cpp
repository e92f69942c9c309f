#include "worker/renderers/raycast/march.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/raycast/march.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "worker/kernels/power-inl.h"
#include "worker/rays/ray_packet-inl.h"
#include "worker/renderers/raycast/surface_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// Central differences, times two, of stored samples around a position, interpolated.
struct Gradient {
  Floats x, y, z;
};

template <class T>
HWY_INLINE Gradient GradientAt(const Neighbours<T>& n, const SamplePlace& place) {
  const auto u = place.fraction[0], v = place.fraction[1], w = place.fraction[2];
  // Row y, z of 0 ... 3, interpolated along x.
  const auto inner = [&](int y, int z) HWY_ATTR { return Lerp(u, n.inner[z - 1][y - 1].a, n.inner[z - 1][y - 1].b); };
  const auto outer = [&](int y, int z) HWY_ATTR {
    const InnerPair pair = LoadInner(n.samples, n.RowAt(y, z));
    return Lerp(u, pair.a, pair.b);
  };
  const auto slope = [&](int y, int z) HWY_ATTR {
    const OuterSlopes slopes = LoadSlopes(n.samples, n.RowAt(y, z), n.inner[z - 1][y - 1]);
    return Lerp(u, slopes.at_a, slopes.at_b);
  };
  const auto r11 = inner(1, 1), r21 = inner(2, 1), r12 = inner(1, 2), r22 = inner(2, 2);
  const auto along_y = [&](Floats first, Floats a, Floats b, Floats last) HWY_ATTR { return Lerp(v, hn::Sub(b, first), hn::Sub(last, a)); };
  const auto along_z = [&](Floats first, Floats a, Floats b, Floats last) HWY_ATTR { return Lerp(w, hn::Sub(b, first), hn::Sub(last, a)); };
  return {Lerp(w, Lerp(v, slope(1, 1), slope(2, 1)), Lerp(v, slope(1, 2), slope(2, 2))),
          Lerp(w, along_y(outer(0, 1), r11, r21, outer(3, 1)), along_y(outer(0, 2), r12, r22, outer(3, 2))),
          Lerp(v, along_z(outer(1, 0), r11, r12, outer(1, 3)), along_z(outer(2, 0), r21, r22, outer(2, 3)))};
}

struct Light {
  Floats diffuse, specular;
};

HWY_INLINE Light LightOf(const RayLook& look, const Gradient& g) {
  const FloatTag df;
  const auto dot = [&](const Float3& v)
                       HWY_ATTR { return hn::Add(hn::Add(hn::Mul(g.x, Set(v[0])), hn::Mul(g.y, Set(v[1]))), hn::Mul(g.z, Set(v[2]))); };
  const auto nx = hn::Mul(g.x, Set(look.inverse_spacing[0])), ny = hn::Mul(g.y, Set(look.inverse_spacing[1])),
             nz = hn::Mul(g.z, Set(look.inverse_spacing[2]));
  const auto square = hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Mul(nz, nz));
  const auto has_gradient = hn::And(hn::Gt(square, hn::Zero(df)), hn::Le(square, Set(std::numeric_limits<float>::max())));
  const auto per_length = hn::Div(Set(1), hn::Sqrt(hn::IfThenElse(has_gradient, square, Set(1))));
  const auto n_v = hn::Mul(dot(look.viewer), per_length);
  auto lit = hn::Zero(df), shine = hn::Zero(df);
  for (const RayLook::Light& light : look.lights) {
    const auto n_l = hn::Mul(dot(light.direction), per_length);
    lit = hn::Add(lit, hn::Abs(n_l));
    const auto r_v = hn::Sub(hn::Mul(hn::Add(n_l, n_l), n_v), Set(light.to_viewer));
    shine = hn::Add(shine, PowerOfFraction(hn::Min(hn::Max(r_v, hn::Zero(df)), Set(1)), Set(look.shininess)));
  }
  return {hn::IfThenElse(has_gradient, hn::MulAdd(lit, Set(look.diffuse), Set(look.ambient)), Set(look.diffuse_without_gradient)),
          hn::IfThenElseZero(has_gradient, hn::Mul(shine, Set(look.specular)))};
}

// A sample stands for half a step of its ray on each side. For the first and the last sample in the volume that part reaches to the point
// where the ray enters or leaves the volume, between 0 and 1 step away.
struct EndSamples {
  Floats first, last;                // k
  Floats first_excess, last_excess;  // steps, [-0.5, 0.5]
};
// `part`: what clipping leaves of the rays, null: all.
HWY_INLINE EndSamples EndSamplesOf(const ViewRays& view, const RayPacket& packet, const LeapScales& scales, const PacketPart* part) {
  const Float3 low = {-0.5F, -0.5F, -0.5F}, &high = view.volume_end;
  SampleInterval inside = SamplesInside(packet, low, high, 0, view.sample_count);
  auto enter = Set(-1e9F), leave = Set(1e9F);  // in samples
  for (std::size_t i = 0; i < 3; ++i) {
    const auto a = hn::Mul(hn::Sub(Set(low[i]), packet.first[i]), scales.inverse[i]);
    const auto b = hn::Mul(hn::Sub(Set(high[i]), packet.first[i]), scales.inverse[i]);
    enter = hn::Max(enter, hn::Min(a, b));
    leave = hn::Min(leave, hn::Max(a, b));
  }
  if (part != nullptr) {
    inside = part->Of(inside);
    enter = hn::Max(enter, part->enter);
    leave = hn::Min(leave, part->leave);
  }
  const auto half = Set(0.5F);
  const auto limited = [&](Floats excess) HWY_ATTR { return hn::Min(hn::Max(excess, hn::Neg(half)), half); };
  const auto last = hn::Sub(inside.end, Set(1));
  return {inside.begin, last, limited(hn::Sub(hn::Sub(inside.begin, enter), half)), limited(hn::Sub(hn::Sub(leave, last), half))};
}

// What the rays of a packet have gathered, front to back.
struct Sums {
  Floats red, green, blue, alpha;

  // Adds what lies next on these rays. `colors`: straight, red, green, blue and something else of each colour; `entry`: times four.
  HWY_INLINE void Add(Mask rays, Floats opacity, const float* colors, Ints entry, const Light& light) {
    const FloatTag df;
    const auto weight = hn::IfThenElseZero(rays, hn::Mul(hn::Sub(Set(1), alpha), opacity));
    const auto add = [&](Floats& sum, const float* channel) HWY_ATTR {
      const auto color = hn::MulAdd(hn::GatherIndex(df, channel, entry), light.diffuse, light.specular);
      sum = hn::MulAdd(weight, hn::Min(hn::Max(color, hn::Zero(df)), Set(1)), sum);
    };
    add(red, colors);
    add(green, colors + 1);
    add(blue, colors + 2);
    alpha = hn::Add(alpha, weight);
  }
};

// The entry of RayLook::entries, times four, by which samples of these values look; 0 where a value is not finite.
HWY_INLINE Ints EntryOf(const RayLook& look, Floats value, Mask finite) {
  const FloatTag df;
  const auto number = hn::Min(
      hn::Max(hn::Add(hn::Mul(hn::Sub(value, Set(look.origin)), Set(look.scale)), Set(look.rounding)), hn::Zero(df)), Set(look.last));
  return hn::ShiftLeft<2>(hn::ConvertTo(IntTag(), hn::IfThenElseZero(finite, number)));
}

// The factor of the opacity of samples with this gradient.
HWY_INLINE Floats GradientFactor(const RayLook& look, const Gradient& g) {
  const FloatTag df;
  const auto square = [&](Floats slope, std::size_t axis) HWY_ATTR {
    const auto physical = hn::Mul(slope, Set(look.inverse_spacing[axis]));
    return hn::Mul(physical, physical);
  };
  const auto magnitude = hn::Sqrt(hn::Add(hn::Add(square(g.x, 0), square(g.y, 1)), square(g.z, 2)));
  const auto finite = hn::Le(magnitude, Set(std::numeric_limits<float>::max()));
  const auto number =
      hn::Min(hn::MulAdd(hn::IfThenElseZero(finite, magnitude), Set(look.gradient_scale), Set(0.5F)), Set(look.gradient_last));
  return hn::GatherIndex(df, look.gradient_factors.data(), hn::ConvertTo(IntTag(), number));
}

// Adds the crossings of rays with isosurfaces up to `before`, in samples. Returns how many.
template <class T>
HWY_NOINLINE std::uint64_t AddSurfaces(const MarchWork& work, Mask rays, Floats before, SurfaceWalk<T>& walk, Sums& sums) {
  const FloatTag df;
  const RayLook& look = *work.look;
  const auto opaque = Set(1 - work.termination);
  const auto due = [&]() HWY_ATTR {
    return hn::And(rays, hn::And(hn::And(hn::Le(walk.at(), before), hn::Lt(walk.at(), Set(kRayEnd))), hn::Lt(sums.alpha, opaque)));
  };
  std::uint64_t count = 0;
  for (auto crossing = due(); !hn::AllFalse(df, crossing); crossing = due()) {
    count += hn::CountTrue(df, crossing);
    Light light = {Set(1), hn::Zero(df)};
    if (look.phong) light = LightOf(look, GradientAt(LoadNeighbours<T>(*work.box, walk.place(), crossing), walk.place()));
    const float* const colors = look.surface_looks.data();
    sums.Add(crossing, hn::GatherIndex(df, colors + 3, walk.look()), colors, walk.look(), light);
    walk.Next(crossing);
  }
  return count;
}

// Samples `owned` of the rays. kAll: with all that a frame may ask for (cuts, isosurfaces, gradient opacity); the samples lie in `part`.
// Otherwise only a transfer function, and `part` is null: one switch, so that a plain frame does not pay for any of these. Returns how many
// samples were shaded.
template <class T, bool kAll>
HWY_INLINE std::uint64_t MarchSamples(const MarchWork& work, const RayPacket& packet, const LeapScales& leaps, const SampleInterval& owned,
                                      const PacketPart* part, Sums& gathered) {
  const FloatTag df;
  const IntTag di;
  const RayBox& box = *work.box;
  const RayLook& look = *work.look;
  const auto zero = hn::Zero(df), one = Set(1);
  // A ray ends when it transmits less.
  const auto opaque = Set(1 - work.termination);
  const float* const entries = look.entries.data();

  // Each ray advances separately: its next sample is k.
  auto k = owned.begin;
  auto alive = hn::Lt(k, owned.end);
  std::uint64_t shaded = 0;
  SurfaceWalk<T> surfaces(work, packet);
  const bool has_surfaces = kAll && !look.isovalues.empty();
  if constexpr (kAll) {
    alive = hn::And(alive, hn::Lt(gathered.alpha, opaque));
    if (!look.volume_shows) alive = hn::Lt(one, zero);
    if (has_surfaces) surfaces.Start(*part);
  }
  if (!has_surfaces && hn::AllFalse(df, alive)) return 0;
  const bool has_ends = kAll || box.at_border;
  EndSamples ends{zero, zero, zero, zero};
  if (has_ends) ends = EndSamplesOf(*work.rays, packet, leaps, part);

  Sums sums = gathered;
  bool in_matter = false;  // most of the last samples were visible
  while (!hn::AllFalse(df, alive)) {
    const SamplePlace place = PlaceSample(packet, box, k);
    // Rays in empty space leap ahead; the others go on to their next sample.
    auto sampled = alive;
    auto steps = one;
    if (!in_matter) {
      const auto cell = CellOf<kCellShift>(place, box.cells, alive);
      const auto distance = hn::And(hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(work.empty_distance), cell), SetInt(0xFF));
      const auto empty = hn::RebindMask(df, hn::Gt(distance, hn::Zero(di)));
      sampled = hn::AndNot(empty, alive);
      steps = hn::IfThenElse(empty, StepsWithin<kCellShift>(box, leaps, place, hn::ConvertTo(df, distance)), one);
    }
    const auto this_k = k;
    k = hn::Add(k, steps);
    alive = hn::And(alive, hn::Lt(k, owned.end));
    if (hn::AllFalse(df, sampled)) continue;

    const Neighbours<T> neighbours = LoadNeighbours<T>(box, place, sampled);
    const auto value = Interpolate(neighbours, place);
    const auto finite = hn::Le(hn::Abs(value), Set(std::numeric_limits<float>::max()));
    const auto entry = EntryOf(look, value, finite);
    auto opacity = hn::GatherIndex(df, entries + 3, entry);
    const auto visible = hn::And(hn::And(sampled, finite), hn::Gt(opacity, zero));
    const std::size_t count = hn::CountTrue(df, visible);
    in_matter = count > kLanes / 2;
    if (count == 0) continue;
    shaded += count;
    if constexpr (kAll) {
      if (has_surfaces) shaded += AddSurfaces<T>(work, visible, this_k, surfaces, sums);
    }

    Gradient gradient = {zero, zero, zero};
    const bool by_gradient = kAll && !look.gradient_factors.empty();
    if (look.phong || by_gradient) gradient = GradientAt(neighbours, place);
    if (by_gradient) opacity = hn::Mul(opacity, GradientFactor(look, gradient));
    if (has_ends || by_gradient) {
      const auto is_first = hn::Eq(this_k, ends.first), is_last = hn::Eq(this_k, ends.last);
      if (by_gradient || !hn::AllFalse(df, hn::And(visible, hn::Or(is_first, is_last)))) {
        const auto steps_of_first = hn::Add(one, hn::IfThenElseZero(is_first, ends.first_excess));
        auto power = hn::Add(steps_of_first, hn::IfThenElseZero(is_last, ends.last_excess));
        if (by_gradient) power = hn::Mul(power, Set(look.step_exponent));
        opacity = hn::Sub(one, PowerOfFraction(hn::Sub(one, opacity), power));
      }
    }
    Light light = {one, zero};
    if (look.phong) {
      if constexpr (kAll) {
        const auto on_face = hn::Lt(this_k, part->face_end);
        gradient = {hn::IfThenElse(on_face, part->face[0], gradient.x), hn::IfThenElse(on_face, part->face[1], gradient.y),
                    hn::IfThenElse(on_face, part->face[2], gradient.z)};
      }
      light = LightOf(look, gradient);
    }
    sums.Add(visible, opacity, entries, entry, light);
    alive = hn::And(alive, hn::Lt(sums.alpha, opaque));
  }
  if constexpr (kAll) {
    if (has_surfaces) shaded += AddSurfaces<T>(work, packet.valid, Set(kRayEnd), surfaces, sums);
  }
  gathered = sums;
  return shaded;
}

// Apart from plain frames, so that these have the registers for themselves.
template <class T>
HWY_NOINLINE std::uint64_t MarchParts(const MarchWork& work, const RayPacket& packet, const LeapScales& leaps, const SampleInterval& owned,
                                      Sums& sums) {
  PacketPart parts[2];
  PartsOf(work.rays->clip, packet, parts);
  std::uint64_t shaded = 0;
  for (const PacketPart& part : parts) shaded += MarchSamples<T, true>(work, packet, leaps, part.Of(owned), &part, sums);
  return shaded;
}

// The rays of one packet.
template <class T>
HWY_INLINE std::uint64_t MarchPacket(const MarchWork& work, const RayPacket& packet, float* HWY_RESTRICT rgba) {
  const auto zero = hn::Zero(FloatTag());
  const SampleInterval owned = OwnedSamples(packet, *work.box);
  const LeapScales leaps = LeapScalesOf(packet);
  Sums sums = {zero, zero, zero, zero};
  std::uint64_t shaded = 0;
  if (work.rays->clip.empty() && work.look->isovalues.empty() && work.look->gradient_factors.empty()) {
    shaded = MarchSamples<T, false>(work, packet, leaps, owned, nullptr, sums);
  } else {
    shaded = MarchParts<T>(work, packet, leaps, owned, sums);
  }
  if (shaded != 0) hn::StoreInterleaved4(sums.red, sums.green, sums.blue, sums.alpha, FloatTag(), rgba);
  return shaded;
}

template <class T>
std::uint64_t March(const MarchWork& work, const PixelBounds& tile, float* HWY_RESTRICT rgba, std::size_t floats_a_row) {
  std::uint64_t shaded = 0;
  ForEachPacket(*work.rays, tile, rgba, floats_a_row, [&](const RayPacket& packet, float* HWY_RESTRICT pixels) HWY_ATTR {
    const std::uint64_t found = MarchPacket<T>(work, packet, pixels);
    shaded += found;
    return found != 0;
  });
  return shaded;
}

std::uint64_t MarchAny(const MarchWork& work, const PixelBounds& tile, float* rgba, std::size_t floats_a_row) {
  switch (work.box->type) {
    case ScalarType::kUint8: return March<std::uint8_t>(work, tile, rgba, floats_a_row);
    case ScalarType::kUint16: return March<std::uint16_t>(work, tile, rgba, floats_a_row);
    case ScalarType::kFloat32: break;
  }
  return March<float>(work, tile, rgba, floats_a_row);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(MarchAny);

std::uint64_t MarchTile(const MarchWork& work, const PixelBounds& tile, float* rgba, std::size_t floats_a_row) {
  return HWY_DYNAMIC_DISPATCH(MarchAny)(work, tile, rgba, floats_a_row);
}

}  // namespace slabstream
#endif
