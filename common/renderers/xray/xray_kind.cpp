// The planning half of radiographs: pixels sum up the attenuation of their samples, and a window of these sums becomes grey.

#include <algorithm>

#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"
#include "common/renderers/projection_kind.h"
#include "common/renderers/sampling_rate.h"
#include "common/renderers/xray/attenuation.h"

namespace slabstream::xray {
namespace {

// The largest sum of values of a frame's pixels.
double LargestSum(const LocalImage& frame) {
  constexpr std::size_t kGrain = 4096;  // pixels
  PerThread<double> parts;
  ParallelForRanges(0, frame.rgba.size() / 4, kGrain, [&](std::size_t begin, std::size_t end) {
    double largest = 0;
    for (std::size_t i = begin; i < end; ++i) largest = std::max(largest, SumOfValues(&frame.rgba[4 * i]));
    double& part = parts.Mine();
    part = std::max(part, largest);
  });
  double largest = 0;
  parts.ForEach([&](double part) { largest = std::max(largest, part); });
  return largest;
}

class XrayKind : public ProjectionKind {
 public:
  XrayKind()
      : ProjectionKind({.name = "xray",
                        .title = "radiography",
                        .purpose = "a radiograph: line integrals of X-ray attenuation, in grey; for CT",
                        .format = PixelFormat::kSum,
                        .reach = kRayReach,
                        .derived_from_stored = kRayDerived,
                        .abilities = {Ability::kPerspective, Ability::kLevels, Ability::kShapes},
                        .parameters = {SamplingRate(),
                                       {.name = "energy",
                                        .purpose = "Energy of the X-rays in keV, which decides how much water attenuates",
                                        .standard = 70,
                                        .least = kLeastEnergy,
                                        .most = kMostEnergy},
                                       {.name = "attenuation",
                                        .purpose = "What values attenuate: hounsfield (units of CT); range (the least value nothing, the "
                                                   "largest one twice as much as water); automatic (hounsfield if a value is -500 or less)",
                                        .standard = double(Attenuating::kAutomatic),
                                        .choices = {"automatic", "hounsfield", "range"}},
                                       {.name = "integral-window",
                                        .purpose = "Line integrals from black to white; 0: as many as the picture has",
                                        .standard = 0,
                                        .least = 0,
                                        .most = 1000},
                                       {.name = "integral-level",
                                        .purpose = "Line integral in the middle of the window; 0: half of the window",
                                        .standard = 0,
                                        .least = 0,
                                        .most = 1000},
                                       {.name = "polarity",
                                        .purpose = "Whether what attenuates most is bright (bright-bone) or dark (dark-bone)",
                                        .standard = 0,
                                        .choices = {"bright-bone", "dark-bone"}}}}) {}

  PickRule PickRuleOf(const std::vector<double>& /*parameters*/) const override { return PickRule::kNone; }

  LocalImage Finish(const LocalImage& frame, const FrameSetup& setup) const override {
    const std::vector<double>& parameters = setup.parameters;
    const double step = setup.unit * Least(setup.description.geometry.spacing) / parameters.at(0);  // mm
    const double integral_of_one = AttenuationOf(setup).Of(MostAttenuating(setup)) * step;
    double window = parameters.at(kWindow);
    if (window <= 0) window = LargestSum(frame) * integral_of_one;
    if (window <= 0) window = 1;  // nothing attenuates
    const double level = parameters.at(kLevel) > 0 ? parameters.at(kLevel) : window / 2;
    const bool dark = parameters.at(kPolarity) != 0;
    return ColorPixels(frame, setup, [=](const float* pixel, float* rgba) {
      if (!(pixel[3] > 0)) return;  // the ray misses the volume
      const double place = std::clamp((SumOfValues(pixel) * integral_of_one - level) / window + 0.5, 0.0, 1.0);
      const auto grey = float(dark ? 1 - place : place);
      std::fill_n(rgba, 3, grey);
      rgba[3] = 1;
    });
  }
};

}  // namespace

const RendererKind& Kind() {
  static const XrayKind kind;
  return kind;
}

}  // namespace slabstream::xray
