#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/phong_table.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/contrib/math/math-inl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "common/memory/aligned_buffer.h"
#include "worker/kernels/normal_code.h"
#include "worker/kernels/phong_table.h"

#ifndef SLABSTREAM_WORKER_KERNELS_PHONG_TABLE_CPP_  // shared by all instruction sets
#define SLABSTREAM_WORKER_KERNELS_PHONG_TABLE_CPP_
namespace slabstream {

inline constexpr std::size_t kPaddedCodes = (std::size_t{kNoGradient} + 15) / 16 * 16;

// Unit vectors of all codes, component by component.
using CodedNormals = std::array<AlignedVector<float>, 3>;
inline const CodedNormals& AllNormals() {
  static const CodedNormals normals = [] {
    CodedNormals all;
    for (int axis = 0; axis < 3; ++axis) {
      AlignedVector<float>& component = all[std::size_t(axis)];
      component.resize(kPaddedCodes);
      for (std::uint16_t code = 0; code < kNoGradient; ++code) component[code] = float(DecodeNormal(code)[axis]);
    }
    return all;
  }();
  return normals;
}

}  // namespace slabstream
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// `lights`: unit; factors: kPaddedCodes of them.
void FillTable(const Material& material, std::span<const Vec3> lights, const Vec3& to_viewer, PhongFactors* factors) {
  const hn::CappedTag<float, 16> d;
  const CodedNormals& normals = AllNormals();
  // Most normals are far from a highlight: factors less than 1e-9 of its peak count as zero and are not computed.
  const auto zero = hn::Zero(d), least = hn::Set(d, float(std::max(std::exp(std::log(1e-9) / material.shininess), 1e-30)));
  const auto shininess = hn::Set(d, material.shininess);
  for (std::size_t i = 0; i < kPaddedCodes; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, &normals[0][i]), y = hn::Load(d, &normals[1][i]), z = hn::Load(d, &normals[2][i]);
    // Not fused: a high power would show the difference between instruction sets.
    const auto along = [&](const Vec3& v) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(x, hn::Set(d, float(v.x))), hn::Mul(y, hn::Set(d, float(v.y)))), hn::Mul(z, hn::Set(d, float(v.z))));
    };
    const auto viewer = along(to_viewer);
    auto diffuse = zero, specular = zero;
    for (const Vec3& light : lights) {
      const auto cosine = along(light);
      diffuse = hn::Add(diffuse, hn::Abs(cosine));
      const auto reflected = hn::Sub(hn::Mul(hn::Add(cosine, cosine), viewer), hn::Set(d, float(Dot(light, to_viewer))));  // R.V
      const auto shines = hn::Gt(reflected, least);
      if (hn::AllFalse(d, shines)) continue;
      const auto power = hn::Exp(d, hn::Mul(shininess, hn::Log(d, hn::Min(hn::Max(reflected, least), hn::Set(d, 1.0F)))));
      specular = hn::Add(specular, hn::IfThenElse(shines, power, zero));
    }
    hn::StoreInterleaved2(hn::MulAdd(diffuse, hn::Set(d, material.diffuse), hn::Set(d, material.ambient)),
                          hn::Mul(specular, hn::Set(d, material.specular)), d, &factors[i].diffuse);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(FillTable);

std::vector<PhongFactors> PhongTable(const Shading& shading, const Vec3& view_direction) {
  static_assert(sizeof(PhongFactors) == 2 * sizeof(float));
  const Phong phong(shading, view_direction);
  std::vector<PhongFactors> factors(kPaddedCodes + 1);
  if (shading.model != ShadingModel::kNone) HWY_DYNAMIC_DISPATCH(FillTable)(shading.On(), phong.lights(), -view_direction, factors.data());
  factors.resize(kNormalCodes);
  factors[kNoGradient] = phong.WithoutGradient();
  return factors;
}

}  // namespace slabstream
#endif
