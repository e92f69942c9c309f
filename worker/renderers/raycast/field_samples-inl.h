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
  const FrameLight::View* light;  // MarchWork::light
  Mask on_face;
  const Floats (&face)[3];  // there: the face's normal among the volume's voxels
};

// Adds samples of a field. `entry`: EntryOf.
HWY_INLINE void MixSamples(const RayField& field, const FieldPlace& at, Mask visible, const LaneNumbers& entry, Gradient gradient,
                           Mixture& mixture) {
  const FloatTag df;
  const RayLook& look = *field.look;
  const Entries entries = EntriesAt(look.entries.data(), entry);
  const auto& opacity = entries.of[3];
  visible = hn::And(visible, hn::Gt(opacity, hn::Zero(df)));
  if (hn::AllFalse(df, visible)) return;
  Light light = {Set(1), hn::Zero(df)};
  if (look.phong || at.light != nullptr) {
    if (!hn::AllFalse(df, at.on_face)) {
      const auto face = [&](std::size_t i) HWY_ATTR { return Combined(field.normals, at.face, i); };
      gradient = Choose(at.on_face, {face(0), face(1), face(2)}, gradient);
    }
    light = LightOn(look, at.light, gradient, [&]() HWY_ATTR { return at.of_volume; });
  }
  if (field.over) {
    const bool by_step = field.steps_a_length == 1;
    mixture.Cover(visible, by_step ? opacity : hn::Sub(Set(1), PowerOfFraction(hn::Sub(Set(1), opacity), Set(field.steps_a_length))));
  }
  mixture.Add(visible, opacity, [&](std::size_t channel) HWY_ATTR { return Sums::Lit(entries.of[channel], light); });
}

// The samples of `sampled` that lie where a field shows.
HWY_INLINE Mask WithinField(const RayField& field, const SamplePlace& place, Mask sampled) {
  if (field.map.everywhere) return sampled;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& p = place.position[i];
    sampled = hn::And(sampled, hn::And(hn::Ge(p, Set(field.map.low[i])), hn::Lt(p, Set(field.map.high[i]))));
  }
  return sampled;
}

// The place of samples of the volume among the voxels of a field on its grid.
HWY_INLINE SamplePlace Shifted(const RayField& field, SamplePlace place) {
  for (std::size_t i = 0; i < 3; ++i) place.voxel[i] = hn::Add(place.voxel[i], SetInt(field.shift[int(i)]));
  return place;
}

// Calls with(a sample) for the type of a field's samples.
template <class With>
HWY_INLINE void WithSampleOf(const RayField& field, With&& with) {
  switch (field.voxels.type) {
    case ScalarType::kUint8: return with(std::uint8_t());
    case ScalarType::kUint16: return with(std::uint16_t());
    default: return with(float());
  }
}

// Sets EntryOf where samples are finite; returns where.
template <class T>
HWY_INLINE Mask SetEntry(const RayField& field, Floats value, LaneNumbers& entry) {
  const auto finite = FiniteOf<T>(value);
  if constexpr (std::is_same_v<T, float>) {
    entry.Set(EntryOf(*field.look, value, finite));
  } else {
    entry.Set(EntryOf(*field.look, value));
  }
  return finite;
}

// Adds what a field has of the samples that are `sampled`. `among`: AmongVoxels, unless it is on the volume's grid.
HWY_NOINLINE void MixField(const RayField& field, const FieldPlace& at, Mask sampled, const RayPacket& among, GradientBricks& bricks,
                           Mixture& mixture) {
  const SamplePlace place = field.on_same_grid ? Shifted(field, at.of_volume) : PlaceSample(among, field.voxels, at.k);
  sampled = WithinField(field, place, sampled);
  if (hn::AllFalse(FloatTag(), sampled)) return;
  WithSampleOf(field, [&](auto type) HWY_ATTR {
    using Type = decltype(type);
    BrickPlace found;
    FindInBricks<Type>(field.voxels, place, sampled, bricks, found, found);
    const LitSample sample = ReadBricks<Type>(bricks, found.corner, BrickWeights(place));
    LaneNumbers entry;
    const Mask finite = SetEntry<Type>(field, sample.value, entry);
    MixSamples(field, at, hn::And(sampled, finite), entry, sample.gradient, mixture);
  });
}

// RayFields::shown at samples; 0 where not `sampled`.
HWY_INLINE Ints ShownAt(const RayFields& fields, const RayBox& box, const SamplePlace& place, Mask sampled) {
  const IntTag di;
  const auto cell = CellOf<kCellShift>(place, box.cells, sampled);
  const auto shown = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(fields.shown), hn::Add(cell, cell));
  return hn::IfThenElseZero(hn::RebindMask(di, sampled), hn::And(shown, SetInt(0xFFFF)));
}
// Where a field may show.
HWY_INLINE Mask ShowsField(Ints shown, std::size_t number) {
  return hn::RebindMask(FloatTag(), hn::TestBit(shown, SetInt(RayFields::kVolume << number)));
}

// Adds what all fields but the volume have of samples. `shown`: as in RayFields, 0 where there is no sample. `among`, `bricks`: by field.
HWY_NOINLINE void MixFields(const RayFields& fields, const FieldPlace& at, Ints shown, const RayPacket* among, GradientBricks* bricks,
                            Mixture& mixture) {
  for (std::size_t i = 1; i < fields.fields.size(); ++i) {
    const Mask sampled = ShowsField(shown, i);
    if (!hn::AllFalse(FloatTag(), sampled)) MixField(fields.fields[i], at, sampled, among[i], bricks[i], mixture);
  }
}

// Samples of the volume and of all other fields. Those at the volume's own places are found and read a step ahead each, so that the voxels
// of one field are waited for while others are at work; others are read when they are mixed.
struct FieldSamples {
  struct Found {
    BrickPlace of[kMaxShownFields];
  };
  LitSample of[kMaxShownFields];
  LaneNumbers entry[kMaxShownFields];

  static HWY_INLINE Found Nowhere() {
    Found found;
    for (BrickPlace& of : found.of) of.number = hn::Zero(IntTag());
    return found;
  }

  static HWY_INLINE void Find(const RayFields& fields, const SamplePlace& place, Ints shown, GradientBricks* bricks, Found& found,
                              Found& before) {
    for (std::size_t i = 0; i < fields.fields.size(); ++i) {
      const RayField& field = fields.fields[i];
      found.of[i].number = hn::Zero(IntTag());
      const Mask sampled = ShowsField(shown, i);
      if (hn::AllFalse(FloatTag(), sampled) || !field.on_same_grid) continue;
      const Mask within = WithinField(field, place, sampled);
      WithSampleOf(field, [&](auto type) SLABSTREAM_INLINED {
        FindInBricks<decltype(type)>(field.voxels, Shifted(field, place), within, bricks[i], found.of[i], before.of[i]);
      });
    }
  }
  HWY_INLINE void Read(const RayFields& fields, const CellPlace& place, Ints shown, GradientBricks* bricks, const Found& found) {
    const BrickWeights weights(place);
    for (std::size_t i = 0; i < fields.fields.size(); ++i) {
      const RayField& field = fields.fields[i];
      if (hn::AllFalse(FloatTag(), ShowsField(shown, i)) || !field.on_same_grid) continue;
      WithSampleOf(field, [&](auto type) SLABSTREAM_INLINED {
        of[i] = ReadBricks<decltype(type)>(bricks[i], found.of[i].corner, weights);
        SetEntry<decltype(type)>(field, of[i].value, entry[i]);
      });
    }
  }
  HWY_INLINE void Mix(const RayFields& fields, const FieldPlace& at, Ints shown, const RayPacket* among, GradientBricks* bricks,
                      Mixture& mixture) const {
    for (std::size_t i = 0; i < fields.fields.size(); ++i) {
      const RayField& field = fields.fields[i];
      const Mask sampled = ShowsField(shown, i);
      if (hn::AllFalse(FloatTag(), sampled)) continue;
      if (field.on_same_grid) {
        const Mask within = WithinField(field, at.of_volume, sampled);
        MixSamples(field, at, hn::And(within, FiniteOf<float>(of[i].value)), entry[i], of[i].gradient, mixture);
      } else {
        Mixture so_far = mixture;  // a call that takes its address would keep `mixture` out of registers
        MixField(field, at, sampled, among[i], bricks[i], so_far);
        mixture = so_far;
      }
    }
  }
};

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
