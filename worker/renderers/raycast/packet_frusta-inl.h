// Frusta of packets (Reshetov et al. 2005): how far the rays of each pass empty space, before any of them is marched. At each step, the
// rays of a packet lie within a box that moves along. Frusta are followed one to a lane, so that as many packets as there are lanes take
// the leaps of one; those that meet nothing need no rays at all.
#if defined(SLABSTREAM_WORKER_RENDERERS_RAYCAST_PACKET_FRUSTA_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_RAYCAST_PACKET_FRUSTA_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_RAYCAST_PACKET_FRUSTA_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_RAYCAST_PACKET_FRUSTA_INL_H_
#endif

#include <hwy/highway.h>

#include "worker/renderers/raycast/surface_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {

// The corners of the boxes of frusta at sample k: first + k * move. `back` is the corner that comes last along the rays, `front` the one
// that goes ahead.
struct Frusta {
  RayPacket back, front;
  Mask one_octant;  // all rays of the frustum move in one octant of directions; otherwise its corners mean nothing
};

// `x`, `y`: the first pixels of packets.
HWY_INLINE Frusta FrustaOf(const ViewRays& view, const RayBox& box, Ints x, Ints y) {
  // Orthographic rays are parallel, so those of the four corner pixels give the whole box.
  const bool corners = !view.perspective && !(view.jitter > 0);
  const std::int32_t step_x = corners ? kPacketWidth - 1 : 1, step_y = corners ? std::max(kPacketHeight - 1, 1) : 1;
  RayPacket low = AmongVoxels(RaysOf(view, x, y), box), high = low;
  for (std::int32_t j = 0; j < kPacketHeight; j += step_y) {
    for (std::int32_t i = 0; i < kPacketWidth; i += step_x) {
      const RayPacket rays = AmongVoxels(RaysOf(view, hn::Add(x, SetInt(i)), hn::Add(y, SetInt(j))), box);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low.first[axis] = hn::Min(low.first[axis], rays.first[axis]);
        low.move[axis] = hn::Min(low.move[axis], rays.move[axis]);
        high.first[axis] = hn::Max(high.first[axis], rays.first[axis]);
        high.move[axis] = hn::Max(high.move[axis], rays.move[axis]);
      }
    }
  }
  const auto zero = hn::Zero(FloatTag());
  Frusta frusta = {low, high, low.valid};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto down = hn::Lt(high.move[axis], zero);
    frusta.one_octant = hn::And(frusta.one_octant, hn::Or(down, hn::Ge(low.move[axis], zero)));
    frusta.back.first[axis] = hn::IfThenElse(down, high.first[axis], low.first[axis]);
    frusta.back.move[axis] = hn::IfThenElse(down, high.move[axis], low.move[axis]);
    frusta.front.first[axis] = hn::IfThenElse(down, low.first[axis], high.first[axis]);
    frusta.front.move[axis] = hn::IfThenElse(down, low.move[axis], high.move[axis]);
  }
  return frusta;
}

// By packet, how far all of its rays, from sample 0 on, pass no visible cell, in samples; kRayEnd: they pass none at all. `x`, `y`: as for
// FrustaOf.
HWY_INLINE Floats FrustumStarts(const ViewRays& view, const RayBox& box, const EmptyDistances& distances, Ints x, Ints y) {
  constexpr float kShortest = 0.25F;  // samples: of a leap
  const FloatTag df;
  const IntTag di;
  const auto zero = hn::Zero(df), samples = Set(float(view.sample_count));
  const Frusta frusta = FrustaOf(view, box, x, y);
  // Only the octants that rays point into have distances.
  const Ints octant_start = hn::IfThenElseZero(hn::RebindMask(di, frusta.one_octant), OctantStart(distances, frusta.back));
  const LeapScales leaps = LeapScalesOf(frusta.front);
  // Where the front reaches the cells.
  auto k = zero;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = Set(float(box.origin[int(axis)])), high = hn::Add(low, Set(float(box.cells[int(axis)] * kCellSide)));
    const auto side = hn::IfThenElse(hn::Lt(leaps.inverse[axis], zero), high, low);
    const auto reached = hn::Sub(hn::Mul(hn::Sub(side, frusta.front.first[axis]), leaps.inverse[axis]), leaps.margin[axis]);
    k = hn::Max(k, hn::Min(reached, samples));
  }
  auto going = hn::And(frusta.one_octant, hn::Lt(k, samples));
  while (!hn::AllFalse(df, going)) {
    SamplePlace place;  // the cell of the back corner, and the front corner
    auto gone = hn::Lt(zero, zero);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto down = hn::Lt(frusta.back.move[axis], zero);
      const auto back = hn::Add(PositionOf(frusta.back, axis, k), hn::IfThenElse(down, Set(kPlaceMargin), Set(-kPlaceMargin)));
      const auto voxel = hn::Sub(Truncated(hn::Floor(back)), SetInt(box.origin[int(axis)]));
      const auto last = SetInt(box.cells[int(axis)] * kCellSide - 1);
      const auto below = hn::RebindMask(df, hn::Lt(voxel, hn::Zero(di))), above = hn::RebindMask(df, hn::Gt(voxel, last));
      gone = hn::Or(gone, hn::Or(hn::And(down, below), hn::AndNot(down, above)));
      place.voxel[axis] = hn::Min(hn::Max(voxel, hn::Zero(di)), last);
      place.position[axis] = PositionOf(frusta.front, axis, k);
    }
    k = hn::IfThenElse(hn::And(going, gone), Set(kRayEnd), k);
    going = hn::AndNot(gone, going);
    const auto distance = DistanceAt(distances, octant_start, CellOf<kCellShift>(place, box.cells, going));
    const auto steps = StepsTo(box, leaps, place, SetInt(kCellSide), hn::ConvertTo(df, hn::ShiftLeft<kCellShift>(distance)));
    going = hn::And(going, hn::And(hn::RebindMask(df, hn::Gt(distance, hn::Zero(di))), hn::Ge(steps, Set(kShortest))));
    k = hn::Add(k, hn::IfThenElseZero(going, steps));
    going = hn::And(going, hn::Lt(k, samples));
  }
  return hn::IfThenElse(hn::Lt(k, samples), k, Set(kRayEnd));
}

// FrustumStarts of the packets of a tile, in the order of ForEachPacket.
class TileStarts {
 public:
  // `distances`: null: all starts are kRayEnd.
  TileStarts(const ViewRays& view, const RayBox& box, const EmptyDistances* distances, const PixelBounds& tile)
      : view_(view), box_(box), distances_(distances), tile_(tile) {}

  HWY_INLINE float Next() {
    if (distances_ == nullptr) return kRayEnd;
    const std::int32_t lane = number_ % std::int32_t(kLanes);
    if (lane == 0) FindMore();
    ++number_;
    return starts_[lane];
  }

 private:
  // Of the next packets, as many as there are lanes.
  HWY_INLINE void FindMore() {
    const std::int32_t columns = (tile_.width() + kPacketWidth - 1) / kPacketWidth;
    const std::int32_t last = columns * ((tile_.height() + kPacketHeight - 1) / kPacketHeight) - 1;
    LaneNumbers x, y;
    for (std::int32_t i = 0; i < std::int32_t(kLanes); ++i) {
      const std::int32_t packet = std::min(number_ + i, last);
      x.number[i] = tile_.x_begin + packet % columns * kPacketWidth;
      y.number[i] = tile_.y_begin + packet / columns * kPacketHeight;
    }
    const auto starts = FrustumStarts(view_, box_, *distances_, hn::Load(IntTag(), x.number), hn::Load(IntTag(), y.number));
    hn::Store(starts, FloatTag(), starts_);
  }

  const ViewRays& view_;
  const RayBox& box_;
  const EmptyDistances* const distances_;
  const PixelBounds tile_;
  std::int32_t number_ = 0;  // of the next packet
  HWY_ALIGN float starts_[kLanes];
};

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();
#endif
