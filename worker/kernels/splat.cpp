#include "worker/kernels/splat.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/splat.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <vector>

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::ptrdiff_t kSegmentFloats = 4 * std::ptrdiff_t{kSegment};

// As many voxels to a vector as fit, up to four.
using TapTag = hn::CappedTag<float, 16>;
using TapVec = hn::Vec<TapTag>;

// Sum over taps of one sample, kept apart by block of 128 bits: tap n is in block n % (blocks of a vector).
template <std::int32_t kTaps>
HWY_INLINE TapVec SumTaps(const float* HWY_RESTRICT voxels, const float* HWY_RESTRICT weights, std::int32_t taps_given) {
  const TapTag d;
  constexpr std::int32_t kLanes = std::int32_t(hn::MaxLanes(TapTag()));
  const std::int32_t floats = 4 * (kTaps > 0 ? kTaps : taps_given);
  auto sum = hn::Mul(hn::LoadU(d, weights), hn::LoadU(d, voxels));
  std::int32_t n = kLanes;
  for (; n + kLanes <= floats; n += kLanes) sum = hn::MulAdd(hn::LoadU(d, weights + n), hn::LoadU(d, voxels + n), sum);
#if HWY_TARGET <= HWY_AVX3
  if (n < floats) {  // two more
    const hn::Half<TapTag> half;
    sum = hn::MulAdd(hn::ZeroExtendVector(d, hn::LoadU(half, weights + n)), hn::ZeroExtendVector(d, hn::LoadU(half, voxels + n)), sum);
  }
#endif
  return sum;
}

// Stores as many samples as fit into a vector; sample(i) gives the i-th, by blocks.
template <class Sample>
HWY_INLINE void StoreSamples(Sample&& sample, float* HWY_RESTRICT out) {
  const TapTag d;
#if HWY_TARGET <= HWY_AVX3
  // Adds halves, of samples 0 and 2 and of 1 and 3, then the two remaining blocks of each.
  const auto add_halves = [&](TapVec a, TapVec b)
                              HWY_ATTR { return hn::Add(hn::ConcatUpperLower(d, b, a), hn::ConcatLowerUpper(d, b, a)); };
  const auto even = add_halves(sample(0), sample(2)), odd = add_halves(sample(1), sample(3));
  hn::Store(hn::Add(hn::OddEvenBlocks(odd, even), hn::SwapAdjacentBlocks(hn::OddEvenBlocks(even, odd))), d, out);
#else
  if constexpr (hn::MaxLanes(TapTag()) == 8) {
    const auto left = sample(0), right = sample(1);
    hn::Store(hn::Add(hn::ConcatLowerLower(d, right, left), hn::ConcatUpperUpper(d, right, left)), d, out);
  } else {
    hn::Store(sample(0), d, out);
  }
#endif
}

// kTaps: padded taps, 0: any number.
template <std::int32_t kTaps>
HWY_INLINE void FilterSegments(const FootprintTable& footprint, const Lattice& lattice, const BeamWork& work) {
  constexpr std::int32_t kSamples = std::int32_t(hn::MaxLanes(TapTag())) / 4;
  const std::int32_t taps = kTaps > 0 ? kTaps : footprint.padded_taps;
  const float* HWY_RESTRICT weights = footprint.channel_weights.data();
  const float* HWY_RESTRICT voxels = work.voxels;
  const std::int64_t step = lattice.step;
  for (std::int32_t word = 0; word < work.words; ++word) {
    for (SegmentWord rest = work.wanted[word]; rest != 0; rest &= rest - 1) {
      const std::int32_t segment = FirstSegment(rest, word);
      std::int64_t at = lattice.At(work.first_sample + segment * kSegment);
      float* HWY_RESTRICT out = work.out + segment * kSegmentFloats;
      for (std::int32_t i = 0; i < kSegment; i += kSamples, at += kSamples * step, out += 4 * kSamples) {
        const auto sample = [&](std::int64_t n) HWY_ATTR {
          const std::int64_t here = at + n * step;
          return SumTaps<kTaps>(voxels + 4 * std::ptrdiff_t{Lattice::First(here)}, weights + Lattice::Phase(here) * std::size_t(4 * taps),
                                taps);
        };
        StoreSamples(sample, out);
      }
    }
  }
}

void Filter(const FootprintTable& footprint, const Lattice& lattice, const BeamWork& work) {
  switch (footprint.padded_taps) {
    case 4: FilterSegments<4>(footprint, lattice, work); break;
    case 6: FilterSegments<6>(footprint, lattice, work); break;
    default: FilterSegments<0>(footprint, lattice, work); break;
  }
}

alignas(64) constexpr float kNothing[kSegmentFloats] = {};

// kTaps 0: any number.
template <std::int32_t kTaps>
HWY_INLINE void CompositeSegments(const RowWork& work) {
  const hn::CappedTag<float, 16> d;  // up to four pixels
  using V = hn::Vec<decltype(d)>;
  const std::ptrdiff_t lanes = std::ptrdiff_t(hn::Lanes(d));
  const std::int32_t taps = kTaps > 0 ? kTaps : work.taps;
  V weights[kTaps > 0 ? kTaps : 1];
  if constexpr (kTaps > 0) {
    for (std::int32_t n = 0; n < kTaps; ++n) weights[n] = hn::Set(d, work.weights[n]);
  }
  const auto weight = [&](std::int32_t n) HWY_ATTR {
    if constexpr (kTaps > 0) return weights[n];
    return hn::Set(d, work.weights[n]);
  };
  std::vector<const float*> many(kTaps > 0 ? 0 : std::size_t(taps));
  const float* few[kTaps > 0 ? kTaps : 1];
  const float** const beams = kTaps > 0 ? few : many.data();
  const auto one = hn::Set(d, 1.0F);
  for (std::int32_t word = 0; word < work.words; ++word) {
    SegmentWord any = 0;
    for (std::int32_t n = 0; n < taps; ++n) any |= work.filled[n][word];
    for (SegmentWord rest = any & work.open[word]; rest != 0; rest &= rest - 1) {
      const std::int32_t segment = FirstSegment(rest, word);
      const SegmentWord bit = rest & ~(rest - 1);
      for (std::int32_t n = 0; n < taps; ++n) {
        const float* filled = work.beams[n] + segment * kSegmentFloats;
        beams[n] = (work.filled[n][word] & bit) != 0 ? filled : kNothing;
      }
      float* HWY_RESTRICT accumulated = work.accumulated + segment * kSegmentFloats;
      auto least = one;
      for (std::ptrdiff_t i = 0; i < kSegmentFloats; i += lanes) {
        auto sheet = hn::Mul(weight(0), hn::Load(d, beams[0] + i));
        for (std::int32_t n = 1; n < taps; ++n) sheet = hn::MulAdd(weight(n), hn::Load(d, beams[n] + i), sheet);
        const auto front = hn::Load(d, accumulated + i);
        const auto sum = hn::MulAdd(hn::Sub(one, hn::Broadcast<3>(front)), sheet, front);
        hn::Store(sum, d, accumulated + i);
        least = hn::Min(least, hn::Broadcast<3>(sum));
      }
      if (hn::AllTrue(d, hn::Ge(least, hn::Set(d, work.opaque_alpha[segment])))) work.open[word] &= ~bit;
    }
  }
}

void Composite(const RowWork& work) {
  switch (work.taps) {
    case 4: CompositeSegments<4>(work); break;
    case 5: CompositeSegments<5>(work); break;
    case 6: CompositeSegments<6>(work); break;
    default: CompositeSegments<0>(work); break;
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Filter);
HWY_EXPORT(Composite);

void FilterBeam(const FootprintTable& footprint, const Lattice& lattice, const BeamWork& work) {
  HWY_DYNAMIC_DISPATCH(Filter)(footprint, lattice, work);
}
void CompositeRow(const RowWork& work) { HWY_DYNAMIC_DISPATCH(Composite)(work); }

}  // namespace slabstream
#endif
