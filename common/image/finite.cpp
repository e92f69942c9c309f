// AllFinite and AllDepths for every instruction set that the compiler knows. They read what was just written, so only their own arithmetic
// takes time.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/image/finite.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

#include "common/image/finite.h"

#ifndef SLABSTREAM_COMMON_IMAGE_FINITE_CPP_  // what is shared by all instruction sets
#define SLABSTREAM_COMMON_IMAGE_FINITE_CPP_
namespace slabstream {

// The bits of infinity. Without the sign, the bits of all finite numbers are smaller, those of NaNs larger.
inline constexpr std::uint32_t kInfinityBits = 0x7F800000, kSignBit = 0x80000000;

}  // namespace slabstream
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The largest of the `count` floats at `bytes`, as bits without sign.
std::uint32_t LargestMagnitude(const std::byte* bytes, std::size_t count) {
  std::uint32_t largest = 0;
  std::size_t i = 0;
  const hn::ScalableTag<std::uint32_t> d;
  const hn::Repartition<std::uint8_t, decltype(d)> d8;  // needs no alignment
  const std::size_t lanes = hn::Lanes(d);
  const auto* const from = reinterpret_cast<const std::uint8_t*>(bytes);
  const auto load = [&](std::size_t at)
                        HWY_ATTR { return hn::And(hn::BitCast(d, hn::LoadU(d8, from + sizeof(float) * at)), hn::Set(d, ~kSignBit)); };
  auto a = hn::Zero(d), b = a;
  for (; i + 2 * lanes <= count; i += 2 * lanes) {
    a = hn::Max(a, load(i));
    b = hn::Max(b, load(i + lanes));
  }
  largest = hn::GetLane(hn::MaxOfLanes(d, hn::Max(a, b)));
  for (; i < count; ++i) {
    std::uint32_t bits;
    std::memcpy(&bits, bytes + sizeof(bits) * i, sizeof(bits));
    largest = std::max(largest, bits & ~kSignBit);
  }
  return largest;
}

bool NoneBelowLeast(const float* depths, std::size_t count) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr float kLeast = std::numeric_limits<float>::lowest();
  auto good = hn::Eq(hn::Zero(d), hn::Zero(d));
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) good = hn::And(good, hn::Ge(hn::LoadU(d, depths + i), hn::Set(d, kLeast)));  // false for NaN
  bool rest = true;
  for (; i < count; ++i) rest &= depths[i] >= kLeast;
  return rest && hn::AllTrue(d, good);
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {

HWY_EXPORT(LargestMagnitude);
HWY_EXPORT(NoneBelowLeast);

bool AllFinite(std::span<const std::byte> floats) {
  constexpr std::size_t kBatch = 16384;  // floats between two checks of the result
  const std::size_t count = floats.size() / sizeof(float);
  for (std::size_t first = 0; first < count; first += kBatch) {
    const std::size_t some = std::min(kBatch, count - first);
    if (HWY_DYNAMIC_DISPATCH(LargestMagnitude)(floats.data() + sizeof(float) * first, some) >= kInfinityBits) return false;
  }
  return true;
}

bool AllDepths(std::span<const float> depths) { return HWY_DYNAMIC_DISPATCH(NoneBelowLeast)(depths.data(), depths.size()); }

}  // namespace slabstream
#endif
