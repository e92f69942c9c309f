#include "worker/renderers/splat/light_octets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/splat/light_octets.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "worker/kernels/phong_table.h"
#include "worker/light/light_at-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Octet = hn::CappedTag<float, std::size_t{kOctet}>;

// Of one light: what voxels [begin, begin + lanes) make of the factors of a normal.
HWY_INLINE void StoreShares(const LightShares<Octet>& at, float ambient, std::size_t begin, OctetShares& shares) {
  const Octet d;
  hn::StoreInterleaved2(hn::Mul(at.open, at.reached), at.reached, d, shares.scale[begin]);
  const auto of_ambient = hn::Mul(hn::Mul(at.open, hn::Set(d, ambient)), hn::Sub(hn::Set(d, 1.0F), at.reached));
  hn::StoreInterleaved2(of_ambient, hn::Zero(d), d, shares.add[begin]);
}

#if HWY_MAX_BYTES >= 32

// SharesAt for the voxels of a whole octet along the fast axis u, between eight voxels of the light volume that follow each other.
HWY_INLINE LightShares<Octet> SharesInRow(const FrameLight::View& light, const SliceAxes& axes, const Index3& first) {
  const Octet d;
  const hn::RebindToSigned<Octet> di;
  const auto place = [&](Axis axis) {
    const auto i = std::size_t(Number(axis));
    return std::min(std::max(float(first[axis]) * light.scale[i] + light.offset[i], 0.0F), light.last[i]);
  };
  // In order of x, y and z, as there.
  const Axis y = std::min(axes.c, axes.v), z = std::max(axes.c, axes.v);
  const float at_y = place(y), at_z = place(z);
  const auto below_y = std::int32_t(at_y), below_z = std::int32_t(at_z), below_u = std::int32_t(place(axes.u));
  const auto in_256ths = [](float t) { return std::int32_t(t * 256 + 0.5F); };
  const std::int32_t t_y = in_256ths(at_y - float(below_y)), t_z = in_256ths(at_z - float(below_z)), t_yz = t_y * t_z >> 8;
  const std::int32_t stride_y = light.stride[std::size_t(Number(y))], stride_z = light.stride[std::size_t(Number(z))];
  const std::uint8_t* const row = light.shares + below_y * stride_y + below_z * stride_z + 2 * below_u;
  const hn::FixedTag<std::uint8_t, 16> bytes;
  const hn::FixedTag<std::uint16_t, 16> sums;
  const auto weighted = [&](std::int32_t offset, std::int32_t weight) HWY_ATTR {
    return hn::Mul(hn::PromoteTo(sums, hn::LoadU(bytes, row + offset)), hn::Set(sums, std::uint16_t(weight)));
  };
  const auto pairs = hn::BitCast(di, hn::Add(hn::Add(weighted(0, 256 - t_y - t_z + t_yz), weighted(stride_y, t_y - t_yz)),
                                             hn::Add(weighted(stride_z, t_z - t_yz), weighted(stride_y + stride_z, t_yz))));

  const auto u = std::size_t(Number(axes.u));
  const auto voxel = hn::Add(hn::Set(d, float(first[axes.u])), hn::Iota(d, 0.0F));
  const auto among = hn::Add(hn::Mul(voxel, hn::Set(d, light.scale[u])), hn::Set(d, light.offset[u]));
  const auto inside = hn::Min(hn::Max(among, hn::Zero(d)), hn::Set(d, light.last[u]));
  const auto below = hn::ConvertTo(di, inside);
  const auto t = hn::Sub(inside, hn::ConvertTo(d, below));
  const auto index = hn::Sub(below, hn::Set(di, below_u));
  const auto a = hn::TableLookupLanes(pairs, hn::IndicesFromVec(di, index));
  const auto b = hn::TableLookupLanes(pairs, hn::IndicesFromVec(di, hn::Add(index, hn::Set(di, 1))));
  const auto low = hn::Set(di, 0xFFFF);
  const auto interpolated = [&](auto from, auto to) HWY_ATTR {
    const auto near = hn::ConvertTo(d, hn::And(from, low));
    return hn::Mul(hn::Add(near, hn::Mul(t, hn::Sub(hn::ConvertTo(d, hn::And(to, low)), near))), hn::Set(d, 1.0F / (255 * 256)));
  };
  return {interpolated(a, b), interpolated(hn::ShiftRight<16>(a), hn::ShiftRight<16>(b))};
}

#endif

// `first`: voxel 0 of the octet.
HWY_INLINE void LightOctet(const OctetLight& light, const Index3& first, Axis u, const OctetWork& octet, OctetShares& shares) {
  const Octet d;
  HWY_ALIGN float open[kOctet], reached[kMaxLights][kOctet];
  for (std::size_t begin = 0; begin < std::size_t{kOctet}; begin += hn::Lanes(d)) {
    const auto at = [&](Axis axis) HWY_ATTR {
      const auto start = hn::Set(d, float(first[axis]));
      return axis == u ? hn::Add(start, hn::Iota(d, float(begin))) : start;
    };
    const auto place = PlaceInLight(d, light.view, at(Axis::kX), at(Axis::kY), at(Axis::kZ));
    const auto shares_of_first = SharesAt(d, light.view, place, 0);
    if (light.by_light.empty()) {
      StoreShares(shares_of_first, light.ambient, begin, shares);
      continue;
    }
    hn::Store(shares_of_first.open, d, open + begin);
    hn::Store(shares_of_first.reached, d, reached[0] + begin);
    for (int number = 1; number < light.view.lights; ++number) {
      hn::Store(SharesAt(d, light.view, place, number).reached, d, reached[number] + begin);
    }
  }
  if (light.by_light.empty()) return;
  const VoxelRecord* record = octet.records;
  shares = {};
  for (std::uint32_t rest = octet.occupied; rest != 0; rest &= rest - 1, ++record) {
    const int voxel = std::countr_zero(rest);
    PhongFactors sum = {light.ambient, 0};
    for (std::size_t number = 0; number < light.by_light.size(); ++number) {
      // Without shadows there is one share for all lights.
      const float share = reached[std::min(int(number), light.view.lights - 1)][voxel];
      const PhongFactors& factors = light.by_light[number][record->normal];
      sum.diffuse += share * (factors.diffuse - light.ambient);
      sum.specular += share * factors.specular;
    }
    shares.add[voxel][0] = open[voxel] * sum.diffuse;
    shares.add[voxel][1] = sum.specular;
  }
}

void LightAll(const OctetLight& light, const SliceAxes& axes, std::int32_t slice, std::span<const VoxelPlace> places,
              std::span<OctetWork> octets, OctetShares* shares) {
  Index3 first;
  first[axes.c] = slice;
#if HWY_MAX_BYTES >= 32
  // Eight voxels of the light volume hold an octet and the voxel behind it.
  constexpr float kMostApart = 0.75F;
  if (light.by_light.empty() && light.view.fast == Number(axes.u) && light.view.scale[std::size_t(light.view.fast)] <= kMostApart) {
    for (std::size_t i = 0; i < octets.size(); ++i) {
      first[axes.u] = places[i].u;
      first[axes.v] = places[i].v;
      StoreShares(SharesInRow(light.view, axes, first), light.ambient, 0, shares[i]);
      octets[i].shares = &shares[i];
    }
    return;
  }
#endif
  for (std::size_t i = 0; i < octets.size(); ++i) {
    first[axes.u] = places[i].u;
    first[axes.v] = places[i].v;
    LightOctet(light, first, axes.u, octets[i], shares[i]);
    octets[i].shares = &shares[i];
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(LightAll);

OctetLight::OctetLight(const Shading& shading, const Vec3& view_direction, const FrameLight& light) : view(light.Seen()) {
  const std::vector<Vec3> lights = Phong(shading, view_direction).lights();
  const bool lit = shading.model != ShadingModel::kNone;
  if (lit) ambient = shading.On().ambient;
  if (lights.size() == 1) return;
  for (const Vec3& direction : lights) {
    Shading alone = shading;
    alone.lights = {direction};
    by_light.push_back(PhongTable(alone, view_direction));
    if (lit) continue;
    for (PhongFactors& factors : by_light.back()) factors.diffuse /= float(lights.size());  // without surfaces: the mean of the lights
  }
}

void LightOctets(const OctetLight& light, const SliceAxes& axes, std::int32_t slice, std::span<const VoxelPlace> places,
                 std::span<OctetWork> octets, std::vector<OctetShares>& shares) {
  if (shares.size() < octets.size()) shares.resize(octets.size());
  HWY_DYNAMIC_DISPATCH(LightAll)(light, axes, slice, places, octets, shares.data());
}

}  // namespace slabstream
#endif
