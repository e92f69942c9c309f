#include "worker/renderers/raycast/march.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/raycast/march.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <variant>

#include "worker/rays/ray_sums-inl.h"
#include "worker/renderers/raycast/field_samples-inl.h"
#include "worker/renderers/raycast/gradient_bricks-inl.h"
#include "worker/renderers/raycast/label_samples-inl.h"
#include "worker/renderers/raycast/packet_frusta-inl.h"
#include "worker/renderers/raycast/surface_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

HWY_INLINE bool IsLit(const MarchWork& work) { return work.look->phong || work.light != nullptr; }

// Adds crossings with isosurfaces. With labels: tinted, thinned or taken away like a sample there, and not in the place of a label that is
// matter.
template <class T>
HWY_INLINE void AddCrossings(const MarchWork& work, Mask rays, const Crossing& crossing, Sums& sums) {
  const FloatTag df;
  const SamplePlace place = crossing.Place(work.box->origin);
  Light light = {Set(1), hn::Zero(df)};
  if (IsLit(work)) {
    const Gradient gradient = GradientAt<T>(*work.box, place, rays, work.smooth);
    light = LightOn(*work.look, work.light, gradient, [&]() HWY_ATTR { return place; });
  }
  const auto entry = hn::ShiftLeft<2>(hn::ConvertTo(IntTag(), crossing.surface));
  const float* const colors = work.look->surface_looks.data();
  const auto opacity = hn::GatherIndex(df, colors + 3, entry);
  if (work.labels == nullptr) return sums.Add(rays, opacity, colors, entry, light);
  const LabelTables& tables = work.labels->tables;
  const float* const tints = tables.entries.data();
  const auto [number, changed] = LabelAt(*work.labels, PlaceAmong(*work.labels, *work.box, place, rays));
  const auto label = hn::ShiftLeft<2>(number);
  const auto shown = hn::Ge(changed, hn::Zero(df));
  const auto factor = hn::IfThenElse(shown, tables.surface ? hn::Zero(df) : changed, Set(1));
  const auto tint = hn::IfThenElseZero(shown, Set(tables.tint));
  sums.AddChannels(rays, hn::Mul(opacity, factor), [&](std::size_t channel) HWY_ATTR {
    return Sums::Lit(Lerp(tint, hn::GatherIndex(df, colors + channel, entry), hn::GatherIndex(df, tints + channel, label)), light);
  });
}

// Adds the crossings of rays with isosurfaces up to `before`, in samples. Returns how many.
template <class T>
HWY_NOINLINE std::uint64_t AddSurfaces(const MarchWork& work, Floats before, SurfaceWalk<T>& walk, Sums& sums) {
  constexpr float kAhead = 32;
  return AddCrossingsUpTo(before, kAhead, work.termination, walk, sums,
                          [&](Mask rays, const Crossing& crossing) HWY_ATTR { AddCrossings<T>(work, rays, crossing, sums); });
}

// The light on samples with labels. `gradient`: of the volume, or a face's normal if `on_face`.
template <class PlaceOf>
HWY_INLINE Light LightOfLabels(const MarchWork& work, PlaceOf&& place_of, const LabelledSample& sample, Mask visible, Gradient gradient,
                               Mask on_face) {
  const FloatTag df;
  if (work.labels == nullptr) return LightOn(*work.look, work.light, gradient, place_of);
  const auto matter = hn::AndNot(on_face, hn::And(visible, sample.matter));
  if (!hn::AllFalse(df, matter)) {
    gradient = Choose(matter, NormalAt(*work.labels, sample.place, sample.label), gradient);
  }
  return LightOn(*work.look, work.light, gradient, place_of);
}

// The colours of samples with labels.
HWY_INLINE Floats LabelledColor(const MarchWork& work, const Entries& entries, const LabelledSample& sample, const Light& light,
                                std::size_t channel) {
  auto color = entries.of[channel];
  if (work.labels != nullptr) {
    color = Lerp(sample.tint, color, hn::GatherIndex(FloatTag(), work.labels->tables.entries.data() + channel, sample.entry));
  }
  return Sums::Lit(color, light);
}

// `shown`: Step::shown.
HWY_INLINE Mask ShowsVolume(Ints shown) { return ShowsField(shown, 0); }

// What a frame may ask for: only a transfer function; cuts, isosurfaces and gradient opacity, too; labels and other fields on top; and
// several fields, the volume like the others, by transfer functions and with cuts. Each is compiled by itself, so that a frame does not pay
// for what it does not use.
enum class Samples { kPlain, kAll, kMixed, kFields };

// How far the rays of a packet go on: the rays that take their next sample, and the samples from it to the one after.
struct Stride {
  Mask sampled;
  Floats steps;
};
// Rays in empty space leap ahead; the others go on to their next sample. `octant_start`: OctantStart; `inside`: rays in the box.
HWY_INLINE Stride LeapFrom(const MarchWork& work, const LeapScales& leaps, Ints octant_start, const SamplePlace& place, Mask inside) {
  const FloatTag df;
  const IntTag di;
  const auto zero = hn::Zero(di), two = SetInt(kCellSide / 2);
  const auto cell = EmptyAt(*work.to_samples, octant_start, CellOf<kCellShift>(place, work.box->cells, inside));
  // Bit i of an eighth is the one of value two of the voxel along axis i.
  const auto x = hn::ShiftRight<1>(hn::And(place.voxel[0], two)), y = hn::And(place.voxel[1], two),
             z = hn::ShiftLeft<1>(hn::And(place.voxel[2], two));
  const auto shown = hn::And(hn::Shr(cell, hn::Or(x, hn::Or(y, z))), SetInt(1));
  const auto empty = hn::Eq(shown, zero);
  if (hn::AllFalse(di, empty)) return {inside, Set(1)};
  const auto distance = hn::ShiftRight<8>(cell);
  const auto whole = hn::Gt(distance, zero);
  const auto side = hn::IfThenElse(whole, SetInt(kCellSide), two), ahead = hn::IfThenElse(whole, hn::ShiftLeft<kCellShift>(distance), two);
  const auto leap = StepsWithin(*work.box, leaps, place, side, hn::ConvertTo(df, ahead));
  return {hn::AndNot(hn::RebindMask(df, empty), inside), hn::IfThenElse(hn::RebindMask(df, empty), leap, Set(1))};
}

// Samples of the volume, from bricks.
template <class T>
struct VolumeSamples {
  using Found = BrickPlace;
  LitSample of;

  static HWY_INLINE Found Nowhere() { return {hn::Zero(IntTag()), hn::Zero(IntTag()), {}}; }
  static HWY_INLINE void Find(const MarchWork& work, const SamplePlace& place, Mask inside, GradientBricks* bricks, Found& found,
                              Found& before) {
    FindInBricks<T>(*work.box, place, inside, *bricks, found, before);
  }
  HWY_INLINE void Read(const CellPlace& place, const Found& found, GradientBricks* bricks) {
    of = ReadBricks<T>(*bricks, found.corner, BrickWeights(place));
  }
};

// The samples at which the rays of a packet are.
template <class Voxels>
struct Step {
  bool any;  // there are some
  Mask sampled;
  Floats k;
  CellPlace cell;                // all else of the place, which few frames need, is computed anew from k: stores take longer
  typename Voxels::Found found;  // where the voxels are
  Voxels voxels;
  LaneNumbers entry;  // EntryOf
  // Of kMixed and kFields.
  Ints shown;         // as in RayFields, if there are any; 0 where there is no sample
  bool shows_volume;  // the volume may show there
};

// Samples after classification. Lanes that are not visible mean nothing.
template <Samples kSamples>
struct Classified {
  Entries entries;
  Floats opacity;
  Mask visible;
  std::conditional_t<kSamples == Samples::kMixed, LabelledSample, std::monostate> labelled;
};

// Opacity uses plain gradients. Not inlined: few frames need it.
template <class T>
HWY_NOINLINE Gradient CentralGradientAt(const RayBox& box, SamplePlace place, Mask sampled) {
  return GradientAt<T>(box, place, sampled, false);
}

template <class T, Samples kSamples, class Voxels, class PlaceOf>
HWY_INLINE void ClassifySamples(const MarchWork& work, const Step<Voxels>& step, PlaceOf&& place_of, Classified<kSamples>& of) {
  const FloatTag df;
  const RayLook& look = *work.look;
  const LitSample& sample = step.voxels.of;
  const auto zero = hn::Zero(df);
  const auto finite = FiniteOf<T>(sample.value);
  of.entries = EntriesAt(look.entries.data(), step.entry);
  of.opacity = of.entries.of[3];
  of.visible = hn::And(hn::And(step.sampled, finite), hn::Gt(of.opacity, zero));
  if (kSamples != Samples::kPlain && look.by_gradient() && !hn::AllFalse(df, of.visible)) {
    const Gradient gradient = work.smooth ? CentralGradientAt<T>(*work.box, place_of(), step.sampled) : sample.gradient;
    if (look.regions != nullptr) {
      LaneNumbers region;
      region.Set(RegionOf(look, hn::IfThenElseZero(finite, sample.value), gradient));
      of.entries = EntriesAt(look.regions->entries.data(), region);
      of.opacity = of.entries.of[3];
    } else {
      of.opacity = OpacityByGradient(look, of.opacity, gradient);
    }
    of.visible = hn::And(of.visible, hn::Gt(of.opacity, zero));
  }
  if constexpr (kSamples == Samples::kMixed) {
    if (work.labels != nullptr) {
      of.labelled = WithLabels(*work.labels, *work.box, place_of(), step.sampled, hn::IfThenElseZero(finite, of.opacity));
      of.opacity = of.labelled.opacity;
      of.visible = hn::And(step.sampled, hn::Gt(of.opacity, zero));
    }
  }
}

// The opacity of samples k if the first and the last one of a ray stand for more or less than a step.
HWY_INLINE Floats OpacityAtEnds(const EndSamples& ends, Floats k, Mask visible, Floats opacity) {
  const auto one = Set(1);
  const auto is_first = hn::Eq(k, ends.first), is_last = hn::Eq(k, ends.last), is_end = hn::Or(is_first, is_last);
  if (hn::AllFalse(FloatTag(), hn::And(visible, is_end))) return opacity;
  const auto steps_of_first = hn::Add(one, hn::IfThenElseZero(is_first, ends.first_excess));
  const auto power = hn::Add(steps_of_first, hn::IfThenElseZero(is_last, ends.last_excess));
  return hn::IfThenElse(is_end, hn::Sub(one, PowerOfFraction(hn::Sub(one, opacity), power)), opacity);
}

// Lights samples and adds those that are visible to Sums or to a Mixture: add(mask, opacity, color(channel)).
template <Samples kSamples, class Voxels, class PlaceOf, class Add>
HWY_INLINE void AddSamples(const MarchWork& work, const Step<Voxels>& step, PlaceOf&& place_of, const PacketPart* part,
                           const Classified<kSamples>& samples, Floats opacity, Add&& add) {
  const RayLook& look = *work.look;
  Light light = {Set(1), hn::Zero(FloatTag())};
  if (IsLit(work)) {
    Gradient gradient = step.voxels.of.gradient;
    [[maybe_unused]] auto on_face = hn::Lt(Set(1), hn::Zero(FloatTag()));
    if constexpr (kSamples != Samples::kPlain) {
      on_face = hn::Lt(step.k, part->face_end);
      gradient = Choose(on_face, {part->face[0], part->face[1], part->face[2]}, gradient);
    }
    if constexpr (kSamples == Samples::kMixed) {
      light = LightOfLabels(work, place_of, samples.labelled, samples.visible, gradient, on_face);
    } else {
      light = LightOn(look, work.light, gradient, place_of);
    }
  }
  if constexpr (kSamples == Samples::kMixed) {
    add(samples.visible, opacity,
        [&](std::size_t channel) HWY_ATTR { return LabelledColor(work, samples.entries, samples.labelled, light, channel); });
  } else {
    add(samples.visible, opacity, [&](std::size_t channel) HWY_ATTR { return Sums::Lit(samples.entries.of[channel], light); });
  }
}

// A packet in the frame's grid and among the voxels of the box (AmongVoxels), and its leaps there.
struct MarchingPacket {
  const RayPacket& of_frame;
  const RayPacket& among;
  const LeapScales& leaps;
  GradientBricks* bricks;                   // the volume's, then those of other fields
  float surfaces_from;                      // FrustumStarts, of isosurfaces
  const RayPacket* among_fields = nullptr;  // AmongVoxels, by field
};

// Samples `owned` of the rays, which lie in `part`; of kPlain it is null. Returns how many samples were shaded.
template <class T, Samples kSamples, class Voxels>
HWY_INLINE std::uint64_t MarchSamples(const MarchWork& work, const MarchingPacket& packet, const SampleInterval& owned,
                                      const PacketPart* part, Sums& gathered) {
  constexpr bool kAll = kSamples != Samples::kPlain, kFields = kSamples == Samples::kFields;
  const FloatTag df;
  const RayLook& look = *work.look;
  const auto zero = hn::Zero(df), one = Set(1);
  // A ray ends when it transmits less.
  const auto opaque = Set(1 - work.termination);

  // Each ray advances separately: its next sample is k.
  auto k = owned.begin;
  // Addresses depend on `inside` alone, so that loads need not wait for the samples before.
  auto inside = hn::Lt(k, owned.end), alive = inside;
  std::uint64_t shaded = 0;
  const bool has_surfaces = kAll && !kFields && packet.surfaces_from < kRayEnd;
  [[maybe_unused]] const RayFields* fields = nullptr;
  if constexpr (kSamples == Samples::kMixed || kFields) fields = work.fields;
  SurfaceWalk<T> surfaces(work, packet.among, has_surfaces ? OctantStart(*work.to_surfaces, packet.among) : hn::Zero(IntTag()));
  if constexpr (kAll) {
    alive = hn::And(alive, hn::Lt(gathered.alpha, opaque));
    if (kSamples == Samples::kAll && !look.volume_shows) alive = hn::Lt(one, zero);
    if (has_surfaces) surfaces.Start(*part, packet.surfaces_from);
  }
  if (!has_surfaces && hn::AllFalse(df, alive)) return 0;
  const bool has_ends = kAll || work.box->at_border;
  EndSamples ends{zero, zero, zero, zero};
  if (has_ends) ends = EndSamplesOf(*work.rays, packet.of_frame, LeapScalesOf(packet.of_frame), part);

  Sums sums = gathered;
  const Ints octant_start = OctantStart(*work.to_samples, packet.among);
  bool in_matter = false;  // most of the last samples were visible
  // The next samples: where they are. Rays leap until some ray has one.
  const auto find = [&](Step<Voxels>& step, Step<Voxels>& before) SLABSTREAM_INLINED {
    step.any = false;
    while (!hn::AllFalse(df, alive)) {
      const SamplePlace place = PlaceSample(packet.among, *work.box, k);
      step.cell = place;
      Stride stride = {inside, one};
      bool may_leap = !in_matter;
      if constexpr (kFields) {  // a cell is empty where no field may show
        step.shown = ShownAt(*fields, *work.box, place, inside);
        may_leap = !hn::AllFalse(df, hn::And(inside, hn::RebindMask(df, hn::Eq(step.shown, hn::Zero(IntTag())))));
      }
      if (may_leap) stride = LeapFrom(work, packet.leaps, octant_start, place, inside);
      step.k = k;
      step.sampled = hn::And(alive, stride.sampled);
      k = hn::Add(k, stride.steps);
      inside = hn::Lt(k, owned.end);
      alive = hn::And(alive, inside);
      if (hn::AllFalse(df, step.sampled)) continue;
      step.any = true;
      if constexpr (kFields) {
        step.shown = hn::IfThenElseZero(hn::RebindMask(IntTag(), step.sampled), step.shown);
        Voxels::Find(*fields, place, step.shown, packet.bricks, step.found, before.found);
      } else {
        auto read = stride.sampled;
        if constexpr (kSamples == Samples::kMixed) {
          step.shows_volume = true;
          if (fields != nullptr) {
            step.shown = ShownAt(*fields, *work.box, place, step.sampled);
            read = ShowsVolume(step.shown);
            step.shows_volume = !hn::AllFalse(df, read);
          }
        }
        Voxels::Find(work, place, read, packet.bricks, step.found, before.found);
      }
      return;
    }
  };
  // Their values.
  const auto read = [&](Step<Voxels>& step) SLABSTREAM_INLINED {
    if constexpr (kFields) {
      step.voxels.Read(*fields, step.cell, step.shown, packet.bricks, step.found);
    } else {
      if (kSamples == Samples::kMixed && !step.shows_volume) return;
      step.voxels.Read(step.cell, step.found, packet.bricks);
      const Floats value = step.voxels.of.value;
      if constexpr (std::is_same_v<T, float>) {
        step.entry.Set(EntryOf(look, value, FiniteOf<T>(value)));
      } else {
        step.entry.Set(EntryOf(look, value));
      }
    }
  };
  // Their looks.
  const auto add = [&](const Step<Voxels>& step) SLABSTREAM_INLINED {
    const auto place_of = [&]() SLABSTREAM_INLINED { return PlaceSample(packet.among, *work.box, step.k); };
    Classified<kSamples> samples;
    samples.visible = hn::Lt(one, zero);
    const auto transparent = hn::Lt(sums.alpha, opaque);
    if constexpr (!kFields) {
      if (kSamples != Samples::kMixed || step.shows_volume) ClassifySamples<T, kSamples>(work, step, place_of, samples);
      samples.visible = hn::And(samples.visible, transparent);
    }
    [[maybe_unused]] Mixture mixture;
    if constexpr (kSamples == Samples::kMixed || kFields) {
      if (fields != nullptr) {
        mixture = Mixture::Empty();
        if constexpr (!kFields) {
          samples.visible = hn::And(samples.visible, ShowsVolume(step.shown));
          if (!hn::AllFalse(df, samples.visible)) {
            AddSamples<kSamples>(work, step, place_of, part, samples, samples.opacity,
                                 [&](Mask visible, Floats opacity, auto&& color) HWY_ATTR { mixture.Add(visible, opacity, color); });
          }
        }
        const auto shown = hn::IfThenElseZero(hn::RebindMask(IntTag(), transparent), step.shown);
        const SamplePlace of_volume = place_of();
        const FieldPlace there = {step.k, of_volume, work.light, hn::Lt(step.k, part->face_end), part->face};
        if constexpr (kFields) {
          step.voxels.Mix(*fields, there, shown, packet.among_fields, packet.bricks, mixture);
        } else {
          MixFields(*fields, there, shown, packet.among_fields, packet.bricks, mixture);
        }
        samples.opacity = mixture.alpha;
        samples.visible = hn::Gt(mixture.alpha, zero);
      }
    }
    const std::size_t count = hn::CountTrue(df, samples.visible);
    in_matter = count > kLanes / 2;
    if (count == 0) return;
    shaded += count;
    if constexpr (kAll) {
      if (has_surfaces) shaded += AddSurfaces<T>(work, step.k, surfaces, sums);
    }
    const auto opacity = has_ends ? OpacityAtEnds(ends, step.k, samples.visible, samples.opacity) : samples.opacity;
    const auto add_to_sums = [&](Mask visible, Floats of, auto&& color) SLABSTREAM_INLINED { sums.AddChannels(visible, of, color); };
    if constexpr (kSamples == Samples::kMixed || kFields) {
      if (kFields || fields != nullptr) {
        const auto straight = mixture.Straight(fields->flat);
        add_to_sums(samples.visible, opacity, [&](std::size_t channel) HWY_ATTR { return hn::Mul(mixture.color[channel], straight); });
        if (fields->flat) sums.LimitColors();
      } else if constexpr (!kFields) {
        AddSamples<kSamples>(work, step, place_of, part, samples, opacity, add_to_sums);
      }
    } else {
      AddSamples<kSamples>(work, step, place_of, part, samples, opacity, add_to_sums);
    }
    alive = hn::And(alive, hn::Lt(sums.alpha, opaque));
  };
  // Three steps are under way at a time: while one waits for its voxels, the next one is placed and the one before is lit.
  Step<Voxels> steps[3];
  for (Step<Voxels>& step : steps) {
    step.any = false;
    step.found = Voxels::Nowhere();
  }
  Step<Voxels>*next = &steps[0], *found = &steps[1], *known = &steps[2];
  do {
    find(*next, *found);
    if (found->any) read(*found);
    if (known->any) add(*known);
    std::swap(known, found);
    std::swap(found, next);
  } while (known->any || found->any);
  if constexpr (kAll) {
    if (has_surfaces) shaded += AddSurfaces<T>(work, Set(kRayEnd), surfaces, sums);
  }
  gathered = sums;
  return shaded;
}

// Apart from plain frames, so that these have the registers for themselves.
template <class T, Samples kSamples, class Voxels>
HWY_NOINLINE std::uint64_t MarchParts(const MarchWork& work, MarchingPacket packet, const SampleInterval& owned, const PacketShapes* shapes,
                                      Sums& sums) {
  if constexpr (kSamples == Samples::kMixed) {  // chosen here: another branch in MarchPacket would make plain frames slower
    if (work.fields != nullptr && work.labels == nullptr && work.to_surfaces == nullptr && !work.look->by_gradient()) {
      return MarchParts<std::uint8_t, Samples::kFields, FieldSamples>(work, packet, owned, shapes, sums);
    }
  }
  constexpr bool kMayMix = kSamples == Samples::kMixed || kSamples == Samples::kFields;
  RayPacket among_fields[kMayMix ? kMaxShownFields : 1];
  if constexpr (kMayMix) {
    packet.among_fields = among_fields;
    if (work.fields != nullptr) {
      const std::span<const RayField> fields = work.fields->fields;
      for (std::size_t i = 0; i < fields.size(); ++i) {
        if (!fields[i].on_same_grid) among_fields[i] = AmongVoxels(packet.of_frame, fields[i].map);
      }
    }
  }
  PacketPart parts[2];
  PartsOf(work.rays->clip, packet.of_frame, parts);
  std::uint64_t shaded = 0;
  for (PacketPart& part : parts) {
    for (std::size_t i = 0; i < 3; ++i) part.face[i] = hn::Div(part.face[i], Set(work.box->scale[i]));  // like a gradient there
  }
  MarchAmongFragments(shapes, parts, Set(1 - work.termination), sums, [&](const PacketPart& part) SLABSTREAM_INLINED {
    shaded += MarchSamples<T, kSamples, Voxels>(work, packet, part.Of(owned), &part, sums);
  });
  return shaded;
}

// The rays of one packet. `samples_from`, `surfaces_from`: FrustumStarts.
template <class T>
HWY_INLINE std::uint64_t MarchPacket(const MarchWork& work, const RayPacket& of_frame, float samples_from, float surfaces_from,
                                     const PacketShapes* shapes, GradientBricks* bricks, float* HWY_RESTRICT rgba) {
  if (samples_from == kRayEnd && surfaces_from == kRayEnd && shapes == nullptr) return 0;
  const auto zero = hn::Zero(FloatTag());
  SampleInterval owned = OwnedSamples(of_frame, *work.box);
  owned.begin = hn::Max(owned.begin, Set(std::ceil(samples_from)));
  const RayPacket among = AmongVoxels(of_frame, *work.box);
  const LeapScales leaps = LeapScalesOf(among);
  const MarchingPacket packet = {of_frame, among, leaps, bricks, surfaces_from};
  Sums sums = {zero, zero, zero, zero};
  std::uint64_t shaded = 0;
  // Plain frames stand first and in line: behind a branch that g++ thinks likelier they take 8 % longer.
  const bool mixed = work.labels != nullptr || work.fields != nullptr;
  const bool has_parts = !work.rays->clip.empty() || work.to_surfaces != nullptr || work.look->by_gradient() || shapes != nullptr;
  if (HWY_LIKELY(!mixed && !has_parts)) {
    shaded = MarchSamples<T, Samples::kPlain, VolumeSamples<T>>(work, packet, owned, nullptr, sums);
  } else if (!mixed) {
    shaded = MarchParts<T, Samples::kAll, VolumeSamples<T>>(work, packet, owned, shapes, sums);
  } else {
    shaded = MarchParts<T, Samples::kMixed, VolumeSamples<T>>(work, packet, owned, shapes, sums);
  }
  if (shaded != 0 || (shapes != nullptr && shapes->any_owned))
    hn::StoreInterleaved4(sums.red, sums.green, sums.blue, sums.alpha, FloatTag(), rgba);
  return shaded;
}

template <class T>
HWY_NOINLINE std::uint64_t MarchPackets(const MarchWork& work, const PixelBounds& tile, GradientBricks* bricks, float* HWY_RESTRICT rgba,
                                        std::size_t floats_a_row) {
  std::uint64_t shaded = 0;
  const bool has_shapes = work.shapes != nullptr && !work.shapes->empty();
  PacketShapes shapes;
  TileStarts of_samples(*work.rays, *work.box, work.to_samples, tile), of_surfaces(*work.rays, *work.box, work.to_surfaces, tile);
  ForEachPacket(*work.rays, tile, rgba, floats_a_row,
                [&](const RayPacket& packet, float* HWY_RESTRICT pixels, std::int32_t x, std::int32_t y) HWY_ATTR {
                  const bool cut = has_shapes && LoadShapes(*work.shapes, *work.order, *work.rays, *work.box, tile, x, y, shapes);
                  const std::uint64_t found =
                      MarchPacket<T>(work, packet, of_samples.Next(), of_surfaces.Next(), cut ? &shapes : nullptr, bricks, pixels);
                  shaded += found;
                  return found != 0 || (cut && shapes.any_owned);
                });
  return shaded;
}

std::uint64_t MarchAny(const MarchWork& work, const PixelBounds& tile, std::span<GradientBricks> bricks, float* rgba,
                       std::size_t floats_a_row) {
  bricks[0].Enter(*work.box, work.smooth);
  if (work.fields != nullptr) {
    const std::span<const RayField> fields = work.fields->fields;
    for (std::size_t i = 1; i < fields.size(); ++i) bricks[i].Enter(fields[i].voxels, work.smooth);
  }
  switch (work.box->type) {
    case ScalarType::kUint8: return MarchPackets<std::uint8_t>(work, tile, bricks.data(), rgba, floats_a_row);
    case ScalarType::kUint16: return MarchPackets<std::uint16_t>(work, tile, bricks.data(), rgba, floats_a_row);
    default: return MarchPackets<float>(work, tile, bricks.data(), rgba, floats_a_row);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(MarchAny);

std::uint64_t MarchTile(const MarchWork& work, const PixelBounds& tile, std::span<GradientBricks> bricks, float* rgba,
                        std::size_t floats_a_row) {
  return HWY_DYNAMIC_DISPATCH(MarchAny)(work, tile, bricks, rgba, floats_a_row);
}

}  // namespace slabstream
#endif
