// Labels along rays, and how they change the sample of the volume. Included once for each instruction set, hence the unusual
// include guard.
#include "common/frame/smooth_label.h"
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

// One number, of any voxel; reads no byte beyond the last one.
HWY_INLINE Ints LoadLabel(const RayBox& voxels, Ints at) {
  const IntTag di;
  const auto* const words = reinterpret_cast<const std::int32_t*>(voxels.samples);
  const std::int32_t count = voxels.slice * voxels.padded.z;
  if (voxels.type == ScalarType::kUint8) {
    const auto from = hn::Min(at, SetInt(count - 4));
    return hn::And(hn::Shr(hn::GatherOffset(di, words, from), hn::ShiftLeft<3>(hn::Sub(at, from))), SetInt(0xFF));
  }
  if (voxels.type == ScalarType::kUint16) {
    const auto from = hn::Min(at, SetInt(count - 2));
    return hn::And(hn::Shr(hn::GatherOffset(di, words, hn::Add(from, from)), hn::ShiftLeft<4>(hn::Sub(at, from))), SetInt(0xFFFF));
  }
  return hn::GatherIndex(di, words, at);
}

// Where samples of the volume lie among the labels.
struct LabelPlace {
  Ints at;        // as in Neighbours; 0 where not `there`
  Ints voxel[3];  // floor - RayBox::origin of the labels
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
  found.there = sampled;
  for (std::size_t i = 0; i < 3; ++i) {
    auto position = hn::Add(Set(labels.offset[i]), hn::Mul(volume[0], Set(labels.steps[0][i])));
    position = hn::Add(position, hn::Mul(volume[1], Set(labels.steps[1][i])));
    position = hn::Add(position, hn::Mul(volume[2], Set(labels.steps[2][i])));
    const auto floor = hn::Floor(position);
    found.fraction[i] = hn::Sub(position, floor);
    found.voxel[i] = hn::Sub(Truncated(floor), SetInt(labels.voxels.origin[int(i)]));
    found.there = hn::And(found.there, hn::And(hn::Ge(position, Set(labels.low[i])), hn::Lt(position, Set(labels.high[i]))));
  }
  const auto at = hn::Add(hn::Add(hn::Mul(found.voxel[2], SetInt(labels.voxels.slice)), hn::Mul(found.voxel[1], SetInt(labels.voxels.row))),
                          found.voxel[0]);
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

// Weights and slopes of the cubic B-spline (Unser 1999) for the four voxels around along one axis.
struct Spline {
  Floats value[4], slope[4];
};
HWY_INLINE Spline SplineAt(Floats t) {
  const auto one = Set(1), u = hn::Sub(one, t), sixth = Set(1.0F / 6), half = Set(0.5F);
  const auto cubic = [&](Floats v) HWY_ATTR { return hn::Mul(sixth, hn::Mul(v, hn::Mul(v, v))); };
  // The middle two weights are 2/3 - v^2 + v^3 / 2 at the distance v.
  const auto middle = [&](Floats v) HWY_ATTR { return hn::Add(Set(2.0F / 3), hn::Mul(hn::Mul(v, v), hn::Sub(hn::Mul(half, v), one))); };
  const auto middle_slope = [&](Floats v) HWY_ATTR { return hn::Mul(v, hn::Sub(hn::Mul(Set(1.5F), v), Set(2))); };
  return {{cubic(u), middle(t), middle(u), cubic(t)},
          {hn::Neg(hn::Mul(half, hn::Mul(u, u))), middle_slope(t), hn::Neg(middle_slope(u)), hn::Mul(half, hn::Mul(t, t))}};
}

// Calls use(y, z, row) for the 4 x 4 rows of voxels around samples.
template <class Use>
HWY_INLINE void ForEachRowAround(const RayLabels& labels, const LabelPlace& place, Use&& use) {
  auto slice = place.at;
  for (std::size_t z = 0; z < 4; ++z, slice = hn::Add(slice, SetInt(labels.voxels.slice))) {
    auto row = slice;
    for (std::size_t y = 0; y < 4; ++y, row = hn::Add(row, SetInt(labels.voxels.row))) use(y, z, LoadLabelRow(labels.voxels, row));
  }
}

// Opacities of labels (LabelTables::entries).
HWY_INLINE Floats OpacityOf(const RayLabels& labels, Ints numbers) {
  return hn::GatherIndex(FloatTag(), labels.tables.entries.data() + 3, hn::ShiftLeft<2>(numbers));
}

// The label of samples, and the opacity that decides about it where labels are smoothed; -1: no label is shown there.
struct LabelThere {
  Ints number;
  Floats opacity;
};

// As SmoothLabel (common/frame/smooth_label.h) defines it.
HWY_NOINLINE LabelThere SmoothLabelAt(const RayLabels& labels, const LabelPlace& place) {
  constexpr std::size_t kAround = 64;
  constexpr float kBeyondAll = 2, kTaken = -2;  // opacities that no label has
  const FloatTag df;
  const IntTag di;
  const auto zero = hn::Zero(df), margin = Set(float(kWeightMargin));
  const Spline x = SplineAt(place.fraction[0]), y = SplineAt(place.fraction[1]), z = SplineAt(place.fraction[2]);
  Ints numbers[kAround];
  Floats weights[kAround], opacities[kAround];
  auto differ = hn::Lt(SetInt(1), hn::Zero(di));
  std::size_t count = 0;
  ForEachRowAround(labels, place, [&](std::size_t row, std::size_t slice, const LabelRow& around) HWY_ATTR {
    const auto of_row = hn::Mul(y.value[row], z.value[slice]);
    for (std::size_t i = 0; i < 4; ++i, ++count) {
      numbers[count] = around.numbers[i];
      weights[count] = hn::Mul(x.value[i], of_row);
      differ = hn::Or(differ, hn::Ne(numbers[count], numbers[0]));
    }
  });
  const auto first = OpacityOf(labels, numbers[0]);
  const auto there = [&](Ints number, Floats opacity) HWY_ATTR {
    const auto shown = hn::And(place.there, hn::Ge(opacity, zero));
    return LabelThere{hn::IfThenElseZero(hn::RebindMask(di, shown), number), hn::IfThenElse(shown, opacity, Set(-1))};
  };
  if (hn::AllFalse(di, hn::And(hn::RebindMask(di, place.there), differ))) return there(numbers[0], first);
  for (std::size_t i = 0; i < kAround; ++i) opacities[i] = OpacityOf(labels, numbers[i]);

  // Lower the opacity until the voxels that have at least as much reach half of the weight.
  auto opacity = Set(kBeyondAll), membership = zero;
  for (;;) {
    const auto short_of = hn::Lt(membership, Set(float(kHalfMembership)));
    if (hn::AllFalse(df, short_of)) break;
    auto next = Set(kTaken);
    for (const auto& of : opacities) next = hn::Max(next, hn::IfThenElse(hn::Lt(of, opacity), of, Set(kTaken)));
    opacity = hn::IfThenElse(short_of, next, opacity);
    membership = zero;
    for (std::size_t i = 0; i < kAround; ++i) {
      membership = hn::Add(membership, hn::IfThenElseZero(hn::Ge(opacities[i], opacity), weights[i]));
    }
  }

  // Weigh the labels of that opacity, one after the other. Of two with the same weight, take the one that comes first.
  auto label = hn::Zero(di);
  auto most = zero;
  const auto wanted = hn::IfThenElse(hn::Ge(opacity, zero), opacity, Set(kBeyondAll));
  for (;;) {
    auto candidate = hn::Zero(di);
    auto left = hn::Lt(Set(1), zero);
    for (std::size_t i = kAround; i-- > 0;) {
      const auto of = hn::Eq(opacities[i], wanted);
      candidate = hn::IfThenElse(hn::RebindMask(di, of), numbers[i], candidate);
      left = hn::Or(left, of);
    }
    if (hn::AllFalse(df, left)) break;
    auto sum = zero;
    for (std::size_t i = 0; i < kAround; ++i) {
      const auto of = hn::And(left, hn::RebindMask(df, hn::Eq(numbers[i], candidate)));
      sum = hn::Add(sum, hn::IfThenElseZero(of, weights[i]));
      opacities[i] = hn::IfThenElse(of, Set(kTaken), opacities[i]);
    }
    const auto more = hn::And(left, hn::Gt(sum, hn::Add(most, margin)));
    label = hn::IfThenElse(hn::RebindMask(di, more), candidate, label);
    most = hn::IfThenElse(more, sum, most);
  }
  return there(label, opacity);
}

HWY_INLINE LabelThere LabelAt(const RayLabels& labels, const LabelPlace& place) {
  if (labels.tables.smooth) return SmoothLabelAt(labels, place);
  const auto number = NearestLabel(labels, place);
  return {number, OpacityOf(labels, number)};
}

// `g` along the volume's axes. 0 where there is hardly any.
HWY_INLINE Gradient AlongVolume(const RayLabels& labels, const Gradient& g) {
  const auto square = hn::Add(hn::Add(hn::Mul(g.x, g.x), hn::Mul(g.y, g.y)), hn::Mul(g.z, g.z));
  const auto any = hn::Gt(square, Set(1e-4F));
  const auto of_volume = [&](std::size_t i) HWY_ATTR {
    const Float3& step = labels.steps[i];
    const auto sum = hn::Add(hn::Add(hn::Mul(g.x, Set(step[0])), hn::Mul(g.y, Set(step[1]))), hn::Mul(g.z, Set(step[2])));
    return hn::IfThenElseZero(any, sum);
  };
  return {of_volume(0), of_volume(1), of_volume(2)};
}

// The gradient of the indicator of each sample's label (1 in its voxels, 0 elsewhere), smoothed by the cubic B-spline (Unser 1999) over the
// 4 x 4 x 4 voxels around.
HWY_INLINE Gradient IndicatorGradientAt(const RayLabels& labels, const LabelPlace& place, Ints label) {
  const FloatTag df;
  const auto zero = hn::Zero(df);
  const Spline along_x = SplineAt(place.fraction[0]), along_y = SplineAt(place.fraction[1]), along_z = SplineAt(place.fraction[2]);
  Gradient g = {zero, zero, zero};
  ForEachRowAround(labels, place, [&](std::size_t y, std::size_t z, const LabelRow& around) HWY_ATTR {
    auto value = zero, slope = zero;
    for (std::size_t x = 0; x < 4; ++x) {
      const auto same = hn::RebindMask(df, hn::Eq(around.numbers[x], label));
      value = hn::Add(value, hn::IfThenElseZero(same, along_x.value[x]));
      slope = hn::Add(slope, hn::IfThenElseZero(same, along_x.slope[x]));
    }
    const auto value_z = hn::Mul(value, along_z.value[z]);
    g.x = hn::Add(g.x, hn::Mul(hn::Mul(slope, along_y.value[y]), along_z.value[z]));
    g.y = hn::Add(g.y, hn::Mul(value_z, along_y.slope[y]));
    g.z = hn::Add(g.z, hn::Mul(hn::Mul(value, along_y.value[y]), along_z.slope[z]));
  });
  return AlongVolume(labels, g);
}

// The normal of a smooth surface (common/frame/smooth_label.h). Beyond the padding its last voxels are repeated.
HWY_NOINLINE Gradient SmoothNormalAt(const RayLabels& labels, const LabelPlace& place, Floats opacity) {
  const FloatTag df;
  const IntTag di;
  constexpr std::size_t kAround = 2 * kSmoothReach;
  const auto zero = hn::Zero(df), third = Set(1.0F / 3);
  const RayBox& voxels = labels.voxels;
  // The spline, averaged over three places.
  struct Wide {
    Floats value[kAround], slope[kAround];
    Ints at[kAround];  // of voxels, in samples
  };
  Wide along[3];
  const std::int32_t strides[3] = {1, voxels.row, voxels.slice};
  for (std::size_t i = 0; i < 3; ++i) {
    const Spline spline = SplineAt(place.fraction[i]);
    const auto voxel = hn::IfThenElseZero(hn::RebindMask(di, place.there), place.voxel[i]);
    for (std::size_t k = 0; k < kAround; ++k) {
      along[i].value[k] = along[i].slope[k] = zero;
      for (std::size_t tap = k < 2 ? 0 : k - 2; tap <= k && tap < 4; ++tap) {
        along[i].value[k] = hn::Add(along[i].value[k], hn::Mul(third, spline.value[tap]));
        along[i].slope[k] = hn::Add(along[i].slope[k], hn::Mul(third, spline.slope[tap]));
      }
      const auto index = hn::Add(voxel, SetInt(std::int32_t(k) - 1));
      along[i].at[k] = hn::Mul(hn::Min(hn::Max(index, hn::Zero(di)), SetInt(voxels.padded[int(i)] - 1)), SetInt(strides[i]));
    }
  }
  Gradient g = {zero, zero, zero};
  for (std::size_t z = 0; z < kAround; ++z) {
    for (std::size_t y = 0; y < kAround; ++y) {
      const auto row = hn::Add(along[2].at[z], along[1].at[y]);
      auto value = zero, slope = zero;
      for (std::size_t x = 0; x < kAround; ++x) {
        const auto number = LoadLabel(voxels, hn::Add(row, along[0].at[x]));
        const auto member = hn::Ge(OpacityOf(labels, number), opacity);
        value = hn::Add(value, hn::IfThenElseZero(member, along[0].value[x]));
        slope = hn::Add(slope, hn::IfThenElseZero(member, along[0].slope[x]));
      }
      const auto value_z = hn::Mul(value, along[2].value[z]);
      g.x = hn::Add(g.x, hn::Mul(hn::Mul(slope, along[1].value[y]), along[2].value[z]));
      g.y = hn::Add(g.y, hn::Mul(value_z, along[1].slope[y]));
      g.z = hn::Add(g.z, hn::Mul(hn::Mul(value, along[1].value[y]), along[2].slope[z]));
    }
  }
  return AlongVolume(labels, g);
}

HWY_INLINE Gradient NormalAt(const RayLabels& labels, const LabelPlace& place, const LabelThere& label) {
  return labels.tables.smooth ? SmoothNormalAt(labels, place, label.opacity) : IndicatorGradientAt(labels, place, label.number);
}

// Samples after the labels have had their say. Lanes that are not `sampled` mean nothing.
struct LabelledSample {
  LabelPlace place;
  Floats opacity;
  // The share of a label's colour in the volume's part: that part has (1 - tint) times the volume's colour and tint
  // times the colour of `entry`. A label that is matter has a tint of 1.
  Floats tint;
  LabelThere label;
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
  sample.label = LabelAt(labels, sample.place);
  sample.entry = hn::ShiftLeft<2>(sample.label.number);
  const auto& changed = sample.label.opacity;
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
