// Packets of neighbouring rays, one to a lane: the samples that a box owns, their positions, and interpolation there. Included once for
// each instruction set, hence the unusual include guard. Additions and multiplications are never fused: every instruction set gives the
// same bits.
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "worker/rays/field_map.h"
#include "worker/rays/packet_shapes.h"
#include "worker/rays/ray_box.h"

#if defined(SLABSTREAM_WORKER_RAYS_RAY_PACKET_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RAYS_RAY_PACKET_INL_H_
#undef SLABSTREAM_WORKER_RAYS_RAY_PACKET_INL_H_
#else
#define SLABSTREAM_WORKER_RAYS_RAY_PACKET_INL_H_
#endif

// Marks lambdas that must be part of the loop that calls them: where there are many calls, g++ keeps them apart.
#undef SLABSTREAM_INLINED
#define SLABSTREAM_INLINED HWY_ATTR __attribute__((always_inline))

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 16>;
using IntTag = hn::RebindToSigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;
using Mask = hn::Mask<FloatTag>;

// Pixels of a packet, [y][x].
constexpr std::size_t kLanes = hn::MaxLanes(FloatTag());
constexpr std::int32_t kPacketWidth = 4, kPacketHeight = std::int32_t(kLanes) / kPacketWidth;

HWY_INLINE Floats Set(float value) { return hn::Set(FloatTag(), value); }
HWY_INLINE Ints SetInt(std::int32_t value) { return hn::Set(IntTag(), value); }

// Whole numbers of floats that fit them: hn::ConvertTo and hn::NearestInt take care of others, which costs four operations more.
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
// With a mask of all lanes: without one, g++ 12 takes the intrinsics' operand for uninitialised.
HWY_INLINE Ints Truncated(Floats v) { return Ints{_mm512_maskz_cvttps_epi32(0xFFFF, v.raw)}; }
HWY_INLINE Ints Nearest(Floats v) { return Ints{_mm512_maskz_cvtps_epi32(0xFFFF, v.raw)}; }
#elif HWY_TARGET <= HWY_AVX2 && HWY_ARCH_X86
HWY_INLINE Ints Truncated(Floats v) { return Ints{_mm256_cvttps_epi32(v.raw)}; }
HWY_INLINE Ints Nearest(Floats v) { return Ints{_mm256_cvtps_epi32(v.raw)}; }
#elif HWY_TARGET <= HWY_SSSE3 && HWY_ARCH_X86
HWY_INLINE Ints Truncated(Floats v) { return Ints{_mm_cvttps_epi32(v.raw)}; }
HWY_INLINE Ints Nearest(Floats v) { return Ints{_mm_cvtps_epi32(v.raw)}; }
#else
HWY_INLINE Ints Truncated(Floats v) { return hn::ConvertTo(IntTag(), v); }
HWY_INLINE Ints Nearest(Floats v) { return hn::NearestInt(v); }
#endif

HWY_INLINE Floats Lerp(Floats t, Floats a, Floats b) { return hn::Add(a, hn::Mul(t, hn::Sub(b, a))); }

// By what share of a step the samples of pixels lie farther away.
HWY_INLINE Floats JitterAt(const ViewRays& view, Ints x, Ints y) {
  const hn::RebindToUnsigned<IntTag> du;
  // The fractions 1 / g and 1 / g^2 with g^3 = g + 1, in 2^-32.
  const auto sum = hn::Add(hn::Mul(hn::BitCast(du, x), hn::Set(du, 0xC13FA9A9U)), hn::Mul(hn::BitCast(du, y), hn::Set(du, 0x91E10DA5U)));
  const auto fraction = hn::Mul(hn::ConvertTo(FloatTag(), hn::BitCast(IntTag(), hn::ShiftRight<8>(sum))), Set(0x1p-24F));
  return hn::Mul(fraction, Set(view.jitter));
}

struct RayPacket {
  Floats first[3], move[3];
  Mask valid;  // pixels of the tile
};

struct PacketPixels {
  Ints x, y;
};
HWY_INLINE PacketPixels PixelsOf(std::int32_t x, std::int32_t y) {
  const auto lane = hn::Iota(IntTag(), 0);
  const auto lane_x = hn::And(lane, SetInt(kPacketWidth - 1)), lane_y = hn::ShiftRight < kPacketWidth == 4 ? 2
                                                                        : kPacketWidth == 2                ? 1
                                                                                                           : 0 > (lane);
  return {hn::Add(SetInt(x), lane_x), hn::Add(SetInt(y), lane_y)};
}

// The rays of pixels, all of them valid.
// Perspective: the unit vector along the ray is (forward + offset) / length. The first sample is written relative to that of the central
// ray, so that nothing cancels if the eye is far away: 1 / length - 1 = -square / (length (1 + length)).
HWY_INLINE RayPacket RaysOf(const ViewRays& view, Ints pixel_x, Ints pixel_y) {
  const FloatTag df;
  const auto px = hn::ConvertTo(df, pixel_x), py = hn::ConvertTo(df, pixel_y);
  const auto from_x = hn::Sub(px, Set(view.centre_x)), from_y = hn::Sub(py, Set(view.centre_y));
  RayPacket packet;
  const auto one = Set(1);
  packet.valid = hn::Lt(hn::Zero(df), one);
  const auto square = hn::Mul(hn::Add(hn::Mul(from_x, from_x), hn::Mul(from_y, from_y)), Set(view.bend));
  const auto length = hn::Sqrt(hn::Add(one, square));
  const auto lag = hn::Div(square, hn::Add(one, length)), scale = hn::Div(Set(view.step), length),
             shift = hn::Div(Set(view.start_distance), length);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto offset = hn::Add(hn::Mul(from_x, Set(view.right[i])), hn::Mul(from_y, Set(view.down[i])));
    const auto forward = Set(view.forward[i]), start = Set(view.start[i]);
    if (view.perspective) {
      packet.first[i] = hn::Add(start, hn::Mul(shift, hn::Sub(offset, hn::Mul(lag, forward))));
      packet.move[i] = hn::Mul(scale, hn::Add(forward, offset));
    } else {
      packet.first[i] = hn::Add(start, offset);
      packet.move[i] = hn::Mul(Set(view.step), forward);
    }
  }
  if (view.jitter > 0) {
    const auto shift_k = JitterAt(view, pixel_x, pixel_y);
    for (std::size_t i = 0; i < 3; ++i) packet.first[i] = hn::Add(packet.first[i], hn::Mul(shift_k, packet.move[i]));
  }
  return packet;
}

// The packet whose first pixel is (x, y); pixels from x_end or y_end on are not valid.
HWY_INLINE RayPacket PacketAt(const ViewRays& view, std::int32_t x, std::int32_t y, std::int32_t x_end, std::int32_t y_end) {
  const auto [pixel_x, pixel_y] = PixelsOf(x, y);
  RayPacket packet = RaysOf(view, pixel_x, pixel_y);
  packet.valid = hn::RebindMask(FloatTag(), hn::And(hn::Lt(pixel_x, SetInt(x_end)), hn::Lt(pixel_y, SetInt(y_end))));
  return packet;
}

// Calls render(packet, rgba), or render(packet, rgba, x, y of its first pixel), for the packets of a tile of pixels; rgba is room for four
// floats a lane. If it returns true, they are copied to the tile's pixels, the first of which is at `to`.
template <class Render>
HWY_INLINE void ForEachPacket(const ViewRays& view, const PixelBounds& tile, float* HWY_RESTRICT to, std::size_t floats_a_row,
                              Render&& render) {
  for (std::int32_t y = tile.y_begin; y < tile.y_end; y += kPacketHeight) {
    for (std::int32_t x = tile.x_begin; x < tile.x_end; x += kPacketWidth) {
      alignas(64) float rgba[4 * kLanes];
      const RayPacket packet = PacketAt(view, x, y, tile.x_end, tile.y_end);
      bool found = false;
      if constexpr (requires { render(packet, rgba, x, y); }) {
        found = render(packet, rgba, x, y);
      } else {
        found = render(packet, rgba);
      }
      if (!found) continue;
      const std::int32_t width = std::min(kPacketWidth, tile.x_end - x), height = std::min(kPacketHeight, tile.y_end - y);
      for (std::int32_t row = 0; row < height; ++row) {
        std::copy_n(rgba + 4 * row * kPacketWidth, 4 * width,
                    to + std::size_t(y + row - tile.y_begin) * floats_a_row + 4 * std::size_t(x - tile.x_begin));
      }
    }
  }
}

HWY_INLINE Floats PositionOf(const RayPacket& packet, std::size_t axis, Floats k) {
  return hn::Add(packet.first[axis], hn::Mul(k, packet.move[axis]));
}

// Samples [begin, end) of each ray; begin >= end: none.
struct SampleInterval {
  Floats begin, end;
};

// Samples k of [begin, end) at positions p with low <= p < high on every axis. Rounding is monotonic, so each coordinate of a ray is
// monotonic in k as computed, and the samples inside are one interval. Its ends are where the ray crosses the box, give or take rounding:
// the positions as computed decide.
HWY_INLINE SampleInterval SamplesInside(const RayPacket& packet, const Float3& low, const Float3& high, std::int32_t begin,
                                        std::int32_t end) {
  const FloatTag df;
  const auto zero = hn::Zero(df), one = Set(1);
  const auto first = Set(float(begin)), count = Set(float(std::max(end - begin, 0)));
  const auto never = hn::Lt(one, zero), always = hn::Lt(zero, one);
  const auto backward = [&](std::size_t i) HWY_ATTR { return hn::Lt(packet.move[i], zero); };
  // The sample lies before the box, or past it, along an axis.
  const auto before = [&](Floats k) HWY_ATTR {
    Mask any = never;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = PositionOf(packet, i, k);
      const auto below = hn::Lt(p, Set(low[i])), above = hn::Ge(p, Set(high[i]));
      any = hn::Or(any, hn::Or(hn::AndNot(backward(i), below), hn::And(backward(i), above)));
    }
    return any;
  };
  const auto within_or_before = [&](Floats k) HWY_ATTR {
    Mask all = always;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto p = PositionOf(packet, i, k);
      const auto not_below = hn::Ge(p, Set(low[i])), not_above = hn::Lt(p, Set(high[i]));
      all = hn::And(all, hn::Or(hn::AndNot(backward(i), not_above), hn::And(backward(i), not_below)));
    }
    return all;
  };
  // The number of leading samples of [begin, end) that fulfil the condition, nearly `guess`. After the first that does not, none does.
  const auto leading = [&](Floats guess, auto&& condition) HWY_ATTR {
    auto length = hn::Min(hn::Max(hn::Sub(hn::Ceil(guess), first), zero), count);
    for (;;) {
      const auto next = hn::Add(first, length);
      const auto short_of = hn::And(hn::Lt(length, count), condition(next));
      const auto beyond = hn::AndNot(condition(hn::Sub(next, one)), hn::Gt(length, zero));
      if (hn::AllFalse(df, hn::Or(short_of, beyond))) return length;
      length = hn::Sub(hn::Add(length, hn::IfThenElseZero(short_of, one)), hn::IfThenElseZero(beyond, one));
    }
  };
  auto enter = Set(-kRayEnd), leave = Set(kRayEnd);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto least = Set(1e-30F);  // not zero, which has no quotient
    const auto move = hn::IfThenElse(hn::Lt(hn::Abs(packet.move[i]), least), least, packet.move[i]);
    const auto to_low = hn::Div(hn::Sub(Set(low[i]), packet.first[i]), move);
    const auto to_high = hn::Div(hn::Sub(Set(high[i]), packet.first[i]), move);
    enter = hn::Max(enter, hn::Min(to_low, to_high));
    leave = hn::Min(leave, hn::Max(to_low, to_high));
  }
  const auto lead = leading(enter, before), held = leading(leave, within_or_before);
  return {hn::Add(first, lead), hn::IfThenElse(packet.valid, hn::Add(first, held), zero)};
}

// A part of each ray that clipping leaves, in numbers of samples.
struct PacketPart {
  Floats begin, end;    // samples [begin, end)
  Floats enter, leave;  // where the ray is cut, between samples; enter > leave: nothing is left
  Floats face[3];       // data space: a normal of the face at `enter`, of any length
  Floats face_end;      // samples before this one lie within face_depth of it

  SampleInterval Of(const SampleInterval& samples) const { return {hn::Max(samples.begin, begin), hn::Min(samples.end, end)}; }
};
// The parts of the rays, nearest first. A part may have no samples, begin >= end, and yet a length.
HWY_INLINE void PartsOf(const RayClip& clip, const RayPacket& packet, PacketPart (&parts)[2]) {
  const FloatTag df;
  struct Cut {
    Floats at, normal[3], face_end;
  };
  const auto far = Set(kRayEnd), minus_far = Set(-kRayEnd), zero = hn::Zero(df);
  Cut enter = {minus_far, {zero, zero, zero}, minus_far}, leave = {far, {zero, zero, zero}, minus_far};
  auto outside = hn::Lt(far, zero);  // never
  for (const RayClip::Side& side : clip.sides) {
    const auto dot = [&](const Floats(&v)[3]) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(Set(side.normal[0]), v[0]), hn::Mul(Set(side.normal[1]), v[1])), hn::Mul(Set(side.normal[2]), v[2]));
    };
    const auto first = hn::Add(dot(packet.first), Set(side.offset)), move = dot(packet.move);
    const auto crosses = hn::Ge(hn::Abs(move), Set(kLeastCrossing)), inwards = hn::Gt(move, zero);
    const auto divisor = hn::IfThenElse(crosses, move, Set(1));
    const auto at = hn::Div(hn::Neg(first), divisor);
    const auto face_end = hn::Add(at, hn::Div(Set(clip.face_depth), hn::Abs(divisor)));
    outside = hn::Or(outside, hn::AndNot(crosses, hn::Lt(first, zero)));
    const auto take = [&](Cut& cut, Mask better) HWY_ATTR {
      cut.at = hn::IfThenElse(better, at, cut.at);
      cut.face_end = hn::IfThenElse(better, face_end, cut.face_end);
      for (std::size_t i = 0; i < 3; ++i) cut.normal[i] = hn::IfThenElse(better, Set(side.normal[i]), cut.normal[i]);
    };
    take(enter, hn::And(hn::And(crosses, inwards), hn::Gt(at, enter.at)));
    take(leave, hn::And(hn::AndNot(inwards, crosses), hn::Lt(at, leave.at)));
  }
  const auto any = hn::AndNot(outside, hn::Le(enter.at, leave.at));
  const auto from = hn::Ceil(enter.at), to = hn::Add(hn::Floor(leave.at), Set(1));
  const auto part = [&](PacketPart& out, Mask present, Floats begin, Floats end, Floats enters, Floats leaves, const Cut* cut) HWY_ATTR {
    out = {begin,    hn::IfThenElse(present, end, minus_far), enters, hn::IfThenElse(present, leaves, minus_far), {zero, zero, zero},
           minus_far};
    if (cut == nullptr) return;
    for (std::size_t i = 0; i < 3; ++i) out.face[i] = cut->normal[i];
    out.face_end = cut->face_end;
  };
  if (clip.cut_away) {
    const auto all = hn::Ge(far, zero);
    part(parts[0], all, minus_far, hn::IfThenElse(any, from, far), minus_far, hn::IfThenElse(any, enter.at, far), nullptr);
    part(parts[1], any, to, far, leave.at, far, &leave);
  } else {
    part(parts[0], any, from, to, enter.at, leave.at, &enter);
    parts[1] = parts[0];
    parts[1].end = parts[1].leave = minus_far;
  }
}

// Loads what shapes have on the rays of the packet whose first pixel is (x, y). False: nothing.
HWY_INLINE bool LoadShapes(const ShapeTile& shapes, const FragmentOrder& order, const ViewRays& view, const RayBox& box,
                           const PixelBounds& tile, std::int32_t x, std::int32_t y, PacketShapes& of_packet) {
  static_assert(kLanes <= kMostShapeLanes);
  alignas(64) float jitter[kLanes] = {};
  if (view.jitter > 0) {
    const auto [pixel_x, pixel_y] = PixelsOf(x, y);
    hn::Store(JitterAt(view, pixel_x, pixel_y), FloatTag(), jitter);
  }
  return of_packet.Load(shapes, order, view, box, tile, x, y, kPacketWidth, kLanes, jitter);
}
// What lies between two places of the rays, in samples, of a part of them.
HWY_INLINE PacketPart Between(const PacketPart& part, Floats from, Floats to) {
  PacketPart between = part;
  between.begin = hn::Max(part.begin, hn::Ceil(from));
  between.end = hn::Min(part.end, hn::Ceil(to));
  between.enter = hn::Max(part.enter, from);
  between.leave = hn::Min(part.leave, to);
  return between;
}

// The samples that the box owns and that may matter. Boxes of different levels agree on whose a sample is: positions are the frame's.
HWY_INLINE SampleInterval OwnedSamples(const RayPacket& packet, const RayBox& box) {
  return SamplesInside(packet, box.low, box.high, box.reach.begin, box.reach.end);
}

// The packet among the voxels of the box.
HWY_INLINE RayPacket AmongVoxels(const RayPacket& packet, const RayBox& box) {
  RayPacket among = packet;
  for (std::size_t i = 0; i < 3; ++i) {
    among.first[i] = hn::Add(hn::Mul(packet.first[i], Set(box.scale[i])), Set(box.offset[i]));
    among.move[i] = hn::Mul(packet.move[i], Set(box.scale[i]));
  }
  return among;
}

HWY_INLINE Floats Combined(const std::array<Float3, 3>& by, const Floats (&v)[3], std::size_t i) {
  return hn::Add(hn::Add(hn::Mul(v[0], Set(by[0][i])), hn::Mul(v[1], Set(by[1][i]))), hn::Mul(v[2], Set(by[2][i])));
}
// The packet among the voxels of another field.
HWY_INLINE RayPacket AmongVoxels(const RayPacket& packet, const FieldMap& map) {
  RayPacket among = packet;
  for (std::size_t i = 0; i < 3; ++i) {
    among.first[i] = hn::Add(Combined(map.steps, packet.first, i), Set(map.offset[i]));
    among.move[i] = Combined(map.steps, packet.move, i);
  }
  return among;
}

// Where samples lie between voxels.
struct CellPlace {
  Floats fraction[3];  // position - floor
};
// The position of sample k of each ray in the box. `packet`: AmongVoxels. If the box does not own a ray's sample, the ray's indices are
// arbitrary.
struct SamplePlace : CellPlace {
  Floats position[3];
  Ints voxel[3];  // floor - box.origin
};
HWY_INLINE SamplePlace PlaceSample(const RayPacket& packet, const RayBox& box, Floats k) {
  SamplePlace place;
  for (std::size_t i = 0; i < 3; ++i) {
    place.position[i] = PositionOf(packet, i, k);
    const auto floor = hn::Floor(place.position[i]);
    place.fraction[i] = hn::Sub(place.position[i], floor);
    place.voxel[i] = hn::Sub(Truncated(floor), SetInt(box.origin[int(i)]));
  }
  return place;
}

// Index of the cell; 0 where not `owned`. kShift: log2 of the cell's side in voxels.
template <int kShift>
HWY_INLINE Ints CellOf(const SamplePlace& place, const Index3& cells, Mask owned) {
  const auto slice = hn::Mul(hn::ShiftRight<kShift>(place.voxel[2]), SetInt(cells.x * cells.y));
  const auto row = hn::Mul(hn::ShiftRight<kShift>(place.voxel[1]), SetInt(cells.x));
  const auto index = hn::Add(hn::Add(slice, row), hn::ShiftRight<kShift>(place.voxel[0]));
  return hn::IfThenElseZero(hn::RebindMask(IntTag(), owned), index);
}

constexpr float kPlaceMargin = 1.0F / 64;  // voxels: covers the rounding of positions

// Constants for leaps: 1 / move by axis, and the steps of a safety margin.
struct LeapScales {
  Floats inverse[3], margin[3];
};
HWY_INLINE LeapScales LeapScalesOf(const RayPacket& packet) {
  LeapScales scales;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto least = Set(1e-9F);
    const auto move = hn::IfThenElse(hn::Lt(hn::Abs(packet.move[i]), least), least, packet.move[i]);
    scales.inverse[i] = hn::Div(Set(1), move);
    scales.margin[i] = hn::Mul(hn::Abs(scales.inverse[i]), Set(kPlaceMargin));
  }
  return scales;
}

// The number of steps, at least 1, after which a ray may be `ahead` voxels past its entry into its cube (of `side` voxels, a power of two).
// Earlier samples lie nearer.
HWY_INLINE Floats StepsTo(const RayBox& box, const LeapScales& scales, const SamplePlace& place, Ints side, Floats ahead) {
  const FloatTag df;
  const auto behind = hn::Sub(hn::ConvertTo(df, side), ahead);
  const auto cube = hn::Neg(side);
  Floats steps = Set(1e9F);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto low = hn::ConvertTo(df, hn::And(place.voxel[i], cube));
    const auto inside = hn::Sub(place.position[i], Set(float(box.origin[int(i)])));
    const auto plane = hn::Add(low, hn::IfThenElse(hn::Lt(scales.inverse[i], hn::Zero(df)), behind, ahead));
    steps = hn::Min(steps, hn::Sub(hn::Mul(hn::Sub(plane, inside), scales.inverse[i]), scales.margin[i]));
  }
  return steps;
}
HWY_INLINE Floats StepsWithin(const RayBox& box, const LeapScales& scales, const SamplePlace& place, Ints side, Floats ahead) {
  return hn::Add(hn::Floor(hn::Max(StepsTo(box, scales, place, side, ahead), hn::Zero(FloatTag()))), Set(1));
}

// --- Reading by lanes. Gathers are slower than loads of 16 bytes that are then combined.

// Lanes as numbers in memory.
struct LaneNumbers {
  HWY_ALIGN std::int32_t number[kLanes];

  // `asm` hides the store. Otherwise the compiler would extract each lane from the register, which is slower.
  HWY_INLINE void Set(Ints lanes) {
    hn::Store(lanes, IntTag(), number);
    asm("" : "+m"(number));
  }
  HWY_INLINE std::int32_t operator[](std::size_t lane) const { return number[lane]; }
};

// Transposes 4x4 matrices: block b of the four registers is one matrix.
template <class D>
HWY_INLINE void TurnBlocks(D d, hn::Vec<D> (&v)[4]) {
  const hn::RepartitionToWide<D> dw;
  const auto lower = [&](hn::Vec<D> a, hn::Vec<D> b) HWY_ATTR { return hn::InterleaveLower(d, a, b); };
  const auto upper = [&](hn::Vec<D> a, hn::Vec<D> b) HWY_ATTR { return hn::InterleaveUpper(d, a, b); };
  const auto a = hn::BitCast(dw, lower(v[0], v[1])), b = hn::BitCast(dw, lower(v[2], v[3]));
  const auto e = hn::BitCast(dw, upper(v[0], v[1])), f = hn::BitCast(dw, upper(v[2], v[3]));
  v[0] = hn::BitCast(d, hn::InterleaveLower(dw, a, b));
  v[1] = hn::BitCast(d, hn::InterleaveUpper(dw, a, b));
  v[2] = hn::BitCast(d, hn::InterleaveLower(dw, e, f));
  v[3] = hn::BitCast(d, hn::InterleaveUpper(dw, e, f));
}

// A register whose block b holds the 16 bytes at address at(4 b). `d`: the type of its numbers.
template <class Tag, class At>
HWY_INLINE auto FromBlocks(Tag d, At&& at) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  // A masked load needs no shuffle, of which there are many already.
  const auto load = [&](std::size_t lane) HWY_ATTR { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at(lane))); };
  auto blocks = _mm512_castsi128_si512(load(0));
  blocks = _mm512_mask_broadcast_i32x4(blocks, 0x00F0, load(4));
  blocks = _mm512_mask_broadcast_i32x4(blocks, 0x0F00, load(8));
  blocks = _mm512_mask_broadcast_i32x4(blocks, 0xF000, load(12));
  return hn::BitCast(d, Ints{blocks});
#else
  using Number = hn::TFromD<Tag>;
  const auto load = [&](std::size_t lane) HWY_ATTR {
    return hn::LoadU(hn::FixedTag<Number, 16 / sizeof(Number)>(), reinterpret_cast<const Number*>(at(lane)));
  };
  if constexpr (kLanes == 4) {
    return load(0);
  } else {
    return hn::Combine(d, load(4), load(0));
  }
#endif
}

// Four numbers of 32 bits for each lane. of[i]: number i of every lane.
template <class D>
struct FourNumbers {
  hn::Vec<D> of[4];
};
// Those that follow `from` + at[lane].
template <class D, class T>
HWY_INLINE FourNumbers<D> FourNumbersAt(D d, const T* from, const LaneNumbers& at) {
  FourNumbers<D> numbers;
  for (std::size_t group = 0; group < 4; ++group) {
    numbers.of[group] = FromBlocks(d, [&](std::size_t lane) HWY_ATTR { return from + at[lane + group]; });
  }
  TurnBlocks(d, numbers.of);
  return numbers;
}

// --- Interpolation. Four voxels along x around a sample: one before its floor, its floor, and two after it.

struct SampleRow {
  Floats first, a, b, last;
};

// `at`: the first of the four voxels, in samples from `row`. Reads 16 bytes from there.
HWY_INLINE SampleRow LoadRow(const std::uint8_t* row, const LaneNumbers& at) {
  const auto word = FourNumbersAt(IntTag(), row, at).of[0];
  const auto byte = SetInt(0xFF);
  const auto number = [&](Ints v) HWY_ATTR { return hn::ConvertTo(FloatTag(), v); };
  return {number(hn::And(word, byte)), number(hn::And(hn::ShiftRight<8>(word), byte)), number(hn::And(hn::ShiftRight<16>(word), byte)),
          number(hn::BitCast(IntTag(), hn::ShiftRight<24>(hn::BitCast(hn::RebindToUnsigned<IntTag>(), word))))};
}
HWY_INLINE SampleRow LoadRow(const std::uint16_t* row, const LaneNumbers& at) {
  const auto words = FourNumbersAt(IntTag(), row, at);
  const auto low = SetInt(0xFFFF);
  const auto number = [&](Ints v) HWY_ATTR { return hn::ConvertTo(FloatTag(), hn::And(v, low)); };
  return {number(words.of[0]), number(hn::ShiftRight<16>(words.of[0])), number(words.of[1]), number(hn::ShiftRight<16>(words.of[1]))};
}
HWY_INLINE SampleRow LoadRow(const float* row, const LaneNumbers& at) {
  const auto [first, a, b, last] = FourNumbersAt(FloatTag(), row, at).of;
  return {first, a, b, last};
}

// The eight voxels around a sample, in rows along x: [z][y].
template <class T>
struct Neighbours {
  const T* samples;
  std::ptrdiff_t row, slice;  // strides
  LaneNumbers at;             // the first of the four voxels along x, one row and one slice before the sample's floor
  SampleRow inner[2][2];

  // Row y, z of 0 ... 3. Rows 1 and 2 are around the sample.
  HWY_INLINE SampleRow RowAt(int y, int z) const { return LoadRow(samples + y * row + z * slice, at); }
};

// Neighbours::at of samples; 0 where not `owned`.
HWY_INLINE Ints IndexBefore(const RayBox& box, const SamplePlace& place, Mask owned) {
  const auto at = hn::Add(hn::Add(hn::Mul(place.voxel[2], SetInt(box.slice)), hn::Mul(place.voxel[1], SetInt(box.row))), place.voxel[0]);
  return hn::IfThenElseZero(hn::RebindMask(IntTag(), owned), at);
}

// `samples`: of the volume, or of a layer that is padded like it.
template <class T>
HWY_INLINE Neighbours<T> NeighboursAt(const RayBox& box, const T* samples, Ints at) {
  Neighbours<T> n;
  n.samples = samples;
  n.row = box.row;
  n.slice = box.slice;
  n.at.Set(at);
  for (int z = 0; z < 2; ++z) {
    for (int y = 0; y < 2; ++y) n.inner[z][y] = n.RowAt(y + 1, z + 1);
  }
  return n;
}

template <class T>
HWY_INLINE Neighbours<T> LoadNeighbours(const RayBox& box, const SamplePlace& place, Mask owned) {
  return NeighboursAt(box, reinterpret_cast<const T*>(box.samples), IndexBefore(box, place, owned));
}

// The weights of a sample's eight corners among whole numbers: multiples of 2^-14, at least 0, whose sum is 1. So a sample lies between its
// corners, as empty space requires.
struct CornerWeights {
  Ints pairs[2][2];  // [z][y]: the two weights along x, in 2^-14. The lower half of a lane has the first, the upper half the second
};
HWY_INLINE CornerWeights WeightsAt(const CellPlace& place) {
  const IntTag di;
  const hn::RepartitionToNarrow<IntTag> ds;
  const auto in_both_halves = [&](Ints lower, Ints upper) HWY_ATTR { return hn::BitCast(ds, hn::Or(lower, hn::ShiftLeft<16>(upper))); };
  // The share of the upper corner along an axis, in 2^-15.
  const auto share = [&](std::size_t axis) HWY_ATTR {
    const auto once = Nearest(hn::Mul(place.fraction[axis], Set(32767)));
    return in_both_halves(once, once);
  };
  const auto second = Nearest(hn::Mul(place.fraction[0], Set(1 << 14)));
  const auto along_x = in_both_halves(hn::Sub(SetInt(1 << 14), second), second);
  const auto upper_y = hn::MulFixedPoint15(along_x, share(1)), lower_y = hn::Sub(along_x, upper_y);
  const auto z = share(2);
  CornerWeights weights;
  for (int y = 0; y < 2; ++y) {
    const auto both = y == 0 ? lower_y : upper_y;
    const auto upper_z = hn::MulFixedPoint15(both, z);
    weights.pairs[0][y] = hn::BitCast(di, hn::Sub(both, upper_z));
    weights.pairs[1][y] = hn::BitCast(di, upper_z);
  }
  return weights;
}

// Samples of whole numbers. All sums are whole numbers, too: every instruction set gives the same bits.
template <class T>
HWY_INLINE Floats InterpolateWhole(const RayBox& box, const SamplePlace& place, Mask owned) {
  const IntTag di;
  const hn::RepartitionToNarrow<IntTag> ds;
  const CornerWeights weights = WeightsAt(place);
  Ints of_group[4] = {weights.pairs[0][0], weights.pairs[0][1], weights.pairs[1][0], weights.pairs[1][1]};
  TurnBlocks(di, of_group);
  LaneNumbers at;
  at.Set(IndexBefore(box, place, owned));
  const T* const first = reinterpret_cast<const T*>(box.samples) + 1 + box.row + box.slice;
  for (std::size_t group = 0; group < 4; ++group) {
    // `pairs`: of the four rows of a lane, side by side, the two voxels along x; one lane a block.
    const auto row = [&](std::ptrdiff_t y, std::ptrdiff_t z) HWY_ATTR {
      const T* const from = first + y * box.row + z * box.slice;
      return FromBlocks(ds, [&](std::size_t lane) HWY_ATTR { return from + at[lane + group]; });
    };
    const auto beside = [&](auto a, auto b)
                            HWY_ATTR { return hn::BitCast(ds, hn::InterleaveLower(di, hn::BitCast(di, a), hn::BitCast(di, b))); };
    hn::Vec<decltype(ds)> pairs;
    if constexpr (sizeof(T) == 1) {
      const hn::Repartition<std::uint8_t, IntTag> db;
      const auto bytes = beside(hn::InterleaveLower(ds, row(0, 0), row(1, 0)), hn::InterleaveLower(ds, row(0, 1), row(1, 1)));
      pairs = hn::BitCast(ds, hn::InterleaveLower(db, hn::BitCast(db, bytes), hn::Zero(db)));
    } else {
      const hn::Repartition<std::int64_t, IntTag> dl;
      const auto lower = hn::BitCast(dl, beside(row(0, 0), row(1, 0))), upper = hn::BitCast(dl, beside(row(0, 1), row(1, 1)));
      pairs = hn::Xor(hn::BitCast(ds, hn::InterleaveLower(dl, lower, upper)), hn::Set(ds, std::int16_t(-0x8000)));
    }
    auto rest = hn::Zero(di);
    const auto sum = hn::ReorderWidenMulAccumulate(di, pairs, hn::BitCast(ds, of_group[group]), hn::Zero(di), rest);
    of_group[group] = hn::RearrangeToOddPlusEven(sum, rest);
  }
  TurnBlocks(di, of_group);
  auto sum = hn::Add(hn::Add(of_group[0], of_group[1]), hn::Add(of_group[2], of_group[3]));
  if constexpr (sizeof(T) == 2) sum = hn::Add(sum, SetInt(32768 << 14));
  return hn::Mul(hn::ConvertTo(FloatTag(), sum), Set(1.0F / (1 << 14)));
}

// Along x of the four rows, then along y, then along z.
template <class T>
HWY_INLINE Floats Interpolate(const Neighbours<T>& n, const CellPlace& place) {
  const auto along_x = [&](const SampleRow& pair) HWY_ATTR { return Lerp(place.fraction[0], pair.a, pair.b); };
  const auto low = Lerp(place.fraction[1], along_x(n.inner[0][0]), along_x(n.inner[0][1]));
  const auto high = Lerp(place.fraction[1], along_x(n.inner[1][0]), along_x(n.inner[1][1]));
  return Lerp(place.fraction[2], low, high);
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#endif
