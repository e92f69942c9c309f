// NearestRow for every instruction set that the compiler knows. All give the same bits. If one image is in front in a whole vector,
// as is usual, nothing or all of it is copied.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/kernels/nearest.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstring>

#include "common/kernels/combine.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// As many pixels as D has lanes.
template <class D>
HWY_INLINE void KeepNearest(D df, const SourcePixels& source, const TargetPixels& target, std::size_t i) {
  const hn::RebindToUnsigned<D> du;
  const hn::RebindToSigned<D> di;
  const std::size_t lanes = hn::Lanes(df);
  const auto depth = hn::LoadU(df, source.depth + i), old_depth = hn::LoadU(df, target.depth + i);
  const auto voxel = hn::LoadU(du, source.voxel + i), old_voxel = hn::LoadU(du, target.voxel + i);
  const auto first = hn::RebindMask(df, hn::Lt(hn::BitCast(di, hn::Sub(voxel, old_voxel)), hn::Zero(di)));
  const auto nearer = hn::Or(hn::Lt(depth, old_depth), hn::And(hn::Eq(depth, old_depth), first));
  if (hn::AllFalse(df, nearer)) return;
  hn::StoreU(hn::IfThenElse(nearer, depth, old_depth), df, target.depth + i);
  hn::StoreU(hn::IfThenElse(hn::RebindMask(du, nearer), voxel, old_voxel), du, target.voxel + i);
  if (hn::AllTrue(df, nearer)) {
    std::memcpy(target.rgba + 4 * i, source.rgba + 4 * i, 4 * sizeof(float) * lanes);
    return;
  }
  std::uint8_t bits[8] = {};  // a lane a bit
  hn::StoreMaskBits(df, nearer, bits);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    if ((bits[lane / 8] >> lane % 8 & 1) != 0) {
      std::memcpy(target.rgba + 4 * (i + lane), source.rgba + 4 * (i + lane), 4 * sizeof(float));
    }
  }
}

void NearestRow(const SourcePixels& source, const TargetPixels& target, std::size_t count) {
  const hn::ScalableTag<float> df;
  std::size_t i = 0;
  for (; i + hn::Lanes(df) <= count; i += hn::Lanes(df)) KeepNearest(df, source, target, i);
  for (; i < count; ++i) KeepNearest(hn::CappedTag<float, 1>(), source, target, i);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {

HWY_EXPORT(NearestRow);

void NearestRow(const SourcePixels& source, const TargetPixels& target, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(NearestRow)(source, target, count);
}

}  // namespace slabstream
#endif
