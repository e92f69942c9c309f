#include "worker/rays/project.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/rays/project.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <array>
#include <limits>
#include <type_traits>

#include "worker/rays/ray_sections-inl.h"
#include "worker/rays/stretched_place-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {

// Interpolated samples, clamped to the range of their voxels. Lanes not in `valid` are arbitrary.
struct ProjectedSamples {
  Floats values;
  Mask valid;
};

// Samples beside voxels that are not finite, by the weights of the finite ones.
HWY_NOINLINE ProjectedSamples SamplesOfFinite(const Neighbours<float>& n, const SamplePlace& place, Mask owned) {
  const FloatTag df;
  const auto one = Set(1), half = Set(0.5F);
  const auto upper = [&](std::size_t axis) HWY_ATTR { return hn::Ge(place.fraction[axis], half); };
  auto sum = hn::Zero(df), weights = sum, nearest = sum;
  auto least = Set(std::numeric_limits<float>::max()), largest = Set(std::numeric_limits<float>::lowest());
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::array<std::size_t, 3> side = {corner % 2, corner / 2 % 2, corner / 4};
    const SampleRow& pair = n.inner[side[2]][side[1]];
    const auto value = side[0] == 0 ? pair.a : pair.b;
    auto weight = one, is_nearest = one;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto& fraction = place.fraction[axis];
      weight = hn::Mul(weight, side[axis] == 0 ? hn::Sub(one, fraction) : fraction);
      is_nearest = side[axis] == 0 ? hn::IfThenZeroElse(upper(axis), is_nearest) : hn::IfThenElseZero(upper(axis), is_nearest);
    }
    const auto finite = hn::IsFinite(value);
    weights = hn::Add(weights, hn::IfThenElseZero(finite, weight));
    sum = hn::Add(sum, hn::IfThenElseZero(finite, hn::Mul(value, weight)));
    nearest = hn::Add(nearest, hn::IfThenElseZero(finite, is_nearest));
    least = hn::IfThenElse(finite, hn::Min(least, value), least);
    largest = hn::IfThenElse(finite, hn::Max(largest, value), largest);
  }
  const auto valid = hn::And(owned, hn::Gt(nearest, hn::Zero(df)));
  const auto value = hn::Div(sum, hn::IfThenElse(valid, weights, one));
  return {hn::Min(hn::Max(value, least), largest), hn::And(valid, hn::IsFinite(value))};
}

template <class T, bool kNearest>
HWY_INLINE ProjectedSamples SamplesAt(const RayBox& box, SamplePlace place, Mask owned) {
  if constexpr (kNearest) {
    for (Floats& fraction : place.fraction) fraction = hn::IfThenElseZero(hn::Ge(fraction, Set(0.5F)), Set(1));
  }
  if constexpr (std::is_integral_v<T>) {
    return {InterpolateWhole<T>(box, place, owned), owned};
  } else {
    const Neighbours<T> n = LoadNeighbours<T>(box, place, owned);
    const auto value = Interpolate(n, place);
    Floats least = n.inner[0][0].a, largest = n.inner[0][0].a;
    for (const auto& row : n.inner) {
      for (const SampleRow& pair : row) {
        least = hn::Min(least, hn::Min(pair.a, pair.b));
        largest = hn::Max(largest, hn::Max(pair.a, pair.b));
      }
    }
    const auto clamped = hn::Min(hn::Max(value, least), largest);
    // What is interpolated from voxels that are not finite is neither.
    const auto finite = hn::IsFinite(value);
    if (!hn::AllTrue(FloatTag(), hn::Or(hn::Not(owned), finite))) {
      const ProjectedSamples others = SamplesOfFinite(n, place, owned);
      return {hn::IfThenElse(finite, clamped, others.values), hn::Or(hn::And(owned, finite), others.valid)};
    }
    return {clamped, owned};
  }
}

HWY_INLINE Floats ValueOf(const ProjectWork& work, Floats samples) {
  const auto value = hn::Mul(hn::Sub(samples, Set(work.values.low)), Set(work.values.scale));
  return hn::Abs(hn::Min(hn::Max(value, hn::Zero(FloatTag())), Set(1)));  // without a sign of 0
}

// The rays among the voxels, and their samples that lie there.
struct RaysThere {
  RayPacket among;
  SampleInterval owned;
};
HWY_INLINE RaysThere RaysAmongVoxels(const ProjectWork& work, const RayPacket& packet, Floats ray_ends) {
  const RayBox& box = *work.box;
  SampleInterval owned = OwnedSamples(packet, box);
  owned.end = hn::Min(owned.end, hn::Ceil(ray_ends));
  if (work.field == nullptr) return {AmongVoxels(packet, box), owned};
  const RayPacket among = AmongVoxels(packet, *work.field);
  if (work.field->everywhere) return {among, owned};
  const SampleInterval shown = SamplesInside(among, work.field->low, work.field->high, box.reach.begin, box.reach.end);
  return {among, {hn::Max(owned.begin, shown.begin), hn::Min(owned.end, shown.end)}};
}

// What a packet's rays have found: the largest sign * sample so far, and, in a rectilinear grid, which sample it was.
struct Findings {
  Floats best, at;
  Mask any;
};

// Of a rectilinear grid if kStretched.
template <bool kStretched>
HWY_INLINE SamplePlace PlaceAt(const RayPacket& packet, const RayBox& box, Floats k) {
  if constexpr (kStretched) return PlaceStretched(packet, box, k);
  return PlaceSample(packet, box, k);
}
// Steps to leave the cube of `side` voxels that a ray is in.
template <bool kStretched>
HWY_INLINE Floats StepsToLeave(const RayBox& box, const LeapScales& scales, const SamplePlace& place, Ints side) {
  const auto ahead = hn::ConvertTo(FloatTag(), side);
  if constexpr (kStretched) return StretchedStepsWithin(box, scales, place, side, ahead);
  return StepsWithin(box, scales, place, side, ahead);
}

// A search along the rays of a packet in a rectilinear grid. They advance separately: where voxels are far apart, each leaps far.
struct Search {
  Floats k, direction;  // next sample of each ray; 1: forwards, -1: backwards
  LeapScales leaps;     // in this direction
  int blind = 0;        // next samples that are taken without a look at bounds
  int in_blocks = 0;    // next looks that leave out the bounds of blocks
};

// Goes on by one sample or leap. Returns false if there is none: all rays have left the box or found its extreme.
template <class T, bool kNearest>
HWY_INLINE bool Advance(const ProjectWork& work, const RayPacket& packet, const SampleInterval& owned, Search& search, Findings& found) {
  const FloatTag df;
  const IntTag di;
  const RayBox& box = *work.box;
  const SampleBounds& bounds = *work.bounds;
  const auto inside = hn::And(hn::Ge(search.k, owned.begin), hn::Lt(search.k, owned.end));
  const auto alive = hn::And(inside, hn::Lt(found.best, Set(bounds.most)));
  if (hn::AllFalse(df, alive)) return false;
  const SamplePlace place = PlaceStretched(packet, box, search.k);
  // Rays leap over blocks and cells whose bound does not exceed what was found; the others go on to their next sample.
  auto sampled = alive;
  auto steps = Set(1);
  if (search.blind > 0) {
    --search.blind;
  } else {
    auto dull_block = hn::Lt(Set(1), hn::Zero(df));
    if (search.in_blocks > 0) {
      --search.in_blocks;
    } else {
      const auto block = hn::GatherIndex(df, bounds.blocks.data(), CellOf<kBlockShift>(place, bounds.block_counts, alive));
      dull_block = hn::Le(block, found.best);
      // Most of the next looks are in the same blocks.
      if (hn::AllFalse(df, hn::And(dull_block, alive))) search.in_blocks = 4;
    }
    auto dull = dull_block;
    if (!hn::AllFalse(df, hn::AndNot(dull_block, alive))) {
      const auto cell = hn::GatherIndex(df, bounds.cells.data(), CellOf<kCellShift>(place, box.cells, alive));
      dull = hn::Or(dull, hn::Le(cell, found.best));
    }
    sampled = hn::AndNot(dull, alive);
    const auto side = hn::IfThenElse(hn::RebindMask(di, dull_block), SetInt(kBlockSide), SetInt(kCellSide));
    steps = hn::IfThenElse(dull, StepsToLeave<true>(box, search.leaps, place, side), steps);
    // Where no ray leaps, none will on the next few samples: they are mostly in the same cells.
    if (hn::AllFalse(df, hn::AndNot(sampled, alive))) search.blind = 2;
  }
  // If one ray takes its sample, all that are alive do: then its address need not wait for the bounds.
  if (!hn::AllFalse(df, sampled)) {
    const ProjectedSamples samples = SamplesAt<T, kNearest>(box, place, alive);
    const auto candidate = hn::Mul(samples.values, Set(work.sign));
    const auto larger = hn::And(samples.valid, hn::Gt(candidate, found.best));
    found.best = hn::IfThenElse(larger, candidate, found.best);
    found.at = hn::IfThenElse(larger, search.k, found.at);
    found.any = hn::Or(found.any, samples.valid);
  }
  search.k = hn::MulAdd(steps, search.direction, search.k);  // whole numbers: exact
  return true;
}

// The samples at which the searches of a packet begin. Together they pass all samples if behind >= ahead - 1. The nearer they are to the
// extremes of its rays, the more is leapt over.
struct Hint {
  Floats ahead, behind;
};

template <class T, bool kNearest>
HWY_INLINE void SearchBothWays(const ProjectWork& work, const RayPacket& packet, const SampleInterval& owned, const Hint& hint,
                               Findings& found) {
  const auto one = Set(1);
  RayPacket reversed = packet;
  for (Floats& move : reversed.move) move = hn::Neg(move);
  Search forwards = {hn::Max(hint.ahead, owned.begin), one, LeapScalesOf(packet), 1};
  Search backwards = {hn::Min(hint.behind, hn::Sub(owned.end, one)), Set(-1), LeapScalesOf(reversed)};
  // In turns: while one waits for memory, the other goes on.
  for (bool ahead = true, behind = true; ahead || behind;) {
    ahead = ahead && Advance<T, kNearest>(work, packet, owned, forwards, found);
    behind = behind && Advance<T, kNearest>(work, packet, owned, backwards, found);
  }
}

// Searches an even grid. The section with the largest bound comes first: after it, most others have nothing larger.
template <class T, bool kNearest>
HWY_INLINE void SearchSections(const ProjectWork& work, const RayPacket& packet, const SampleInterval& owned, Findings& found) {
  const FloatTag df;
  const RayBox& box = *work.box;
  const auto some = hn::Lt(owned.begin, owned.end);
  const float end = LargestOf(hn::IfThenElse(some, owned.end, Set(-kRayEnd)));
  Sections sections;
  for (float begin = LeastOf(hn::IfThenElse(some, owned.begin, Set(kRayEnd))); begin < end;
       begin += float(sections.count) * sections.length) {
    FindSections(work, packet, begin, end, sections);
    for (int i = 0; i < sections.count; ++i) {
      // From the first one on, and then back from it.
      const int number = i < sections.count - sections.first ? sections.first + i : sections.count - 1 - i;
      if (hn::AllFalse(df, hn::And(some, hn::Lt(found.best, Set(sections.bounds[number]))))) continue;
      const float from = begin + float(number) * sections.length, to = std::min(from + sections.length, end);
      for (float k = from; k < to; ++k) {
        const auto sample = Set(k);
        const auto inside = hn::And(hn::Ge(sample, owned.begin), hn::Lt(sample, owned.end));
        const SamplePlace place = PlaceSample(packet, box, sample);
        const auto bound = hn::GatherIndex(df, work.bounds->cells.data(), CellOf<kCellShift>(place, box.cells, inside));
        if (hn::AllFalse(df, hn::And(inside, hn::Lt(found.best, bound)))) continue;
        const ProjectedSamples samples = SamplesAt<T, kNearest>(box, place, inside);
        const auto candidate = hn::Mul(samples.values, Set(work.sign));
        found.best = hn::IfThenElse(hn::And(samples.valid, hn::Gt(candidate, found.best)), candidate, found.best);
        found.any = hn::Or(found.any, samples.valid);
      }
    }
  }
}

template <class T, bool kNearest, bool kStretched>
HWY_INLINE void SearchSamples(const ProjectWork& work, const RayPacket& packet, const SampleInterval& owned, const Hint& hint,
                              Findings& found) {
  if constexpr (kStretched) {
    SearchBothWays<T, kNearest>(work, packet, owned, hint, found);
  } else {
    SearchSections<T, kNearest>(work, packet, owned, found);
  }
}

// Returns whether any of a packet's rays has a sample in the box; `pixels` then holds them all.
template <class T, bool kNearest, bool kStretched>
HWY_INLINE bool ExtremeOfPacket(const ProjectWork& work, const RayPacket& packet, Floats ray_ends, Hint& hint, float* HWY_RESTRICT pixels) {
  const FloatTag df;
  const auto [among, owned] = RaysAmongVoxels(work, packet, ray_ends);
  const auto one = Set(1);
  Findings found = {Set(std::numeric_limits<float>::lowest()), owned.begin, hn::Lt(one, hn::Zero(df))};
  if (work.rays->clip.empty()) {
    SearchSamples<T, kNearest, kStretched>(work, among, owned, hint, found);
  } else {
    PacketPart parts[2];
    PartsOf(work.rays->clip, packet, parts);
    for (const PacketPart& part : parts) SearchSamples<T, kNearest, kStretched>(work, among, part.Of(owned), hint, found);
  }
  if constexpr (kStretched) {
    // The mean place of the extremes, for the next packet. One hint for all: rays that stay together read the same memory.
    const auto mean = hn::Floor(hn::Mul(hn::SumOfLanes(df, found.at), Set(1.0F / float(kLanes))));
    hint = {mean, hn::Sub(mean, one)};
  }
  if (hn::AllFalse(df, found.any)) return false;
  auto value = ValueOf(work, hn::Mul(found.best, Set(work.sign)));
  if (work.complement) value = hn::Sub(one, value);
  const auto zero = hn::Zero(df);
  hn::StoreInterleaved4(hn::IfThenElseZero(found.any, value), zero, zero, hn::IfThenElseZero(found.any, one), df, pixels);
  return true;
}

// Sums of 24-bit values, byte by byte.
struct ByteSums {
  Ints high, middle, low, count;

  HWY_INLINE void Add(Ints fixed, Ints samples) {
    const auto byte = SetInt(0xFF);
    high = hn::Add(high, hn::Mul(hn::ShiftRight<16>(fixed), samples));
    middle = hn::Add(middle, hn::Mul(hn::And(hn::ShiftRight<8>(fixed), byte), samples));
    low = hn::Add(low, hn::Mul(hn::And(fixed, byte), samples));
    count = hn::Add(count, samples);
  }
};
HWY_INLINE Ints FixedOf(const ProjectWork& work, Floats samples) {
  return hn::Min(hn::ConvertTo(IntTag(), hn::Mul(ValueOf(work, samples), Set(0x1p24F))), SetInt(0xFFFFFF));
}

// The value of all samples of a cell or block, where they have the same.
struct CommonValue {
  Ints fixed;
  Mask common;
};
HWY_INLINE CommonValue CommonValueOf(const ProjectWork& work, const std::vector<float>& bounds, const std::vector<float>& opposite,
                                     Ints cell) {
  const FloatTag df;
  const auto fixed = FixedOf(work, hn::Mul(Set(work.sign), hn::GatherIndex(df, bounds.data(), cell)));
  const auto other = FixedOf(work, hn::Mul(Set(-work.sign), hn::GatherIndex(df, opposite.data(), cell)));
  return {fixed, hn::RebindMask(df, hn::Eq(fixed, other))};
}

// Rays of a packet go on together: over whole blocks and cells where the samples of each have one value, or by one sample.
template <class T, bool kNearest, bool kStretched>
HWY_INLINE void SumSamples(const ProjectWork& work, const RayPacket& among, const SampleInterval& owned, ByteSums& sums) {
  const FloatTag df;
  const IntTag di;
  const RayBox& box = *work.box;
  const SampleBounds &bounds = *work.bounds, &opposite = *work.opposite;
  const LeapScales leaps = LeapScalesOf(among);
  const auto some = hn::Lt(owned.begin, owned.end);
  const float end = LargestOf(hn::IfThenElse(some, owned.end, Set(-kRayEnd)));
  float k = LeastOf(hn::IfThenElse(some, owned.begin, Set(kRayEnd)));
  for (int blind = 0; k < end;) {
    const auto sample = Set(k);
    const auto active = hn::And(hn::Ge(sample, owned.begin), hn::Lt(sample, owned.end));
    const SamplePlace place = PlaceAt<kStretched>(among, box, sample);
    // `steps`: to leave the cell. Rays that begin later wait until they do.
    const auto leap = [&](const CommonValue& value, Floats steps) HWY_ATTR {
      const auto later = hn::And(some, hn::Lt(sample, owned.begin));
      const auto limited = hn::IfThenElse(active, steps, hn::IfThenElse(later, hn::Sub(owned.begin, sample), Set(kRayEnd)));
      const float next = k + LeastOf(limited);
      const auto samples = hn::IfThenElseZero(active, hn::Sub(hn::Min(owned.end, Set(next)), sample));
      sums.Add(value.fixed, hn::ConvertTo(di, samples));
      k = next;
    };
    const auto leaps_over = [&](const CommonValue& value) HWY_ATTR { return hn::AllTrue(df, hn::Or(hn::Not(active), value.common)); };
    // Samples near voxels that are not finite may lie outside the bounds.
    if (std::is_integral_v<T> && blind-- <= 0) {
      const auto block = CommonValueOf(work, bounds.blocks, opposite.blocks, CellOf<kBlockShift>(place, bounds.block_counts, active));
      if (leaps_over(block)) {
        leap(block, StepsToLeave<kStretched>(box, leaps, place, SetInt(kBlockSide)));
        continue;
      }
      const auto cell = CommonValueOf(work, bounds.cells, opposite.cells, CellOf<kCellShift>(place, box.cells, active));
      if (leaps_over(cell)) {
        leap(cell, StepsToLeave<kStretched>(box, leaps, place, SetInt(kCellSide)));
        continue;
      }
      blind = 3;
    }
    const ProjectedSamples samples = SamplesAt<T, kNearest>(box, place, active);
    const auto valid = hn::RebindMask(di, samples.valid);
    sums.Add(FixedOf(work, samples.values), hn::IfThenElseZero(valid, SetInt(1)));
    k += 1;
  }
}

// Not inlined: the loop of extremes beside it would be slower.
template <class T, bool kNearest, bool kStretched>
HWY_NOINLINE bool SumOfPacket(const ProjectWork& work, const RayPacket& packet, Floats ray_ends, float* HWY_RESTRICT pixels) {
  const FloatTag df;
  const IntTag di;
  const auto [among, whole] = RaysAmongVoxels(work, packet, ray_ends);
  const auto zero = hn::Zero(di);
  ByteSums sums = {zero, zero, zero, zero};
  if (work.rays->clip.empty()) {
    SumSamples<T, kNearest, kStretched>(work, among, whole, sums);
  } else {
    PacketPart parts[2];
    PartsOf(work.rays->clip, packet, parts);
    for (const PacketPart& part : parts) SumSamples<T, kNearest, kStretched>(work, among, part.Of(whole), sums);
  }
  if (hn::AllTrue(di, hn::Eq(sums.count, zero))) return false;
  hn::StoreInterleaved4(hn::ConvertTo(df, sums.high), hn::ConvertTo(df, sums.middle), hn::ConvertTo(df, sums.low),
                        hn::ConvertTo(df, sums.count), df, pixels);
  return true;
}

template <class T, bool kNearest, bool kStretched>
HWY_INLINE void ProjectPackets(const ProjectWork& work, const PixelBounds& tile, float* HWY_RESTRICT pixels, std::size_t floats_a_row) {
  Hint hint = {hn::Zero(FloatTag()), Set(1e9F)};  // none: the first packet searches from both ends
  const bool has_shapes = work.shapes != nullptr && !work.shapes->empty();
  PacketShapes shapes;
  ForEachPacket(*work.rays, tile, pixels, floats_a_row,
                [&](const RayPacket& packet, float* HWY_RESTRICT result, std::int32_t x, std::int32_t y) HWY_ATTR {
                  auto ends = Set(kRayEnd);
                  if (has_shapes && LoadShapes(*work.shapes, *work.order, *work.rays, *work.box, tile, x, y, shapes)) {
                    ends = hn::Load(FloatTag(), shapes.ends.data());
                  }
                  return work.opposite == nullptr ? ExtremeOfPacket<T, kNearest, kStretched>(work, packet, ends, hint, result)
                                                  : SumOfPacket<T, kNearest, kStretched>(work, packet, ends, result);
                });
}

template <class T>
HWY_INLINE void Project(const ProjectWork& work, const PixelBounds& tile, float* HWY_RESTRICT pixels, std::size_t floats_a_row) {
  if (work.box->stretch != nullptr) {
    work.nearest ? ProjectPackets<T, true, true>(work, tile, pixels, floats_a_row)
                 : ProjectPackets<T, false, true>(work, tile, pixels, floats_a_row);
  } else if (work.nearest) {
    ProjectPackets<T, true, false>(work, tile, pixels, floats_a_row);
  } else {
    ProjectPackets<T, false, false>(work, tile, pixels, floats_a_row);
  }
}

void Project8(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t row) {
  Project<std::uint8_t>(work, tile, pixels, row);
}
void Project16(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t row) {
  Project<std::uint16_t>(work, tile, pixels, row);
}
void ProjectFloat(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t row) {
  Project<float>(work, tile, pixels, row);
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Project8);
HWY_EXPORT(Project16);
HWY_EXPORT(ProjectFloat);

void ProjectTile(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t floats_a_row) {
  switch (work.box->type) {
    case ScalarType::kUint8: return HWY_DYNAMIC_DISPATCH(Project8)(work, tile, pixels, floats_a_row);
    case ScalarType::kUint16: return HWY_DYNAMIC_DISPATCH(Project16)(work, tile, pixels, floats_a_row);
    default: break;
  }
  HWY_DYNAMIC_DISPATCH(ProjectFloat)(work, tile, pixels, floats_a_row);
}

}  // namespace slabstream
#endif
