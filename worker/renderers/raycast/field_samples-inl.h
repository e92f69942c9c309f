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

// Adds samples of a field. `entry`: EntryOf; gradient_of(): theirs, asked for where one is visible.
template <class GradientOf>
HWY_INLINE void MixSamples(const RayField& field, const FieldPlace& at, Mask visible, const LaneNumbers& entry, GradientOf&& gradient_of,
                           Mixture& mixture) {
  const FloatTag df;
  const RayLook& look = *field.look;
  const Entries entries = EntriesAt(look.entries.data(), entry);
  const auto& opacity = entries.part[3];
  visible = hn::And(visible, hn::Gt(opacity, hn::Zero(df)));
  if (hn::AllFalse(df, visible)) return;
  Light light = {Set(1), hn::Zero(df)};
  if (look.phong || at.light != nullptr) {
    Gradient gradient = gradient_of();
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

// Calls with(a sample) for the type of a field's bricks. False: it has none.
template <class With>
HWY_INLINE bool WithBricks(const RayField& field, With&& with) {
  if (field.voxels.type == ScalarType::kUint8) {
    with(std::uint8_t());
  } else if (field.voxels.type == ScalarType::kUint16) {
    with(std::uint16_t());
  } else {
    return false;
  }
  return true;
}

// Adds what a field has of the samples that are `sampled`. `among`: AmongVoxels, unless it is on the volume's grid.
HWY_NOINLINE void MixField(const RayField& field, const FieldPlace& at, Mask sampled, const RayPacket& among, GradientBricks& bricks,
                           Mixture& mixture) {
  const FloatTag df;
  const SamplePlace place = field.on_same_grid ? Shifted(field, at.of_volume) : PlaceSample(among, field.voxels, at.k);
  sampled = WithinField(field, place, sampled);
  if (hn::AllFalse(df, sampled)) return;
  LaneNumbers entry;
  const bool has_bricks = WithBricks(field, [&](auto type) HWY_ATTR {
    using Type = decltype(type);
    BrickPlace found;
    FindInBricks<Type>(field.voxels, place, sampled, bricks, found, found);
    const LitSample sample = InterpolateCorners<Type>(bricks.corners(), found.corner, WeightsAt(place));
    entry.Set(EntryOf(*field.look, sample.value));
    MixSamples(
        field, at, sampled, entry, [&]() HWY_ATTR { return sample.gradient; }, mixture);
  });
  if (has_bricks) return;
  const Neighbours<float> neighbours = LoadNeighbours<float>(field.voxels, place, sampled);
  const auto value = Interpolate(neighbours, place);
  const auto finite = hn::Le(hn::Abs(value), Set(std::numeric_limits<float>::max()));
  entry.Set(EntryOf(*field.look, value, finite));
  MixSamples(
      field, at, hn::And(sampled, finite), entry, [&]() HWY_ATTR { return GradientAt(neighbours, place); }, mixture);
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

// Samples of the volume and of all other fields. Those in bricks at the volume's own places are found and read a step ahead each, so that
// the voxels of one field are waited for while others are at work; others are read when they are mixed.
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
  static HWY_INLINE bool Ahead(const RayField& field) { return field.on_same_grid && field.voxels.type != ScalarType::kFloat32; }

  static HWY_INLINE void Find(const RayFields& fields, const SamplePlace& place, Ints shown, GradientBricks* bricks, Found& found,
                              Found& before) {
    for (std::size_t i = 0; i < fields.fields.size(); ++i) {
      const RayField& field = fields.fields[i];
      found.of[i].number = hn::Zero(IntTag());
      const Mask sampled = ShowsField(shown, i);
      if (hn::AllFalse(FloatTag(), sampled) || !Ahead(field)) continue;
      const Mask within = WithinField(field, place, sampled);
      WithBricks(field, [&](auto type) SLABSTREAM_INLINED {
        FindInBricks<decltype(type)>(field.voxels, Shifted(field, place), within, bricks[i], found.of[i], before.of[i]);
      });
    }
  }
  HWY_INLINE void Read(const RayFields& fields, const CellPlace& place, Ints shown, GradientBricks* bricks, const Found& found) {
    const CornerWeights weights = WeightsAt(place);
    for (std::size_t i = 0; i < fields.fields.size(); ++i) {
      const RayField& field = fields.fields[i];
      if (hn::AllFalse(FloatTag(), ShowsField(shown, i)) || !Ahead(field)) continue;
      WithBricks(field, [&](auto type) SLABSTREAM_INLINED {
        of[i] = InterpolateCorners<decltype(type)>(bricks[i].corners(), found.of[i].corner, weights);
      });
      entry[i].Set(EntryOf(*field.look, of[i].value));
    }
  }
  HWY_INLINE void Mix(const RayFields& fields, const FieldPlace& at, Ints shown, const RayPacket* among, GradientBricks* bricks,
                      Mixture& mixture) const {
    for (std::size_t i = 0; i < fields.fields.size(); ++i) {
      const RayField& field = fields.fields[i];
      const Mask sampled = ShowsField(shown, i);
      if (hn::AllFalse(FloatTag(), sampled)) continue;
      if (Ahead(field)) {
        MixSamples(
            field, at, WithinField(field, at.of_volume, sampled), entry[i], [&]() HWY_ATTR { return of[i].gradient; }, mixture);
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
