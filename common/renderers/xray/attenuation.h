// Attenuation: what a data value does to X-rays. A radiograph shows the line integral of linear attenuation along each ray.
#pragma once

#include "common/frame/frame_setup.h"

namespace slabstream::xray {

// The renderer's parameters, in the order of RendererKind::parameters; the first one is the sampling rate.
inline constexpr std::size_t kEnergy = 1, kAttenuation = 2, kWindow = 3, kLevel = 4, kPolarity = 5;

// Which values attenuate how much. By value of the parameter.
enum class Attenuating { kAutomatic = 0, kHounsfield = 1, kRange = 2 };

inline constexpr double kLeastEnergy = 10, kMostEnergy = 20000;  // keV

// Linear attenuation coefficient of water for photons of this energy, in [kLeastEnergy, kMostEnergy] keV. Per mm.
double WaterAttenuation(double energy);

// Linear attenuation of a data value v, per mm: that of water times (v - clear) / (water - clear), and not below 0.
struct Attenuation {
  double of_water = 0;          // per mm
  double clear = 0, water = 0;  // data values of what attenuates nothing, and of water

  double Of(double value) const { return value > clear && water > clear ? of_water * (value - clear) / (water - clear) : 0; }
};
// The value that attenuates most. Beyond 65535 Hounsfield units nothing is known: a fill value far above takes no precision from the
// others.
double MostAttenuating(const FrameSetup& setup);
// `setup`: of this renderer.
Attenuation AttenuationOf(const FrameSetup& setup);

}  // namespace slabstream::xray
