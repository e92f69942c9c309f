// The shares of light at positions, as FrameLight::At defines them. Included once for each instruction set, hence the unusual include
// guard. Additions and multiplications are never fused: every instruction set gives the same bits.
#include <hwy/highway.h>

#include <cstdint>

#include "worker/light/frame_light.h"

#if defined(SLABSTREAM_WORKER_LIGHT_LIGHT_AT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_LIGHT_LIGHT_AT_INL_H_
#undef SLABSTREAM_WORKER_LIGHT_LIGHT_AT_INL_H_
#else
#define SLABSTREAM_WORKER_LIGHT_LIGHT_AT_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// Places among the voxels of a FrameLight.
template <class D>
struct LightPlace {
  hwy::HWY_NAMESPACE::Vec<hwy::HWY_NAMESPACE::RebindToSigned<D>> at;  // byte of the voxel below, of the first light
  hwy::HWY_NAMESPACE::Vec<D> t[3];                                    // from it to the voxel above, by axis
};

// x, y, z: finite.
template <class D, class V>
HWY_INLINE LightPlace<D> PlaceInLight(D d, const FrameLight::View& light, V x, V y, V z) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  LightPlace<D> place;
  place.at = hn::Zero(di);
  const V position[3] = {x, y, z};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto among = hn::Add(hn::Mul(position[i], hn::Set(d, light.scale[i])), hn::Set(d, light.offset[i]));
    const auto inside = hn::Min(hn::Max(among, hn::Zero(d)), hn::Set(d, light.last[i]));
    const auto below = hn::ConvertTo(di, inside);
    place.t[i] = hn::Sub(inside, hn::ConvertTo(d, below));
    place.at = hn::Add(place.at, hn::Mul(below, hn::Set(di, light.stride[i])));
  }
  return place;
}

template <class D>
struct LightShares {
  hwy::HWY_NAMESPACE::Vec<D> open, reached;  // [0, 1]
};

template <class D>
HWY_INLINE LightShares<D> SharesAt(D d, const FrameLight::View& light, const LightPlace<D>& place, int number) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  const auto in_256ths = [&](auto t) HWY_ATTR { return hn::ConvertTo(di, hn::Add(hn::Mul(t, hn::Set(d, 256.0F)), hn::Set(d, 0.5F))); };
  const bool along_y = light.fast == 1;
  const std::int32_t stride_u = light.stride[along_y ? 0 : 1], stride_z = light.stride[2];
  const auto y = in_256ths(along_y ? place.t[0] : place.t[1]), z = in_256ths(place.t[2]);
  // Weights of the four beams along the fast axis, which add up to 256.
  const auto yz = hn::ShiftRight<8>(hn::Mul(y, z));
  const auto of_y = hn::Sub(y, yz), of_z = hn::Sub(z, yz), of_none = hn::Sub(hn::Set(di, 256), hn::Add(y, of_z));
  // Two bytes of each of two voxels. The sums of the two first bytes fit 16 bits each, and so do those of the two second ones.
  const std::uint8_t* const base = light.shares + number * light.light;
  const auto halves = hn::Set(di, 0x00FF00FF);
  auto open = hn::Zero(di), reached = open;
  const auto add = [&](std::int32_t offset, auto weight) HWY_ATTR {
    const auto four = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(base + offset), place.at);
    open = hn::Add(open, hn::Mul(hn::And(four, halves), weight));
    reached = hn::Add(reached, hn::Mul(hn::And(hn::ShiftRight<8>(four), halves), weight));
  };
  add(0, of_none);
  add(stride_u, of_y);
  add(stride_z, of_z);
  add(stride_z + stride_u, yz);
  const auto t = along_y ? place.t[1] : place.t[0];
  const auto interpolated = [&](auto pair) HWY_ATTR {
    const auto first = hn::ConvertTo(d, hn::And(pair, hn::Set(di, 0xFFFF)));
    const auto next = hn::ConvertTo(d, hn::And(hn::ShiftRight<16>(pair), hn::Set(di, 0xFFFF)));
    return hn::Mul(hn::Add(first, hn::Mul(t, hn::Sub(next, first))), hn::Set(d, 1.0F / (255 * 256)));
  };
  return {interpolated(open), interpolated(reached)};
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
