// Samples of several fields at one place, blended (docs/rendering.md). Included once for each instruction set, hence the unusual include
// guard.
//
//   a, c   opacity of one step and lit colour of a field's sample
//   A, C   sums of opacities and of opacities times colours
//   T      transmittance of a step of all fields together; alpha = 1 - T
#include <type_traits>

#include "worker/kernels/power-inl.h"
#include "worker/renderers/raycast/gradient_bricks-inl.h"
#include "worker/renderers/raycast/ray_fields.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_RAYCAST_FIELD_SAMPLES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_RAYCAST_FIELD_SAMPLES_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_RAYCAST_FIELD_SAMPLES_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_RAYCAST_FIELD_SAMPLES_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// What the fields of a step have together.
struct Mixture {
  Floats alpha, weight, color[3];  // alpha, A, C

  // Nothing.
  static HWY_INLINE Mixture Empty() {
    const auto zero = hn::Zero(FloatTag());
    return {zero, zero, {zero, zero, zero}};
  }
  // color(channel): c, anything where not `visible`.
  template <class Color>
  HWY_INLINE void Add(Mask visible, Floats opacity, Color&& of) {
    const auto a = hn::IfThenElseZero(visible, opacity);
    weight = hn::Add(weight, a);
    for (std::size_t i = 0; i < 3; ++i) color[i] = hn::Add(color[i], hn::IfThenElseZero(visible, hn::Mul(a, of(i))));
    alpha = hn::Add(alpha, hn::Mul(a, hn::Sub(Set(1), alpha)));
  }
  // Thins what is there by a share of 1 - `cover`, before the field that covers it is added.
  HWY_INLINE void Cover(Mask visible, Floats cover) {
    const FloatTag df;
    const auto one = Set(1), left = hn::Sub(one, hn::IfThenElseZero(visible, cover));
    weight = hn::Mul(weight, left);
    for (Floats& of : color) of = hn::Mul(of, left);
    const auto thinned = hn::And(visible, hn::And(hn::Gt(alpha, hn::Zero(df)), hn::Lt(alpha, one)));
    if (hn::AllFalse(df, thinned)) return;
    alpha = hn::IfThenElse(thinned, hn::Sub(one, PowerOfFraction(hn::Sub(one, alpha), left)), alpha);
  }
  // The factor of `color` that makes it straight.
  HWY_INLINE Floats Straight(bool flat) const {
    const auto sum = flat ? alpha : weight;
    return hn::Div(Set(1), hn::IfThenElse(hn::Gt(sum, hn::Zero(FloatTag())), sum, Set(1)));
  }
};

// The samples at which fields are read.
struct FieldPlace {
  Floats k;
  const SamplePlace& of_volume;
  const CornerWeights& weights;   // of_volume's, for fields that have the same voxels
  const FrameLight::View* light;  // MarchWork::light
  Mask on_face;
  const Floats (&face)[3];  // there: the face's normal among the volume's voxels
};

// Adds what a field has of the samples that are `sampled`. `among`: AmongVoxels, unless it has the same voxels. kLit: by bricks.
template <class T, bool kLit>
HWY_NOINLINE void MixField(const RayField& field, const FieldPlace& at, Mask sampled, const RayPacket& among, GradientBricks& bricks,
                           Mixture& mixture) {
  const FloatTag df;
  const RayLook& look = *field.look;
  SamplePlace own;
  if (!field.among_same_voxels) own = PlaceSample(among, field.voxels, at.k);
  const SamplePlace& place = field.among_same_voxels ? at.of_volume : own;
  if (!field.map.everywhere) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& p = place.position[i];
      sampled = hn::And(sampled, hn::And(hn::Ge(p, Set(field.map.low[i])), hn::Lt(p, Set(field.map.high[i]))));
    }
    if (hn::AllFalse(df, sampled)) return;
  }
  Floats value;
  Gradient gradient;
  Neighbours<T> neighbours;
  if constexpr (kLit) {
    BrickPlace found;
    FindInBricks<T>(field.voxels, place, sampled, bricks, found, found);
    const LitSample sample = InterpolateCorners<T>(bricks.corners(), found.corner, field.among_same_voxels ? at.weights : WeightsAt(place));
    value = sample.value;
    gradient = sample.gradient;
  } else {
    neighbours = LoadNeighbours<T>(field.voxels, place, sampled);
    value = Interpolate(neighbours, place);
  }
  auto visible = sampled;
  LaneNumbers entry;
  if constexpr (std::is_same_v<T, float>) {
    const auto finite = hn::Le(hn::Abs(value), Set(std::numeric_limits<float>::max()));
    entry.Set(EntryOf(look, value, finite));
    visible = hn::And(visible, finite);
  } else {
    entry.Set(EntryOf(look, value));
  }
  const Entries entries = EntriesAt(look.entries.data(), entry);
  const auto& opacity = entries.part[3];
  visible = hn::And(visible, hn::Gt(opacity, hn::Zero(df)));
  if (hn::AllFalse(df, visible)) return;
  Light light = {Set(1), hn::Zero(df)};
  if (look.phong || at.light != nullptr) {
    if constexpr (!kLit) gradient = GradientAt(neighbours, place);
    if (!hn::AllFalse(df, at.on_face)) {
      const auto face = [&](std::size_t i) HWY_ATTR { return Combined(field.normals, at.face, i); };
      gradient = Choose(at.on_face, {face(0), face(1), face(2)}, gradient);
    }
    light = LightOn(look, at.light, gradient, at.of_volume);
  }
  if (field.over) {
    const bool by_step = field.steps_a_length == 1;
    mixture.Cover(visible, by_step ? opacity : hn::Sub(Set(1), PowerOfFraction(hn::Sub(Set(1), opacity), Set(field.steps_a_length))));
  }
  mixture.Add(visible, opacity, [&](std::size_t channel) HWY_ATTR { return Sums::Lit(entries.part[channel], light); });
}

// Adds what all fields have of samples. `shown`: as in RayFields, 0 where there is no sample. `among` and `bricks`: by field.
HWY_NOINLINE void MixFields(const RayFields& fields, const FieldPlace& at, Ints shown, const RayPacket* among, GradientBricks* bricks,
                            Mixture& mixture) {
  const FloatTag df;
  for (std::size_t i = 0; i < fields.fields.size(); ++i) {
    const RayField& field = fields.fields[i];
    const Mask sampled = hn::RebindMask(df, hn::TestBit(shown, SetInt(2 * RayFields::kVolume << i)));
    if (hn::AllFalse(df, sampled)) continue;
    const auto mix = [&](auto value, auto lit)
                         HWY_ATTR { MixField<decltype(value), lit()>(field, at, sampled, among[i], bricks[i], mixture); };
    const bool phong = field.look->phong;
    switch (field.voxels.type) {
      case ScalarType::kUint8: phong ? mix(std::uint8_t(), std::true_type()) : mix(std::uint8_t(), std::false_type()); break;
      case ScalarType::kUint16: phong ? mix(std::uint16_t(), std::true_type()) : mix(std::uint16_t(), std::false_type()); break;
      case ScalarType::kFloat32: mix(float(), std::false_type()); break;
    }
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
