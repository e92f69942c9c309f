// Labels along rays, and how they change the sample of the volume. Included once for each instruction set, hence the unusual
// include guard.
#include "worker/kernels/power-inl.h"
#include "worker/rays/sample_look-inl.h"
#include "worker/renderers/raycast/ray_labels.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_RAYCAST_LABEL_SAMPLES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_RAYCAST_LABEL_SAMPLES_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_RAYCAST_LABEL_SAMPLES_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_RAYCAST_LABEL_SAMPLES_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// Four numbers of labels along x, from the voxel with index `at` on.
struct LabelRow {
  Ints numbers[4];
};
HWY_INLINE LabelRow LoadLabelRow(const RayBox& voxels, Ints at) {
  const IntTag di;
  const auto* const words = reinterpret_cast<const std::int32_t*>(voxels.samples);
  if (voxels.type == ScalarType::kUint8) {
    const auto word = hn::GatherOffset(di, words, at), byte = SetInt(0xFF);
    return {{hn::And(word, byte), hn::And(hn::ShiftRight<8>(word), byte), hn::And(hn::ShiftRight<16>(word), byte),
             hn::And(hn::ShiftRight<24>(word), byte)}};
  }
  if (voxels.type == ScalarType::kUint16) {
    const auto offset = hn::Add(at, at), low = SetInt(0xFFFF);
    const auto first = hn::GatherOffset(di, words, offset), second = hn::GatherOffset(di, words + 1, offset);
    return {{hn::And(first, low), hn::And(hn::ShiftRight<16>(first), low), hn::And(second, low), hn::And(hn::ShiftRight<16>(second), low)}};
  }
  return {{hn::GatherIndex(di, words, at), hn::GatherIndex(di, words + 1, at), hn::GatherIndex(di, words + 2, at),
           hn::GatherIndex(di, words + 3, at)}};
}

// Where samples of the volume lie among the labels.
struct LabelPlace {
  Ints at;  // as in Neighbours; 0 where not `there`
  Floats fraction[3];
  Mask there;  // the labels reach there
};
HWY_INLINE LabelPlace PlaceAmong(const RayLabels& labels, const RayBox& box, const SamplePlace& place, Mask sampled) {
  const FloatTag df;
  LabelPlace found;
  Floats volume[3];
  for (std::size_t i = 0; i < 3; ++i) {
    volume[i] = hn::Add(hn::ConvertTo(df, hn::Add(place.voxel[i], SetInt(box.origin[int(i)]))), place.fraction[i]);
  }
  Ints voxel[3];
  found.there = sampled;
  for (std::size_t i = 0; i < 3; ++i) {
    auto position = hn::Add(Set(labels.offset[i]), hn::Mul(volume[0], Set(labels.steps[0][i])));
    position = hn::Add(position, hn::Mul(volume[1], Set(labels.steps[1][i])));
    position = hn::Add(position, hn::Mul(volume[2], Set(labels.steps[2][i])));
    const auto floor = hn::Floor(position);
    found.fraction[i] = hn::Sub(position, floor);
    voxel[i] = hn::Sub(Truncated(floor), SetInt(labels.voxels.origin[int(i)]));
    found.there = hn::And(found.there, hn::And(hn::Ge(position, Set(labels.low[i])), hn::Lt(position, Set(labels.high[i]))));
  }
  const auto at = hn::Add(hn::Add(hn::Mul(voxel[2], SetInt(labels.voxels.slice)), hn::Mul(voxel[1], SetInt(labels.voxels.row))), voxel[0]);
  found.at = hn::IfThenElseZero(hn::RebindMask(IntTag(), found.there), at);
  return found;
}

// The number of the voxel nearest to each sample; 0 where there are no labels.
HWY_INLINE Ints NearestLabel(const RayLabels& labels, const LabelPlace& place) {
  const IntTag di;
  const auto half = Set(0.5F);
  const auto upper = [&](std::size_t i) HWY_ATTR { return hn::RebindMask(di, hn::Ge(place.fraction[i], half)); };
  const auto one_or_two = [&](std::size_t i, std::int32_t stride)
                              HWY_ATTR { return hn::IfThenElse(upper(i), SetInt(2 * stride), SetInt(stride)); };
  const auto row = hn::Add(hn::Add(place.at, one_or_two(1, labels.voxels.row)), one_or_two(2, labels.voxels.slice));
  const LabelRow found = LoadLabelRow(labels.voxels, row);
  return hn::IfThenElseZero(hn::RebindMask(di, place.there), hn::IfThenElse(upper(0), found.numbers[2], found.numbers[1]));
}

// The gradient of the indicator of each sample's label (1 in its voxels, 0 elsewhere), smoothed by the cubic B-spline (Unser 1999) over the
// 4 x 4 x 4 voxels around, along the volume's axes. 0 where there is hardly any: inside the label.
HWY_INLINE Gradient IndicatorGradientAt(const RayLabels& labels, const LabelPlace& place, Ints label) {
  const FloatTag df;
  const auto zero = hn::Zero(df), one = Set(1);
  struct Spline {
    Floats value[4], slope[4];
  };
  Spline along[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const auto t = place.fraction[i], u = hn::Sub(one, t), sixth = Set(1.0F / 6), half = Set(0.5F);
    const auto cubic = [&](Floats v) HWY_ATTR { return hn::Mul(sixth, hn::Mul(v, hn::Mul(v, v))); };
    // The middle two weights are 2/3 - v^2 + v^3 / 2 at the distance v.
    const auto middle = [&](Floats v) HWY_ATTR { return hn::Add(Set(2.0F / 3), hn::Mul(hn::Mul(v, v), hn::Sub(hn::Mul(half, v), one))); };
    const auto middle_slope = [&](Floats v) HWY_ATTR { return hn::Mul(v, hn::Sub(hn::Mul(Set(1.5F), v), Set(2))); };
    Spline& s = along[i];
    s.value[0] = cubic(u);
    s.value[1] = middle(t);
    s.value[2] = middle(u);
    s.value[3] = cubic(t);
    s.slope[0] = hn::Neg(hn::Mul(half, hn::Mul(u, u)));
    s.slope[1] = middle_slope(t);
    s.slope[2] = hn::Neg(middle_slope(u));
    s.slope[3] = hn::Mul(half, hn::Mul(t, t));
  }
  Gradient g = {zero, zero, zero};
  auto slice = place.at;
  for (int z = 0; z < 4; ++z, slice = hn::Add(slice, SetInt(labels.voxels.slice))) {
    auto row = slice;
    for (int y = 0; y < 4; ++y, row = hn::Add(row, SetInt(labels.voxels.row))) {
      const LabelRow around = LoadLabelRow(labels.voxels, row);
      auto value = zero, slope = zero;
      for (int x = 0; x < 4; ++x) {
        const auto same = hn::RebindMask(df, hn::Eq(around.numbers[x], label));
        value = hn::Add(value, hn::IfThenElseZero(same, along[0].value[x]));
        slope = hn::Add(slope, hn::IfThenElseZero(same, along[0].slope[x]));
      }
      const auto value_z = hn::Mul(value, along[2].value[z]);
      g.x = hn::Add(g.x, hn::Mul(hn::Mul(slope, along[1].value[y]), along[2].value[z]));
      g.y = hn::Add(g.y, hn::Mul(value_z, along[1].slope[y]));
      g.z = hn::Add(g.z, hn::Mul(hn::Mul(value, along[1].value[y]), along[2].slope[z]));
    }
  }
  const auto square = hn::Add(hn::Add(hn::Mul(g.x, g.x), hn::Mul(g.y, g.y)), hn::Mul(g.z, g.z));
  const auto any = hn::Gt(square, Set(1e-4F));
  const auto of_volume = [&](std::size_t i) HWY_ATTR {
    const Float3& step = labels.steps[i];
    const auto sum = hn::Add(hn::Add(hn::Mul(g.x, Set(step[0])), hn::Mul(g.y, Set(step[1]))), hn::Mul(g.z, Set(step[2])));
    return hn::IfThenElseZero(any, sum);
  };
  return {of_volume(0), of_volume(1), of_volume(2)};
}

// Samples after the labels have had their say. Lanes that are not `sampled` mean nothing.
struct LabelledSample {
  LabelPlace place;
  Floats opacity;
  // The share of a label's colour in the volume's part: that part has (1 - tint) times the volume's colour and tint
  // times the colour of `entry`. A label that is matter has a tint of 1.
  Floats tint;
  Ints label;   // number
  Ints entry;   // index into LabelTables::entries
  Mask matter;  // the label is the material
};

// `opacity`: of the volume's sample, 0 where it has none.
HWY_INLINE LabelledSample WithLabels(const RayLabels& labels, const RayBox& box, const SamplePlace& place, Mask sampled, Floats opacity) {
  const FloatTag df;
  const auto zero = hn::Zero(df), one = Set(1);
  const LabelTables& tables = labels.tables;
  LabelledSample sample;
  sample.place = PlaceAmong(labels, box, place, sampled);
  sample.label = NearestLabel(labels, sample.place);
  sample.entry = hn::ShiftLeft<2>(sample.label);
  const auto changed = hn::GatherIndex(df, tables.entries.data() + 3, sample.entry);
  const auto shown = hn::Ge(changed, zero);
  if (tables.surface) {
    sample.matter = shown;
    sample.opacity = hn::IfThenElse(shown, changed, opacity);
    sample.tint = hn::IfThenElseZero(shown, one);
    return sample;
  }
  sample.matter = hn::Lt(one, zero);
  sample.tint = hn::IfThenElseZero(shown, Set(tables.tint));
  sample.opacity = hn::IfThenElseZero(hn::Ne(changed, zero), opacity);
  const auto thinned = hn::And(hn::And(shown, hn::Lt(changed, one)), hn::Gt(sample.opacity, zero));
  if (!hn::AllFalse(df, thinned)) {
    const auto steps = Set(tables.steps_a_length);
    const auto of_length = hn::Sub(one, PowerOfFraction(hn::Sub(one, opacity), steps));
    const auto of_step = hn::Sub(one, PowerOfFraction(hn::Sub(one, hn::Mul(changed, of_length)), hn::Div(one, steps)));
    sample.opacity = hn::IfThenElse(thinned, of_step, sample.opacity);
  }
  return sample;
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
