// What lies on a ray, composited front to back: EndSamples, Sums, and fragments of shapes among samples. Included once for each instruction
// set, hence the unusual include guard.
#include "worker/rays/sample_look-inl.h"

#if defined(SLABSTREAM_WORKER_RAYS_RAY_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RAYS_RAY_SUMS_INL_H_
#undef SLABSTREAM_WORKER_RAYS_RAY_SUMS_INL_H_
#else
#define SLABSTREAM_WORKER_RAYS_RAY_SUMS_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

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
    red = hn::MulAdd(weight, Lit(hn::GatherIndex(df, colors, entry), light), red);
    green = hn::MulAdd(weight, Lit(hn::GatherIndex(df, colors + 1, entry), light), green);
    blue = hn::MulAdd(weight, Lit(hn::GatherIndex(df, colors + 2, entry), light), blue);
    alpha = hn::Add(alpha, weight);
  }
  // `color(channel)`: what the light makes of red, green and blue.
  template <class Color>
  HWY_INLINE void AddChannels(Mask rays, Floats opacity, Color&& color) {
    const auto weight = hn::IfThenElseZero(rays, hn::Mul(hn::Sub(Set(1), alpha), opacity));
    red = hn::MulAdd(weight, color(0), red);
    green = hn::MulAdd(weight, color(1), green);
    blue = hn::MulAdd(weight, color(2), blue);
    alpha = hn::Add(alpha, weight);
  }
  // Where light adds, colours may have more than a picture can show.
  HWY_INLINE void LimitColors() {
    for (Floats* color : {&red, &green, &blue}) *color = hn::Min(*color, Set(1));
  }
  static HWY_INLINE Floats Lit(Floats color, const Light& light) {
    return hn::Min(hn::Max(hn::MulAdd(color, light.diffuse, light.specular), hn::Zero(FloatTag())), Set(1));
  }
};

// Adds the fragments of one layer. Their opacity is that of a surface, whatever the length of a step.
HWY_INLINE void AddFragments(const PacketShapes::Layer& layer, Floats opaque, Sums& sums) {
  const FloatTag df;
  const auto alpha = hn::Load(df, layer.alpha.data());
  const auto shown = hn::And(hn::Gt(alpha, hn::Zero(df)), hn::Lt(sums.alpha, opaque));
  sums.AddChannels(shown, alpha, [&](std::size_t channel) HWY_ATTR { return hn::Load(df, layer.color[channel].data()); });
}

// Calls march(part) for what lies between the fragments of each of the two parts of the rays, nearest first, and adds the fragments in
// between. `shapes`: null: there are none. `opaque`: the alpha at which a ray ends.
template <class March>
HWY_INLINE void MarchAmongFragments(const PacketShapes* shapes, const PacketPart (&parts)[2], Floats opaque, Sums& sums, March&& march) {
  const FloatTag df;
  const std::size_t layers = shapes == nullptr ? 0 : shapes->count;
  const auto ends = shapes == nullptr ? Set(kRayEnd) : hn::Load(df, shapes->ends.data());
  auto from = Set(-kRayEnd);
  for (std::size_t layer = 0; layer <= layers; ++layer) {
    const auto to = layer == layers ? ends : hn::Min(hn::Load(df, shapes->layers[layer].k.data()), ends);
    for (const PacketPart& part : parts) march(Between(part, from, to));
    if (layer < layers) AddFragments(shapes->layers[layer], opaque, sums);
    from = to;
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
