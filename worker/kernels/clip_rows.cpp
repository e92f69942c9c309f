#include "worker/kernels/clip_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/clip_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/volume/volume.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DoubleTag = hn::CappedTag<double, kRowPadding>;  // lanes are pixels
using FloatTag = hn::Rebind<float, DoubleTag>;
using IntTag = hn::Rebind<std::int32_t, DoubleTag>;
using Doubles = hn::Vec<DoubleTag>;

HWY_INLINE Doubles At(const LinearInRow& q, Doubles x) {
  const DoubleTag d;
  return hn::Add(hn::Set(d, q.at_0), hn::Mul(x, hn::Set(d, q.by_x)));
}
HWY_INLINE Doubles PixelCentres(std::int32_t column, std::size_t n) { return hn::Iota(DoubleTag(), double(column) + double(n) + 0.5); }

template <bool kPerspective>
HWY_INLINE hn::Vec<FloatTag> DepthAt(Doubles g) {
  if constexpr (kPerspective) g = hn::Div(hn::Set(DoubleTag(), -1.0), g);
  return hn::DemoteTo(FloatTag(), g);
}

template <bool kPerspective>
void DepthsOf(const RegionRow& row, std::int32_t column, std::size_t count, float* HWY_RESTRICT enter, float* HWY_RESTRICT leave) {
  const DoubleTag d;
  const FloatTag df;
  const auto start = hn::Set(d, row.start);
  for (std::size_t n = 0; n < count; n += hn::Lanes(d)) {
    const auto x = PixelCentres(column, n);
    auto entered = start, left = hn::Set(d, row.end);
    for (const LinearInRow& g : row.entered) entered = hn::Max(entered, At(g, x));
    for (const LinearInRow& g : row.left) left = hn::Min(left, At(g, x));
    for (const LinearInRow& g : row.never) left = hn::IfThenElse(hn::Lt(At(g, x), hn::Zero(d)), start, left);
    const auto meets = hn::Lt(entered, left), starts_outside = hn::Gt(entered, start);
    // Depths of lanes that have none are not used.
    const auto depth = hn::IfThenElseZero(starts_outside, hn::PromoteTo(d, DepthAt<kPerspective>(entered)));
    hn::StoreU(hn::DemoteTo(df, hn::IfThenElse(meets, depth, hn::Set(d, double(kNeverMet)))), df, enter + n);
    const auto last = hn::IfThenElse(meets, left, kPerspective ? hn::Set(d, 1.0) : hn::Set(d, -1.0));
    hn::StoreU(DepthAt<kPerspective>(last), df, leave + n);
  }
}

void Depths(const RegionRow& row, std::int32_t column, std::size_t count, float* enter, float* leave) {
  return row.perspective ? DepthsOf<true>(row, column, count, enter, leave) : DepthsOf<false>(row, column, count, enter, leave);
}

void Voxels(const RayRow& row, std::int32_t column, std::size_t count, const float* HWY_RESTRICT depth, double behind,
            std::int32_t* HWY_RESTRICT x, std::int32_t* HWY_RESTRICT y, std::int32_t* HWY_RESTRICT z) {
  const DoubleTag d;
  const FloatTag df;
  const IntTag di;
  std::int32_t* const voxel[3] = {x, y, z};
  for (std::size_t n = 0; n < count; n += hn::Lanes(d)) {
    const auto pixel = PixelCentres(column, n), at = hn::Add(hn::PromoteTo(d, hn::LoadU(df, depth + n)), hn::Set(d, behind));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = hn::Add(At(row.origin[i], pixel), hn::Mul(at, At(row.direction[i], pixel)));
      const auto inside = hn::Min(hn::Max(hn::Add(p, hn::Set(d, 0.5)), hn::Set(d, -1.0)), hn::Set(d, double(kMaxVolumeSide)));
      hn::StoreU(hn::DemoteTo(di, hn::Floor(inside)), di, voxel[i] + n);
    }
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Depths);
HWY_EXPORT(Voxels);

void RegionDepths(const RegionRow& row, std::int32_t column, std::size_t count, float* enter, float* leave) {
  HWY_DYNAMIC_DISPATCH(Depths)(row, column, count, enter, leave);
}

void VoxelsAt(const RayRow& row, std::int32_t column, std::size_t count, const float* depth, double behind, std::int32_t* x,
              std::int32_t* y, std::int32_t* z) {
  HWY_DYNAMIC_DISPATCH(Voxels)(row, column, count, depth, behind, x, y, z);
}

}  // namespace slabstream
#endif
