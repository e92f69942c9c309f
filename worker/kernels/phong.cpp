#include "worker/kernels/phong.h"

#include <cmath>
#include <numbers>

#include "worker/kernels/normal_code.h"

namespace slabstream {

double PowerOfFraction(double base, double exponent) {
  if (!(base > 0)) return 0;
  if (base >= 1) return 1;
  // base = m * 2^e with m in [sqrt(1/2), sqrt(2)); ln m = 2 artanh(s), s = (m - 1) / (m + 1), |s| < 0.172: the series' error is below
  // 1e-15.
  int e = 0;
  double m = std::frexp(base, &e);
  if (m < std::numbers::sqrt2 / 2) {
    m *= 2;
    --e;
  }
  const double s = (m - 1) / (m + 1), s2 = s * s;
  double series = 0;
  for (double coefficient : {1.0 / 17, 1.0 / 15, 1.0 / 13, 1.0 / 11, 1.0 / 9, 1.0 / 7, 1.0 / 5, 1.0 / 3, 1.0})
    series = series * s2 + coefficient;
  const double log2 = exponent * (e + 2 * s * series / std::numbers::ln2);
  if (log2 < -1000) return 0;
  // 2^log2 = 2^whole * e^rest, |rest| <= ln(2) / 2: the Taylor series' error is below 1e-15.
  const double whole = std::floor(log2 + 0.5), rest = (log2 - whole) * std::numbers::ln2;
  double power = 0;
  for (double factorial :
       {6227020800.0, 479001600.0, 39916800.0, 3628800.0, 362880.0, 40320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0}) {
    power = power * rest + 1 / factorial;
  }
  return std::ldexp(power, int(whole));
}

Phong::Phong(const Shading& shading, const Vec3& view_direction) : shading_(shading), to_viewer_(-view_direction) {
  for (const Vec3& light : shading.lights) lights_.push_back(Normalized(light));
  if (lights_.empty()) lights_.push_back(to_viewer_);
}

PhongFactors Phong::AtNormal(const Vec3& unit_normal) const {
  if (!shading_.phong) return {};
  double diffuse = 0, specular = 0;
  for (const Vec3& light : lights_) {
    const double n_l = Dot(unit_normal, light);
    const Vec3 reflected = 2 * n_l * unit_normal - light;
    diffuse += std::abs(n_l);
    specular += PowerOfFraction(Dot(reflected, to_viewer_), shading_.shininess);
  }
  return {float(shading_.ambient + shading_.diffuse * diffuse), float(shading_.specular * specular)};
}

PhongFactors Phong::WithoutGradient() const {
  if (!shading_.phong) return {};
  constexpr double kMean = 0.5;  // of |N.L| over all directions of N
  return {float(shading_.ambient + shading_.diffuse * kMean * double(lights_.size())), 0.0F};
}

std::vector<PhongFactors> Phong::ByNormalCode() const {
  std::vector<PhongFactors> factors(kNormalCodes);
  for (int code = 0; code < kNoGradient; ++code) factors[std::size_t(code)] = AtNormal(DecodeNormal(std::uint16_t(code)));
  factors[kNoGradient] = WithoutGradient();
  return factors;
}

}  // namespace slabstream
