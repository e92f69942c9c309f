// Values and gradients at samples, interpolated from GradientBricks. Included once for each instruction set, hence the unusual include
// guard.
//
// Whole voxels have the weights of WeightsAt, and all sums are whole numbers. Floating-point voxels are interpolated as elsewhere (Lerp).
// Either way every instruction set gives the same bits.
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "worker/rays/sample_look-inl.h"
#include "worker/renderers/raycast/gradient_bricks.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_RAYCAST_GRADIENT_BRICKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_RAYCAST_GRADIENT_BRICKS_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_RAYCAST_GRADIENT_BRICKS_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_RAYCAST_GRADIENT_BRICKS_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// --- Making bricks.

using ShortTag = hn::CappedTag<std::int16_t, 16>;
using WordTag = hn::RebindToUnsigned<ShortTag>;
using Words = hn::Vec<WordTag>;

// Samples from `at` on along x.
HWY_INLINE Words SamplesAt(WordTag d, const std::uint8_t* at) {
  return hn::PromoteTo(d, hn::LoadU(hn::Rebind<std::uint8_t, WordTag>(), at));
}
HWY_INLINE Words SamplesAt(WordTag d, const std::uint16_t* at) { return hn::LoadU(d, at); }
HWY_INLINE Floats SamplesAt(FloatTag d, const std::uint16_t* at) {
  return hn::ConvertTo(d, hn::PromoteTo(IntTag(), hn::LoadU(hn::Rebind<std::uint16_t, FloatTag>(), at)));
}
HWY_INLINE Floats SamplesAt(FloatTag d, const float* at) { return hn::LoadU(d, at); }

// Samples before and after others along an axis.
template <class V>
struct Around {
  V before, after;
};
template <class V>
struct CornerVectors {
  V value, x, y, z;
};
using ShortCorners = CornerVectors<hn::Vec<ShortTag>>;

HWY_INLINE ShortCorners CornersOf(std::uint8_t /*type*/, Words value, const Around<Words>& x, const Around<Words>& y,
                                  const Around<Words>& z) {
  const ShortTag ds;
  const auto difference = [&](const Around<Words>& of) HWY_ATTR { return hn::BitCast(ds, hn::Sub(of.after, of.before)); };
  return {hn::BitCast(ds, value), difference(x), difference(y), difference(z)};
}
HWY_INLINE CornerVectors<Floats> CornersOf(float /*type*/, Floats value, const Around<Floats>& x, const Around<Floats>& y,
                                           const Around<Floats>& z) {
  return {value, hn::Sub(x.after, x.before), hn::Sub(y.after, y.before), hn::Sub(z.after, z.before)};
}
// Values minus 32768. Where a difference does not fit into 16 bits, all three are those of halved samples.
HWY_INLINE ShortCorners CornersOf(std::uint16_t /*type*/, Words value, const Around<Words>& x, const Around<Words>& y,
                                  const Around<Words>& z) {
  const ShortTag ds;
  const WordTag du;
  // Negative where the difference does not fit.
  const auto size = [&](const Around<Words>& of) HWY_ATTR {
    return hn::BitCast(ds, hn::Or(hn::SaturatedSub(of.after, of.before), hn::SaturatedSub(of.before, of.after)));
  };
  const auto large = hn::Lt(hn::Or(hn::Or(size(x), size(y)), size(z)), hn::Zero(ds));
  const auto difference = [&](const Around<Words>& of) HWY_ATTR {
    const auto of_halves = hn::Sub(hn::ShiftRight<1>(of.after), hn::ShiftRight<1>(of.before));
    return hn::IfThenElse(large, hn::BitCast(ds, of_halves), hn::BitCast(ds, hn::Sub(of.after, of.before)));
  };
  return {hn::BitCast(ds, hn::Xor(value, hn::Set(du, 0x8000))), difference(x), difference(y), difference(z)};
}

// Writes the corners of a row, and up to eight more.
template <class D>
HWY_INLINE void StoreCorners(D d, const CornerVectors<hn::Vec<D>>& c, GradientCorner<hn::TFromD<D>>* to) {
  if constexpr (sizeof(hn::TFromD<D>) == 2 && hn::MaxLanes(D()) == 16) {
    static_assert(sizeof(*to) == 8);
    const hn::RepartitionToWide<D> dw;
    const auto wide = [&](hn::Vec<D> v) HWY_ATTR { return hn::BitCast(dw, v); };
    const auto vx_low = wide(hn::InterleaveLower(d, c.value, c.x)), yz_low = wide(hn::InterleaveLower(d, c.y, c.z));
    const auto vx_high = wide(hn::InterleaveUpper(d, c.value, c.x)), yz_high = wide(hn::InterleaveUpper(d, c.y, c.z));
    const hn::Half<decltype(dw)> half;
    const auto store = [&](auto pair, std::int32_t corner)
                           HWY_ATTR { hn::StoreU(pair, half, reinterpret_cast<std::int32_t*>(to + corner)); };
    const auto first = hn::InterleaveLower(dw, vx_low, yz_low);  // corners 0, 1, 8 and 9
    store(hn::LowerHalf(half, first), 0);
    store(hn::LowerHalf(half, hn::InterleaveUpper(dw, vx_low, yz_low)), 2);
    store(hn::LowerHalf(half, hn::InterleaveLower(dw, vx_high, yz_high)), 4);
    store(hn::LowerHalf(half, hn::InterleaveUpper(dw, vx_high, yz_high)), 6);
    store(hn::UpperHalf(half, first), 8);
  } else {
    hn::StoreInterleaved4(c.value, c.x, c.y, c.z, d, &to->value);
  }
}

// Where a brick's corners come from: `rows` rows and `slices` slices, `first` is the sample of the first corner.
template <class T>
struct BrickSource {
  const T* first;
  std::ptrdiff_t row, slice;
  std::int32_t rows, slices;
};

template <class T>
HWY_INLINE void MakeCorners(const BrickSource<T>& source, CornerOf<T>* corners) {
  using Tag = std::conditional_t<std::is_same_v<T, float>, FloatTag, WordTag>;
  const Tag d;
  const hn::Rebind<decltype(corners->value), Tag> of_corners;
  constexpr std::int32_t kAtOnce = std::int32_t(hn::MaxLanes(Tag()));
  const auto [first, row, slice, rows, slices] = source;
  // What is written beyond a row, later ones overwrite.
  for (std::int32_t x = (GradientBricks::kRow - 1) / kAtOnce * kAtOnce; x >= 0; x -= kAtOnce) {
    for (std::int32_t z = 0; z < slices; ++z) {
      const T* from = first + z * slice + x;
      CornerOf<T>* to = corners + z * GradientBricks::kSlice + x;
      auto before = SamplesAt(d, from - row), value = SamplesAt(d, from);
      for (std::int32_t y = 0; y < rows; ++y, from += row, to += GradientBricks::kRow) {
        const auto after = SamplesAt(d, from + row);
        StoreCorners(of_corners,
                     CornersOf(T(), value, {SamplesAt(d, from - 1), SamplesAt(d, from + 1)}, {before, after},
                               {SamplesAt(d, from - slice), SamplesAt(d, from + slice)}),
                     to);
        before = value;
        value = after;
      }
    }
  }
}

// Sums of 8-bit samples stay whole: Smoothed() leaves out the division by 4, and slope_unit() makes up for it.
HWY_INLINE Words Smoothed(Words before, Words at, Words after) { return hn::Add(hn::Add(before, after), hn::ShiftLeft<1>(at)); }
HWY_INLINE ShortCorners SmoothCornersOf(std::uint8_t /*type*/, Words value, Words x, Words y, Words z) {
  const ShortTag ds;
  return {hn::BitCast(ds, value), hn::BitCast(ds, x), hn::BitCast(ds, y), hn::BitCast(ds, z)};
}
// Slopes are rounded. Where one does not fit into 16 bits, all three are halved.
HWY_INLINE auto SmoothCornersOf(std::uint16_t /*type*/, Floats value, Floats x, Floats y, Floats z) {
  const FloatTag df;
  const hn::Rebind<std::int16_t, FloatTag> ds;
  const auto greatest = hn::Max(hn::Max(hn::Abs(x), hn::Abs(y)), hn::Abs(z));
  const auto unit = hn::IfThenElse(hn::Gt(greatest, Set(32767)), Set(0.5F), Set(1));
  const auto whole = [&](Floats v) HWY_ATTR { return hn::DemoteTo(ds, Nearest(v)); };
  return CornerVectors<hn::Vec<decltype(ds)>>{whole(hn::Sub(value, hn::Set(df, 32768.0F))), whole(hn::Mul(x, unit)),
                                              whole(hn::Mul(y, unit)), whole(hn::Mul(z, unit))};
}
HWY_INLINE CornerVectors<Floats> SmoothCornersOf(float /*type*/, Floats value, Floats x, Floats y, Floats z) { return {value, x, y, z}; }

// MakeCorners with smoothed gradients. Floats hold the sums of 16-bit samples exactly.
template <class T>
HWY_INLINE void MakeSmoothCorners(const BrickSource<T>& source, CornerOf<T>* corners) {
  using Tag = std::conditional_t<sizeof(T) == 1, WordTag, FloatTag>;
  using V = hn::Vec<Tag>;
  const Tag d;
  const hn::Rebind<decltype(corners->value), Tag> of_corners;
  constexpr std::int32_t kAtOnce = std::int32_t(hn::MaxLanes(Tag())), kRow = GradientBricks::kRow;
  const auto [first, row, slice, rows, slices] = source;
  // Of a row: its slopes along x and y, smoothed along y and x; z: its values, smoothed along both. Work along z follows.
  struct Row {
    V x, y, z;
  };
  for (std::int32_t x = (kRow - 1) / kAtOnce * kAtOnce; x >= 0; x -= kAtOnce) {
    Row last[3][kRow];  // of three slices
    for (std::int32_t z = 0; z < slices + 2; ++z) {
      Row* const behind = last[(z + 1) % 3];
      Row* const middle = last[(z + 2) % 3];
      Row* const ahead = last[z % 3];
      const T* from = first + (z - 1) * slice - row + x;
      struct AlongX {
        V slope, smooth;
      };
      const auto along_x = [&]() HWY_ATTR {
        const V before = SamplesAt(d, from - 1), after = SamplesAt(d, from + 1);
        const AlongX found = {hn::Sub(after, before), Smoothed(before, SamplesAt(d, from), after)};
        from += row;
        return found;
      };
      AlongX a = along_x(), b = along_x();
      for (std::int32_t y = 0; y < rows; ++y) {
        const AlongX c = along_x();
        ahead[y] = {Smoothed(a.slope, b.slope, c.slope), hn::Sub(c.smooth, a.smooth), Smoothed(a.smooth, b.smooth, c.smooth)};
        a = b;
        b = c;
      }
      if (z < 2) continue;
      CornerOf<T>* to = corners + (z - 2) * GradientBricks::kSlice + x;
      const T* value = first + (z - 2) * slice + x;
      for (std::int32_t y = 0; y < rows; ++y, value += row, to += kRow) {
        StoreCorners(of_corners,
                     SmoothCornersOf(T(), SamplesAt(d, value), Smoothed(behind[y].x, middle[y].x, ahead[y].x),
                                     Smoothed(behind[y].y, middle[y].y, ahead[y].y), hn::Sub(ahead[y].z, behind[y].z)),
                     to);
      }
    }
  }
}

template <class T>
HWY_INLINE void MakeCornersOf(const BrickSource<T>& source, bool smooth, CornerOf<T>* corners) {
  if (smooth) {
    MakeSmoothCorners(source, corners);
  } else {
    MakeCorners(source, corners);
  }
}

template <class T>
HWY_NOINLINE void MakeBrick(const RayBox& box, std::int32_t number, GradientBricks& bricks, std::int32_t first) {
  constexpr std::int32_t kRead = 18;  // samples along x, from the one before the first corner: whole registers
  const Index3 begin = GradientBricks::kSide * bricks.BrickAt(number);
  // Samples of the padded voxels that the brick's corners need, from `begin` on.
  const Index3 left = box.padded - begin;
  const std::int32_t rows = std::min(GradientBricks::kRow, left.y - 2), slices = std::min(GradientBricks::kRow, left.z - 2);
  const T* const samples = reinterpret_cast<const T*>(box.samples);
  const T* const from = samples + std::ptrdiff_t{begin.z} * box.slice + std::ptrdiff_t{begin.y} * box.row + begin.x;
  CornerOf<T>* const corners = bricks.corners<T>() + first;
  const T* const end = samples + std::ptrdiff_t{box.padded.z} * box.slice;
  if (from + std::ptrdiff_t{slices + 1} * box.slice + std::ptrdiff_t{rows + 1} * box.row + kRead <= end) {
    MakeCornersOf<T>({from + 1 + box.row + box.slice, box.row, box.slice, rows, slices}, bricks.smooth(), corners);
    return;
  }
  // Whole registers would read beyond the last sample.
  constexpr std::int32_t kAround = GradientBricks::kRow + 2;
  T copy[kAround * kAround * kRead] = {};
  for (std::int32_t z = 0; z < slices + 2; ++z) {
    for (std::int32_t y = 0; y < rows + 2; ++y) {
      std::copy_n(from + std::ptrdiff_t{z} * box.slice + std::ptrdiff_t{y} * box.row, std::min(kAround, left.x),
                  copy + (z * kAround + y) * kRead);
    }
  }
  MakeCornersOf<T>({copy + 1 + kRead + kAround * kRead, kRead, kAround * kRead, rows, slices}, bricks.smooth(), corners);
}

// --- Reading them.

// Samples among the corners of bricks.
struct BrickPlace {
  Ints number;         // the brick's number
  Ints within;         // from the brick's first corner to the sample's
  LaneNumbers corner;  // the sample's first one

  // Returns which bricks are not there.
  HWY_INLINE hn::Mask<IntTag> Find(const GradientBricks& bricks) {
    const auto first = hn::GatherIndex(IntTag(), bricks.firsts(), number);
    corner.Set(hn::Add(first, within));
    return hn::Lt(first, hn::Zero(IntTag()));
  }
};

// Makes the bricks of `place` that are not there, and those of `before`, which has been found and not been read yet.
template <class T>
HWY_NOINLINE void MakeBricks(const RayBox& box, GradientBricks& bricks, BrickPlace& place, BrickPlace& before) {
  // Returns whether all were there. To make one may take others away.
  const auto make = [&](Ints numbers) HWY_ATTR {
    LaneNumbers number;
    number.Set(numbers);
    bool all = true;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (bricks.firsts()[number[lane]] != GradientBricks::kNone) continue;
      all = false;
      MakeBrick<T>(box, number[lane], bricks, bricks.Add(number[lane]));
    }
    return all;
  };
  while (!make(place.number) || !make(before.number)) continue;
  place.Find(bricks);
  before.Find(bricks);
}

// Finds samples in bricks. Rays that are not `inside` get a corner that may be read: what is read never waits for what became of a ray.
// `before`: as in MakeBricks.
template <class T>
HWY_INLINE void FindInBricks(const RayBox& box, const SamplePlace& place, Mask inside, GradientBricks& bricks, BrickPlace& found,
                             BrickPlace& before) {
  constexpr int kShift = GradientBricks::kShift;
  const IntTag di;
  const Index3& counts = bricks.counts();
  const auto row = hn::Add(hn::Mul(hn::ShiftRight<kShift>(place.voxel[2]), SetInt(counts.y)), hn::ShiftRight<kShift>(place.voxel[1]));
  const auto number = hn::Add(hn::Mul(row, SetInt(counts.x)), hn::ShiftRight<kShift>(place.voxel[0]));
  found.number = hn::IfThenElseZero(hn::RebindMask(di, inside), hn::Add(number, SetInt(1)));
  const auto within = SetInt(GradientBricks::kSide - 1);
  const auto z = hn::And(place.voxel[2], within), y = hn::And(place.voxel[1], within), x = hn::And(place.voxel[0], within);
  const auto nine = [&](Ints i) HWY_ATTR { return hn::Add(hn::ShiftLeft<3>(i), i); };
  static_assert(GradientBricks::kRow == 9);
  found.within = hn::Add(nine(hn::Add(nine(z), y)), x);
  if (!hn::AllFalse(di, found.Find(bricks))) MakeBricks<T>(box, bricks, found, before);
}

struct LitSample {
  Floats value;
  Gradient gradient;
};
// Where values are finite: whole numbers always are.
template <class T>
HWY_INLINE Mask FiniteOf(Floats value) {
  if constexpr (!std::is_same_v<T, float>) return hn::Le(hn::Zero(FloatTag()), Set(1));
  return hn::Le(hn::Abs(value), Set(std::numeric_limits<float>::max()));
}

// Entries of a table, four floats each. `index`: where they begin, in floats.
using Entries = FourNumbers<FloatTag>;
HWY_INLINE Entries EntriesAt(const float* table, const LaneNumbers& index) { return FourNumbersAt(FloatTag(), table, index); }

// `index`: BrickPlace::corner.
template <class T>
HWY_INLINE LitSample InterpolateCorners(GradientBricks& bricks, const LaneNumbers& index, const CornerWeights& weights) {
  const FloatTag df;
  const IntTag di;
  const hn::RepartitionToNarrow<IntTag> ds;
  // Neighbours along x side by side, for each of the four numbers.
  HWY_ALIGN static constexpr std::uint8_t kPairs[16] = {0, 1, 8, 9, 2, 3, 10, 11, 4, 5, 12, 13, 6, 7, 14, 15};
  const auto pairs = hn::BitCast(ds, hn::LoadDup128(hn::Repartition<std::uint8_t, IntTag>(), kPairs));
  Ints sums[4];
  // Lanes `group`, 4 + group and so on: one to a block.
  const auto sum_of = [&](auto number) SLABSTREAM_INLINED {
    constexpr int kGroup = decltype(number)::value;
    Ints sum = hn::Zero(di), rest = hn::Zero(di);
    for (int z = 0; z < 2; ++z) {
      for (int y = 0; y < 2; ++y) {
        const CornerOf<T>* const row = bricks.corners<T>() + z * GradientBricks::kSlice + y * GradientBricks::kRow;
        const auto voxels = FromBlocks(ds, [&](std::size_t lane) HWY_ATTR { return &row[index[lane + kGroup]].value; });
        const auto weight = hn::BitCast(ds, hn::Broadcast<kGroup>(weights.pairs[z][y]));
        sum = hn::ReorderWidenMulAccumulate(di, hn::TableLookupBytes(voxels, pairs), weight, sum, rest);
      }
    }
    return hn::RearrangeToOddPlusEven(sum, rest);
  };
  sums[0] = sum_of(std::integral_constant<int, 0>());
  sums[1] = sum_of(std::integral_constant<int, 1>());
  sums[2] = sum_of(std::integral_constant<int, 2>());
  sums[3] = sum_of(std::integral_constant<int, 3>());
  TurnBlocks(di, sums);
  constexpr float kUnit = 1.0F / (1 << 14);
  const auto slope_unit = Set(kUnit * bricks.slope_unit());
  const auto slope = [&](Ints sum) HWY_ATTR { return hn::Mul(hn::ConvertTo(df, sum), slope_unit); };
  if constexpr (sizeof(T) == 2) sums[0] = hn::Add(sums[0], SetInt(32768 << 14));
  return {hn::Mul(hn::ConvertTo(df, sums[0]), Set(kUnit)), {slope(sums[1]), slope(sums[2]), slope(sums[3])}};
}

// Of floating-point voxels: along x, then y, then z.
HWY_INLINE LitSample InterpolateFloatCorners(GradientBricks& bricks, const LaneNumbers& index, const CellPlace& place) {
  const FloatTag df;
  Floats of[4];
  const auto at = [&](auto number) SLABSTREAM_INLINED {
    constexpr int kGroup = decltype(number)::value;
    Floats fraction[3], slices[2];
    for (std::size_t i = 0; i < 3; ++i) fraction[i] = hn::Broadcast<kGroup>(place.fraction[i]);
    for (int z = 0; z < 2; ++z) {
      Floats rows[2];
      for (int y = 0; y < 2; ++y) {
        const CornerOf<float>* const row = bricks.corners<float>() + z * GradientBricks::kSlice + y * GradientBricks::kRow;
        const auto corner = [&](int x) HWY_ATTR {
          return FromBlocks(df, [&](std::size_t lane) HWY_ATTR { return &row[index[lane + kGroup] + x].value; });
        };
        rows[y] = Lerp(fraction[0], corner(0), corner(1));
      }
      slices[z] = Lerp(fraction[1], rows[0], rows[1]);
    }
    return Lerp(fraction[2], slices[0], slices[1]);
  };
  of[0] = at(std::integral_constant<int, 0>());
  of[1] = at(std::integral_constant<int, 1>());
  of[2] = at(std::integral_constant<int, 2>());
  of[3] = at(std::integral_constant<int, 3>());
  TurnBlocks(df, of);
  return {of[0], {of[1], of[2], of[3]}};
}

// The weights of a sample's corners, for all fields on a grid.
struct BrickWeights {
  const CellPlace& place;
  CornerWeights whole;
  HWY_INLINE explicit BrickWeights(const CellPlace& of) : place(of), whole(WeightsAt(of)) {}
};
template <class T>
HWY_INLINE LitSample ReadBricks(GradientBricks& bricks, const LaneNumbers& corner, const BrickWeights& weights) {
  if constexpr (std::is_same_v<T, float>) {
    return InterpolateFloatCorners(bricks, corner, weights.place);
  } else {
    return InterpolateCorners<T>(bricks, corner, weights.whole);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
