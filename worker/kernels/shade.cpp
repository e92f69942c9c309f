#include "worker/kernels/shade.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/shade.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#ifndef SLABSTREAM_WORKER_KERNELS_SHADE_CPP_  // shared by all instruction sets
#define SLABSTREAM_WORKER_KERNELS_SHADE_CPP_
namespace slabstream {

inline float LevelOf(const ShadeTables& tables, const OctetWork& octet, float slope_step, int voxel) {
  const float slope = octet.slope + float(voxel) * slope_step;
  return std::clamp(std::sqrt(octet.across + slope * slope) * tables.level_scale - tables.level_offset, 0.0F, tables.last_level);
}

inline PhongFactors Shared(const PhongFactors& factors, const OctetShares& shares, std::size_t voxel) {
  return {factors.diffuse * shares.scale[voxel][0] + shares.add[voxel][0],
          factors.specular * shares.scale[voxel][1] + shares.add[voxel][1]};
}

}  // namespace slabstream
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using VoxelTag = hn::FixedTag<float, 4>;  // the channels of a voxel

#if HWY_TARGET <= HWY_AVX3

// Four voxels to a vector, a whole octet at a time. Occupancy selects what is loaded and kept, not what is executed: a loop over the
// occupied voxels would be mispredicted at most octets of a shell.
using QuadTag = hn::FixedTag<float, 16>;
using HalfQuadTag = hn::FixedTag<float, 8>;

// Lanes of HalfQuad pairs ahead of kZeroOne, a pair for each voxel: its first one in the colours' lanes, then 0; its second one, then 1.
alignas(64) constexpr std::int32_t kFirstOfPair[] = {0, 0, 0, 8, 2, 2, 2, 8, 4, 4, 4, 8, 6, 6, 6, 8};
alignas(64) constexpr std::int32_t kSecondOfPair[] = {1, 1, 1, 9, 3, 3, 3, 9, 5, 5, 5, 9, 7, 7, 7, 9};
alignas(32) constexpr float kZeroOne[] = {0, 1, 0, 0, 0, 0, 0, 0};
// From eight voxels' floats, those of the first and of the last four, each repeated for all channels of its voxel.
alignas(64) constexpr std::int32_t kOfVoxel[][16] = {{0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3},
                                                     {4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7}};

// Loads voxels begin ... begin + 3. at(i): address of the four floats of voxel i.
template <class At>
HWY_INLINE hn::Vec<QuadTag> LoadVoxels(At&& at, std::size_t begin) {
  const VoxelTag d;
  const HalfQuadTag half;
  return hn::Combine(QuadTag(), hn::Combine(half, hn::Load(d, at(begin + 3)), hn::Load(d, at(begin + 2))),
                     hn::Combine(half, hn::Load(d, at(begin + 1)), hn::Load(d, at(begin))));
}

// The same for two floats.
template <class At>
HWY_INLINE hn::Vec<HalfQuadTag> LoadPairs(At&& at, std::size_t begin) {
  const hn::FixedTag<float, 2> d;
  const VoxelTag two;
  return hn::Combine(HalfQuadTag(), hn::Combine(two, hn::LoadU(d, at(begin + 3)), hn::LoadU(d, at(begin + 2))),
                     hn::Combine(two, hn::LoadU(d, at(begin + 1)), hn::LoadU(d, at(begin))));
}

// By mask: the record of each voxel of an octet, counted from its first one; for empty voxels, any existing one.
constexpr auto kRecordOf = [] {
  std::array<std::array<std::uint8_t, kOctet>, 1 << kOctet> record{};
  for (std::uint32_t mask = 1; mask < record.size(); ++mask) {
    for (std::uint32_t i = 0; i < kOctet; ++i) {
      record[mask][i] = std::uint8_t(std::min(std::popcount(mask & ((1U << i) - 1)), std::popcount(mask) - 1));
    }
  }
  return record;
}();

// By a mask of four voxels: their lanes.
constexpr auto kQuadLanes = [] {
  std::array<std::uint16_t, 16> lanes{};
  for (std::uint32_t mask = 0; mask < lanes.size(); ++mask) {
    for (std::uint32_t lane = 0; lane < 16; ++lane) lanes[mask] = std::uint16_t(lanes[mask] | (mask >> lane / 4 & 1) << lane);
  }
  return lanes;
}();

template <bool kLevels, bool kLit>
HWY_INLINE void ShadeAll(const ShadeTables& tables, float slope_step, std::span<const OctetWork> octets) {
  const QuadTag d;
  const HalfQuadTag half;
  const hn::FixedTag<std::int32_t, kOctet> whole;
  const auto zero_one = hn::Load(half, kZeroOne);
  const auto first = hn::SetTableIndices(d, kFirstOfPair), second = hn::SetTableIndices(d, kSecondOfPair);
  const auto one = hn::Set(d, 1.0F);
  const float* HWY_RESTRICT colors = tables.color.data();
  const float* HWY_RESTRICT opacities = tables.opacity.data();
  const PhongFactors* HWY_RESTRICT by_normal = tables.by_normal.data();
  const auto levels = std::size_t(tables.levels);
  for (const OctetWork& octet : octets) {
    const auto record = [&, of = kRecordOf[octet.occupied].data()](std::size_t i) -> const VoxelRecord& { return octet.records[of[i]]; };
    auto by_level = hn::Zero(half);  // opacities of the voxels
    if constexpr (kLevels) {
      const auto slope = hn::MulAdd(hn::Iota(half, 0.0F), hn::Set(half, slope_step), hn::Set(half, octet.slope));
      const auto length = hn::Sqrt(hn::MulAdd(slope, slope, hn::Set(half, octet.across)));
      const auto level =
          hn::Min(hn::Max(hn::MulSub(length, hn::Set(half, tables.level_scale), hn::Set(half, tables.level_offset)), hn::Zero(half)),
                  hn::Set(half, tables.last_level));
      const auto floor = hn::ConvertTo(whole, level);
      alignas(32) std::int32_t below[kOctet];
      hn::Store(floor, whole, below);
      const auto at = [&](std::size_t i) { return opacities + levels * std::size_t{record(i).bin} + below[i]; };
      const auto pairs = hn::Combine(d, LoadPairs(at, 4), LoadPairs(at, 0));
      const auto low = hn::LowerHalf(hn::ConcatEven(d, pairs, pairs)), high = hn::LowerHalf(hn::ConcatOdd(d, pairs, pairs));
      by_level = hn::MulAdd(hn::Sub(level, hn::ConvertTo(half, floor)), hn::Sub(high, low), low);
    }
    for (std::size_t begin = 0; begin < kOctet; begin += 4) {
      const auto color = LoadVoxels([&](std::size_t i) { return colors + 4 * std::size_t{record(i).bin}; }, begin);
      auto pairs = LoadPairs([&](std::size_t i) { return &by_normal[record(i).normal].diffuse; }, begin);
      if constexpr (kLit) pairs = hn::MulAdd(pairs, hn::Load(half, octet.shares->scale[begin]), hn::Load(half, octet.shares->add[begin]));
      const auto factors = hn::Combine(d, zero_one, pairs);
      // 1 in the fourth channel.
      const auto shaded = hn::Min(hn::MulAdd(color, hn::TableLookupLanes(factors, first), hn::TableLookupLanes(factors, second)), one);
      auto opacity = hn::Broadcast<3>(color);
      if constexpr (kLevels) opacity = hn::TableLookupLanes(hn::ZeroExtendVector(d, by_level), hn::SetTableIndices(d, kOfVoxel[begin / 4]));
      const auto occupied = hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(&kQuadLanes[octet.occupied >> begin & 15]));
      hn::Store(hn::IfThenElseZero(occupied, hn::Mul(shaded, opacity)), d, octet.rgba + 4 * begin);
    }
  }
}

#else

template <bool kLevels, bool kLit>
HWY_INLINE void ShadeAll(const ShadeTables& tables, float slope_step, std::span<const OctetWork> octets) {
  const VoxelTag d;
  // The fourth channel is 1 under every light.
  alignas(16) static constexpr float kIsColor[4] = {1, 1, 1, 0}, kIsOpacity[4] = {0, 0, 0, 1};
  const auto is_color = hn::Load(d, kIsColor), is_opacity = hn::Load(d, kIsOpacity), one = hn::Set(d, 1.0F);
  const float* HWY_RESTRICT colors = tables.color.data();
  const float* HWY_RESTRICT opacities = tables.opacity.data();
  const PhongFactors* HWY_RESTRICT by_normal = tables.by_normal.data();
  const auto levels = std::size_t(tables.levels);
  for (const OctetWork& octet : octets) {
    const VoxelRecord* record = octet.records;
    for (int i = 0; i < kOctet; ++i) hn::Store(hn::Zero(d), d, octet.rgba + 4 * i);
    for (std::uint32_t rest = octet.occupied; rest != 0; rest &= rest - 1, ++record) {
      const int i = std::countr_zero(rest);
      PhongFactors factors = by_normal[record->normal];
      if constexpr (kLit) factors = Shared(factors, *octet.shares, std::size_t(i));
      const auto color = hn::Load(d, colors + 4 * std::size_t{record->bin});
      auto opacity = hn::Broadcast<3>(color);
      if constexpr (kLevels) {
        const float level = LevelOf(tables, octet, slope_step, i);
        const auto below = std::size_t(std::int32_t(level));
        const float* table = opacities + levels * std::size_t{record->bin} + below;
        opacity = hn::Set(d, table[0] + (level - float(below)) * (table[1] - table[0]));
      }
      const auto diffuse = hn::Mul(hn::Set(d, factors.diffuse), is_color);
      const auto specular = hn::MulAdd(hn::Set(d, factors.specular), is_color, is_opacity);
      hn::Store(hn::Mul(hn::Min(hn::MulAdd(color, diffuse, specular), one), opacity), d, octet.rgba + 4 * i);
    }
  }
}

#endif

void Shade(const ShadeTables& tables, float slope_step, std::span<const OctetWork> octets) {
  if (octets.empty()) return;
  if (octets.front().shares != nullptr) {
    tables.levels > 1 ? ShadeAll<true, true>(tables, slope_step, octets) : ShadeAll<false, true>(tables, slope_step, octets);
  } else {
    tables.levels > 1 ? ShadeAll<true, false>(tables, slope_step, octets) : ShadeAll<false, false>(tables, slope_step, octets);
  }
}

void Clear(std::span<const OctetWork> octets) {
  const hn::CappedTag<float, 16> d;
  for (const OctetWork& octet : octets) {
    for (std::size_t i = 0; i < 4 * std::size_t{kOctet}; i += hn::Lanes(d)) hn::Store(hn::Zero(d), d, octet.rgba + i);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Shade);
HWY_EXPORT(Clear);

void ShadeOctets(const ShadeTables& tables, float slope_step, std::span<const OctetWork> octets) {
  HWY_DYNAMIC_DISPATCH(Shade)(tables, slope_step, octets);
}

void ClearOctets(std::span<const OctetWork> octets) { HWY_DYNAMIC_DISPATCH(Clear)(octets); }

}  // namespace slabstream
#endif
