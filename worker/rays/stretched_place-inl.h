// Places of samples among the voxels of a rectilinear grid. Included once for each instruction set, hence the unusual include guard.
// Additions and multiplications are never fused.
#include "worker/rays/ray_packet-inl.h"
#include "worker/rays/stretch_tables.h"

#if defined(SLABSTREAM_WORKER_RAYS_STRETCHED_PLACE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RAYS_STRETCHED_PLACE_INL_H_
#undef SLABSTREAM_WORKER_RAYS_STRETCHED_PLACE_INL_H_
#else
#define SLABSTREAM_WORKER_RAYS_STRETCHED_PLACE_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

HWY_INLINE Ints BinAt(const StretchTable& table, Floats position) {
  const auto bin = hn::Mul(hn::Add(position, Set(0.5F)), Set(table.bins_a_unit));
  return Truncated(hn::Min(hn::Max(bin, hn::Zero(FloatTag())), Set(float(table.first.size() - 1))));
}

// The number of the last knot at or before a position, but not of the last one of all. The axis is uneven.
HWY_INLINE Ints KnotBefore(const StretchTable& table, Floats position) {
  const FloatTag df;
  const IntTag di;
  const auto last = SetInt(std::int32_t(table.knots.size()) - 2);
  auto knot = hn::GatherIndex(di, table.first.data(), BinAt(table, position));
  for (std::int32_t step = table.first_step; step > 0; step /= 2) {
    const auto farther = hn::Min(hn::Add(knot, SetInt(step)), last);
    const auto reached = hn::Ge(position, hn::GatherIndex(df, table.knots.data(), farther));
    knot = hn::IfThenElse(hn::RebindMask(di, reached), farther, knot);
  }
  return knot;
}

// Between voxels `voxel` and the next one, whole numbers: where they lie, which one a position lies behind, and its share of the way.
HWY_INLINE Floats PlaceOfVoxel(const StretchTable& table, Floats voxel) {
  if (table.even()) return voxel;
  const auto knot = hn::Min(hn::Max(hn::Add(voxel, Set(1)), hn::Zero(FloatTag())), Set(float(table.knots.size() - 1)));
  return hn::GatherIndex(FloatTag(), table.knots.data(), Truncated(knot));
}
HWY_INLINE Floats VoxelBefore(const StretchTable& table, Floats position) {
  if (table.even()) return hn::Floor(position);
  return hn::Sub(hn::ConvertTo(FloatTag(), KnotBefore(table, position)), Set(1));
}
HWY_INLINE Floats FractionBehind(const StretchTable& table, Floats position, Floats voxel) {
  if (table.even()) return hn::Sub(position, voxel);
  const FloatTag df;
  const auto knot = Truncated(hn::Min(hn::Max(hn::Add(voxel, Set(1)), hn::Zero(df)), Set(float(table.knots.size() - 2))));
  return hn::Mul(hn::Sub(position, hn::GatherIndex(df, table.knots.data(), knot)), hn::GatherIndex(df, table.per_step.data(), knot));
}

// Where the rays are at `k` samples: `position` is that of data space, `voxel` and `fraction` count voxels.
HWY_INLINE SamplePlace PlaceStretched(const RayPacket& packet, const RayBox& box, Floats k) {
  const FloatTag df;
  SamplePlace place;
  for (std::size_t i = 0; i < 3; ++i) {
    const StretchTable& table = box.stretch->axes[i];
    const auto p = place.position[i] = PositionOf(packet, i, k);
    if (table.even()) {
      const auto floor = hn::Floor(p);
      place.fraction[i] = hn::Sub(p, floor);
      place.voxel[i] = hn::Sub(Truncated(floor), SetInt(box.origin[int(i)]));
      continue;
    }
    const auto knot = KnotBefore(table, p);
    const auto fraction =
        hn::Mul(hn::Sub(p, hn::GatherIndex(df, table.knots.data(), knot)), hn::GatherIndex(df, table.per_step.data(), knot));
    place.fraction[i] = hn::Min(hn::Max(fraction, hn::Zero(df)), Set(1));
    place.voxel[i] = hn::Sub(knot, SetInt(box.origin[int(i)] + 1));
  }
  return place;
}

// StepsWithin in a rectilinear grid. `scales`: of the rays in data space.
HWY_INLINE Floats StretchedStepsWithin(const RayBox& box, const LeapScales& scales, const SamplePlace& place, Ints side, Floats ahead) {
  const FloatTag df;
  const auto behind = hn::Sub(hn::ConvertTo(df, side), ahead);
  const auto cube = hn::Neg(side);
  Floats steps = Set(1e9F);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto low = hn::ConvertTo(df, hn::Add(hn::And(place.voxel[i], cube), SetInt(box.origin[int(i)])));
    const auto plane =
        PlaceOfVoxel(box.stretch->axes[i], hn::Add(low, hn::IfThenElse(hn::Lt(scales.inverse[i], hn::Zero(df)), behind, ahead)));
    const auto margin = hn::Mul(hn::Abs(scales.inverse[i]), Set(box.stretch->margin));
    steps = hn::Min(steps, hn::Sub(hn::Mul(hn::Sub(plane, place.position[i]), scales.inverse[i]), margin));
  }
  return hn::Add(hn::Floor(hn::Max(steps, hn::Zero(df))), Set(1));
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
