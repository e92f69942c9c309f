#include "common/renderers/xray/attenuation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace slabstream::xray {
namespace {

// Mass attenuation coefficient of liquid water, cm^2/g, by energy in keV. Hubbell and Seltzer (1995, version 1.4 of 2004), Tables of X-ray
// mass attenuation coefficients, NIST. Water has a density of 1 g/cm^3.
struct Entry {
  double energy, coefficient;
};
constexpr std::array<Entry, 28> kWater = {
    {{10, 5.329},     {15, 1.673},     {20, 0.8096},    {30, 0.3756},    {40, 0.2683},     {50, 0.2269},     {60, 0.2059},
     {80, 0.1837},    {100, 0.1707},   {150, 0.1505},   {200, 0.1370},   {300, 0.1186},    {400, 0.1061},    {500, 0.09687},
     {600, 0.08956},  {800, 0.07865},  {1000, 0.07072}, {1250, 0.06323}, {1500, 0.05754},  {2000, 0.04942},  {3000, 0.03969},
     {4000, 0.03403}, {5000, 0.03031}, {6000, 0.02770}, {8000, 0.02429}, {10000, 0.02219}, {15000, 0.01941}, {20000, 0.01813}}};
static_assert(kWater.front().energy == kLeastEnergy && kWater.back().energy == kMostEnergy);

}  // namespace

double WaterAttenuation(double energy) {
  const auto above = std::ranges::lower_bound(kWater.begin() + 1, kWater.end() - 1, energy, {}, &Entry::energy);
  const auto& [e_0, mu_0] = above[-1];
  const auto& [e_1, mu_1] = above[0];
  // Logarithms are nearly linear between entries.
  const double per_cm = mu_0 * std::pow(mu_1 / mu_0, std::log(energy / e_0) / std::log(e_1 / e_0));
  return per_cm / 10;
}

namespace {

bool OfHounsfield(const FrameSetup& setup) {
  constexpr double kSurelyAir = -500;
  const auto scale = Attenuating(int(setup.parameters.at(kAttenuation)));
  if (scale == Attenuating::kAutomatic) return double(setup.range.min) <= kSurelyAir;
  return scale == Attenuating::kHounsfield;
}

}  // namespace

double MostAttenuating(const FrameSetup& setup) {
  constexpr double kMost = 65535;
  return OfHounsfield(setup) ? std::min(double(setup.range.max), kMost) : double(setup.range.max);
}

Attenuation AttenuationOf(const FrameSetup& setup) {
  const double least = double(setup.range.min), largest = double(setup.range.max);
  constexpr double kAir = -1000;  // Hounsfield units
  const double of_water = WaterAttenuation(setup.parameters.at(kEnergy));
  if (OfHounsfield(setup)) return {of_water, kAir, 0};
  return {of_water, least, std::midpoint(least, largest)};
}

}  // namespace slabstream::xray
