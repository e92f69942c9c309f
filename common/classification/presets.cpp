// The built-in transfer functions. CT has a unit, so its presets are anchored to materials; the others are fitted to the histogram.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/classification/color_maps.h"
#include "common/classification/histogram_analysis.h"
#include "common/classification/transfer_function.h"

namespace slabstream {
namespace {

// ---- Everything, and nothing known about it

TransferFunction GrayRamp(const VolumeSummary& summary) {
  const auto [min, max] = summary.range;
  return {{{min, {0, 0, 0}}, {max, {1, 1, 1}}}, {{min, 0}, {max, 1}}};
}

TransferFunction None(const VolumeSummary& summary) { return {{{summary.range.min, {0, 0, 0}}}, {{summary.range.min, 0}}}; }

// All but the lowest value is solid: masks, voxelised objects and Z-buffer renderings of them.
TransferFunction Opaque(const VolumeSummary& summary) {
  const auto [min, max] = summary.range;
  constexpr Rgb kCold = {0.55F, 0.63F, 0.73F}, kWarm = {0.97F, 0.93F, 0.85F};
  if (min == max) return {{{min, kWarm}}, {{min, 1}}};
  // A step half way to the second of 256 values: between 0 and 1 in an 8-bit volume.
  const double second = std::lerp(double(min), double(max), 1.0 / 255);
  return {{{min, kCold}, {max, kWarm}}, {{min, 0, 0.5, 1}, {second, 1}}};
}

// ---- Everything that differs from the background

// One stop of a side's curves: the share of the side's voxels that lie nearer to the background.
struct Stop {
  double quantile;
  double opacity;  // as a multiple of the median's
  Rgb above, below;
};
constexpr std::array<Stop, 5> kStops = {{
    {0.02, 0.05, {0.52F, 0.22F, 0.14F}, {0.12F, 0.22F, 0.48F}},
    {0.20, 0.35, {0.75F, 0.42F, 0.26F}, {0.18F, 0.40F, 0.68F}},
    {0.50, 1.00, {0.90F, 0.66F, 0.44F}, {0.36F, 0.61F, 0.84F}},
    {0.85, 3.00, {0.97F, 0.88F, 0.70F}, {0.66F, 0.85F, 0.95F}},
    {0.995, 6.00, {1.00F, 0.98F, 0.93F}, {0.92F, 0.98F, 1.00F}},
}};
constexpr double kMaxOpacity = 0.95;

// The opacity per voxel length at which a mean stretch of material (its share of the volume's side) lets 2 % of the light through.
double MedianOpacity(const VolumeSummary& summary, double share) {
  const double side = std::cbrt(double(summary.description.geometry.bounds().voxel_count()));
  const double stretch = std::max(share * side, 1.0);  // voxels
  return std::clamp(1 - std::pow(0.02, 1 / stretch), 0.1, 0.5);
}

// Air of CT, in Hounsfield units.
constexpr float kSurelyAir = -500, kNoHounsfield = -4096;

// Whether values are best told by a colour map: those of simulations, which are no patient and no CT, and are no integers, or packed ones.
bool IsSimulated(const VolumeSummary& summary) {
  const VolumeDescription& description = summary.description;
  const bool is_patient = description.geometry.orientation.world == World::kPatient;
  const bool is_ct = summary.range.min <= kSurelyAir && summary.range.min >= kNoHounsfield;
  return !is_patient && !is_ct && (description.type == ScalarType::kFloat32 || description.mapping.scale != 1);
}

// Voxels of the foreground by bin.
std::array<double, kHistogramBins> CountsOf(const Foreground& foreground, const VolumeSummary& summary) {
  std::array<double, kHistogramBins> counts = {};
  for (const MaterialBins& bins : {foreground.below, foreground.above}) {
    for (int bin = bins.first; bin <= bins.last; ++bin) counts[std::size_t(bin)] = double(summary.histogram[std::size_t(bin)]);
  }
  return counts;
}

// The data value below which the share q, in [0, 1], of the foreground lies. Values count as spread evenly over their bin.
double ForegroundQuantile(const std::array<double, kHistogramBins>& counts, const ValueRange& range, double q) {
  double left = q * std::accumulate(counts.begin(), counts.end(), 0.0);
  double place = 0;  // in bins
  for (int bin = 0; bin < kHistogramBins; ++bin) {
    const double count = counts[std::size_t(bin)];
    if (count == 0) continue;
    place = bin + std::min(left / count, 1.0);
    if (left <= count) break;
    left -= count;
  }
  return std::lerp(double(range.min), double(range.max), place / kHistogramBins);
}

// As many colours for each share of the foreground: few voxels of most simulations have values near the ends of the range.
std::vector<ColorPoint> ColorsByShare(const ColorMap& map, const Foreground& foreground, const VolumeSummary& summary) {
  constexpr double kLeftOut = 0.01;  // share of the foreground, at either end
  const auto counts = CountsOf(foreground, summary);
  std::vector<ColorPoint> colors;
  for (const auto& [at, color] : map.points) {
    colors.push_back({ForegroundQuantile(counts, summary.range, std::lerp(kLeftOut, 1 - kLeftOut, at)), color});
  }
  return colors;
}

// Whether it has one value, as a mask does.
bool IsOfOneValue(const Foreground& foreground, const VolumeSummary& summary) {
  const auto counts = CountsOf(foreground, summary);
  return std::ranges::count_if(counts, [](double count) { return count > 0; }) == 1;
}

// As near to the volume's least value as curves can tell apart.
double JustAbove(const ValueRange& range) { return double(range.min) + std::max(1e-6 * std::abs(double(range.min)), 1e-30); }

// All is background. Higher values would show: --scalar-range may stretch the function, and other times of a dataset have its function,
// too.
TransferFunction OfOneValue(const VolumeSummary& summary) {
  constexpr double kOpacity = 0.1;
  const double least = double(summary.range.min), above = JustAbove(summary.range);
  return {{{least, kStops.front().above}, {above, kStops.back().above}}, {{least, 0}, {above, kOpacity}}};
}

// Shows what differs from the background. Opacities and colours are spread over the quantiles of those values: warm colours above the
// background, cold ones below; or those of viridis, for values of simulations. A ray through an average stretch of material comes out
// nearly opaque. A volume of one value has nothing to show.
TransferFunction Automatic(const VolumeSummary& summary) {
  const Foreground foreground = FindForeground(summary);
  const auto& [above, below] = foreground;
  if (above.share == 0 && below.share == 0) return OfOneValue(summary);
  const double median = MedianOpacity(summary, above.share + below.share);
  TransferFunction transfer;
  const auto add = [&](double value, double opacity, const Rgb& color) {
    transfer.opacities.push_back({value, std::min(opacity * median, kMaxOpacity)});
    transfer.colors.push_back({value, color});
  };
  if (below.share > 0) {
    for (auto stop = kStops.rbegin(); stop != kStops.rend(); ++stop) {
      add(Quantile(summary, below, 1 - stop->quantile), stop->opacity, stop->below);
    }
    add(BinBorder(summary.range, below.last + 1), 0, kStops.front().below);
  }
  if (above.share > 0) {
    add(BinBorder(summary.range, above.first), 0, kStops.front().above);
    for (const Stop& stop : kStops) add(Quantile(summary, above, stop.quantile), stop.opacity, stop.above);
  }
  if (IsSimulated(summary) && !IsOfOneValue(foreground, summary)) {
    transfer.colors = ColorsByShare(*FindNamed(NamedColorMaps(), "viridis"), foreground, summary);
  }
  return transfer;
}

// ---- CT

// Data values of the materials that CT presets use.
struct CtScale {
  double air, skin, soft_tissue, bone, dense_bone, metal;
};

// Hounsfield units if air is far below zero. Hounsfield units plus 1024, as scanners store them, if values begin at zero and go far beyond
// eight bits. For anything else (8-bit and industrial scans) shares of the range, chosen on 8-bit head scans.
CtScale FindCtScale(const ValueRange& range) {
  constexpr CtScale kHounsfield = {-900, -350, 40, 180, 420, 1500};
  if (range.min <= kSurelyAir) return kHounsfield;
  if (range.min >= 0 && range.max >= 2000) {
    constexpr double kStored = 1024;
    return {kHounsfield.air + kStored,  kHounsfield.skin + kStored,       kHounsfield.soft_tissue + kStored,
            kHounsfield.bone + kStored, kHounsfield.dense_bone + kStored, kHounsfield.metal + kStored};
  }
  const auto at = [&](double share) { return std::lerp(double(range.min), double(range.max), share); };
  return {at(0.08), at(0.16), at(0.27), at(0.42), at(0.55), at(0.90)};
}

constexpr Rgb kSkin = {0.86F, 0.64F, 0.52F}, kMuscle = {0.84F, 0.42F, 0.33F}, kBone = {0.93F, 0.87F, 0.76F}, kDenseBone = {1, 0.98F, 0.94F};

TransferFunction CtBone(const VolumeSummary& summary) {
  const CtScale ct = FindCtScale(summary.range);
  return {{{ct.bone, {0.80F, 0.66F, 0.50F}}, {ct.dense_bone, kBone}, {ct.metal, kDenseBone}},
          {{ct.bone, 0}, {ct.dense_bone, 0.75}, {ct.metal, 0.95}}};
}

// Muscle as a veil round the bones.
TransferFunction CtSoftTissue(const VolumeSummary& summary) {
  const CtScale ct = FindCtScale(summary.range);
  return {{{ct.skin, kSkin}, {ct.soft_tissue, kMuscle}, {ct.bone, {0.84F, 0.60F, 0.46F}}, {ct.dense_bone, kBone}, {ct.metal, kDenseBone}},
          {{ct.skin, 0}, {ct.soft_tissue, 0.02}, {ct.bone, 0.06}, {ct.dense_bone, 0.6}, {ct.metal, 0.95}}};
}

// The outer surface, solid within a few voxels.
TransferFunction CtSkin(const VolumeSummary& summary) {
  const CtScale ct = FindCtScale(summary.range);
  return {{{ct.skin, kSkin}, {ct.soft_tissue, {0.90F, 0.70F, 0.58F}}, {ct.dense_bone, kBone}, {ct.metal, kDenseBone}},
          {{std::midpoint(ct.air, ct.skin), 0}, {ct.skin, 0.4}, {ct.soft_tissue, 0.9}}};
}

// ---- CT, by value and slope

// The slope of a border between two materials. Scanners blur borders: here the value changes evenly over three voxels.
double SlopeBetween(double one, double other, const VolumeSummary& summary) {
  const Vec3& spacing = summary.description.geometry.spacing;
  return std::abs(other - one) / (3 * std::min({spacing.x, spacing.y, spacing.z}));
}
// Beyond every slope that central differences have.
double SteepestIn(const VolumeSummary& summary) {
  const double width = double(summary.range.max) - double(summary.range.min);
  const Vec3& spacing = summary.description.geometry.spacing;
  return std::clamp(width / std::min({spacing.x, spacing.y, spacing.z}), 1e-300, kMaxScalar);
}
// As a preset, whose range may have no width.
TransferRegion RegionBetween(RegionCorner from, RegionCorner to, const Rgb& color, double opacity, double softness) {
  to.value = std::max(to.value, std::nextafter(from.value, kMaxScalar));
  to.slope = std::max(to.slope, std::nextafter(from.slope, kMaxScalar));
  return {{from, {to.value, from.slope}, to, {from.value, to.slope}}, color, opacity, softness};
}
TransferFunction OfRegions(std::vector<TransferRegion> regions) {
  return WithCurvesOfRegions({.colors = {}, .opacities = {}, .regions = std::move(regions)});
}

// Dense borders of bones, and their insides as a veil.
TransferFunction CtBoneBorders(const VolumeSummary& summary) {
  const CtScale ct = FindCtScale(summary.range);
  const double border = SlopeBetween(ct.soft_tissue, ct.dense_bone, summary), steepest = SteepestIn(summary);
  const double most = std::max(ct.metal, double(summary.range.max));
  return OfRegions({RegionBetween({ct.bone, 0}, {most, border}, {0.80F, 0.52F, 0.40F}, 0.05, 0.2),
                    RegionBetween({std::lerp(ct.bone, ct.dense_bone, 0.3), 0.35 * border}, {most, steepest}, kBone, 0.9, 0.1)});
}

// The border of air and skin as a veil, and the borders of bones.
TransferFunction CtSkinVeil(const VolumeSummary& summary) {
  const CtScale ct = FindCtScale(summary.range);
  const double skin = SlopeBetween(ct.air, ct.soft_tissue, summary), bone = SlopeBetween(ct.soft_tissue, ct.dense_bone, summary);
  const double most = std::max(ct.metal, double(summary.range.max)), steepest = SteepestIn(summary);
  return OfRegions({RegionBetween({std::midpoint(ct.air, ct.skin), 0.3 * skin}, {ct.soft_tissue, steepest}, kSkin, 0.12, 0.2),
                    RegionBetween({std::lerp(ct.bone, ct.dense_bone, 0.3), 0.35 * bone}, {most, steepest}, kBone, 0.9, 0.1)});
}

// Contrast agent between soft tissue and bone: brighter than tissue, and its borders are flatter than those of bones.
TransferFunction CtVessels(const VolumeSummary& summary) {
  const CtScale ct = FindCtScale(summary.range);
  const double begin = std::lerp(ct.soft_tissue, ct.bone, 0.6), border = SlopeBetween(ct.soft_tissue, ct.dense_bone, summary);
  return OfRegions({RegionBetween({begin, 0}, {std::lerp(ct.dense_bone, ct.metal, 0.1), border}, {0.85F, 0.16F, 0.12F}, 0.6, 0.3)});
}

// ---- Fitted to the values above the background

// The bins above the background; if there are none the upper half of all bins, so that each preset shows something of any volume.
MaterialBins MaterialOf(const VolumeSummary& summary) {
  const MaterialBins above = FindForeground(summary).above;
  return above.share > 0 ? above : MaterialBins{kHistogramBins / 2, kHistogramBins - 1, 0.5};
}

// The opacity per voxel length at which a stretch of this share of the volume's side, of at least four voxels, lets 2 % of the light
// through. A surface that is solid within fewer voxels shows them as steps, like the grain of wood.
double SoftSurfaceOpacity(const VolumeSummary& summary, double share_of_side) {
  const double side = std::cbrt(double(summary.description.geometry.bounds().voxel_count()));
  return 1 - std::pow(0.02, 1 / std::max(share_of_side * side, 4.0));
}

// A soft surface round grey matter. At the bottom of the folds grey matter shares its voxels with fluid and is darker than on top. Colour
// makes it darker still, so that the folds stand out.
TransferFunction MriBrain(const VolumeSummary& summary) {
  const MaterialBins tissue = MaterialOf(summary);
  const double begin = BinBorder(summary.range, tissue.first), middle = Quantile(summary, tissue, 0.5);
  const double clear = std::lerp(begin, middle, 0.4), solid = std::lerp(begin, middle, 0.85), opacity = SoftSurfaceOpacity(summary, 0.025);
  const auto at = [&](double q) { return std::max(clear, Quantile(summary, tissue, q)); };
  return {{{clear, {0.34F, 0.17F, 0.14F}},
           {at(0.02), {0.66F, 0.40F, 0.34F}},
           {at(0.20), {0.87F, 0.60F, 0.52F}},
           {at(0.45), {0.95F, 0.75F, 0.66F}},
           {at(0.70), {0.98F, 0.86F, 0.78F}},
           {at(0.98), {1.00F, 0.95F, 0.90F}}},
          {{clear, 0}, {solid, opacity}, {std::max(solid, at(0.98)), std::min(1.4 * opacity, 0.95)}}};
}

// For slices: all is opaque, and few values are black or white only.
TransferFunction Window(const VolumeSummary& summary) {
  constexpr double kBelowWhite = 0.995;  // share of the material
  const MaterialBins material = MaterialOf(summary);
  const double black = BinBorder(summary.range, material.first), white = Quantile(summary, material, kBelowWhite);
  if (!(black < white)) return {{{double(summary.range.max), {1, 1, 1}}}, {{double(summary.range.max), 1}}};
  return {{{black, {0, 0, 0}}, {white, {1, 1, 1}}}, {{black, 1}}};
}

// For T1: the brain lies between the fluids, which are dark, and the fat of the scalp, which is brightest. Both ends are almost clear, so
// the skin is a veil. Where grey matter shares its voxels with fluid, in the folds, it is dark, so that they stand out.
TransferFunction MriHead(const VolumeSummary& summary) {
  const MaterialBins tissue = MaterialOf(summary);
  const double begin = BinBorder(summary.range, tissue.first);
  const auto at = [&](double q) { return Quantile(summary, tissue, q); };
  return {{{begin, {0.55F, 0.32F, 0.27F}},
           {at(0.34), {0.50F, 0.22F, 0.17F}},
           {at(0.47), {0.78F, 0.47F, 0.39F}},
           {at(0.65), {0.95F, 0.72F, 0.62F}},
           {at(0.86), {1, 0.93F, 0.86F}},
           {at(0.975), {0.95F, 0.85F, 0.75F}}},
          {{at(0.2), 0}, {at(0.36), 0.004}, {at(0.47), 0.05}, {at(0.75), 0.16}, {at(0.92), 0.12}, {at(0.96), 0.012}, {at(0.995), 0.006}}};
}

// Vessels are the brightest few per cent, or all of the material where everything else was masked out.
TransferFunction Angiography(const VolumeSummary& summary) {
  constexpr double kVesselShare = 0.03;  // of all voxels
  const MaterialBins material = MaterialOf(summary);
  const double share = std::max(material.share, kVesselShare);
  const double begin =
      share > kVesselShare ? Quantile(summary, material, 1 - kVesselShare / share) : BinBorder(summary.range, material.first);
  const auto at = [&](double s) { return std::lerp(begin, double(summary.range.max), s); };
  return {{{begin, {0.45F, 0.05F, 0.05F}}, {at(0.25), {0.78F, 0.14F, 0.10F}}, {at(0.6), {0.95F, 0.50F, 0.28F}}, {at(1), {1, 0.92F, 0.75F}}},
          {{begin, 0}, {at(0.15), 0.3}, {at(0.5), 0.8}, {at(1), 0.95}}};
}

// Like glowing gas: thin where values are low (colours after "plasma" of matplotlib). Stops are quantiles, because the values of plumes and
// fields often fall off over orders of magnitude.
TransferFunction Simulation(const VolumeSummary& summary) {
  const MaterialBins material = MaterialOf(summary);
  const double begin = BinBorder(summary.range, material.first);
  const auto at = [&](double q) { return Quantile(summary, material, q); };
  return {{{begin, {0.24F, 0.10F, 0.72F}},
           {at(0.40), {0.55F, 0.10F, 0.72F}},
           {at(0.75), {0.86F, 0.32F, 0.48F}},
           {at(0.93), {0.97F, 0.58F, 0.25F}},
           {at(0.998), {0.98F, 0.95F, 0.35F}}},
          {{begin, 0}, {at(0.40), 0.02}, {at(0.75), 0.08}, {at(0.93), 0.25}, {at(0.998), 0.7}}};
}

// The map spans the values that show, but for the rarest ones.
TransferFunction Mapped(const ColorMap& map, const VolumeSummary& summary) {
  constexpr double kLeftOut = 0.02;  // share of the foreground, at either end
  const auto counts = CountsOf(FindForeground(summary), summary);
  const double from = ForegroundQuantile(counts, summary.range, kLeftOut);
  const double to = std::max(ForegroundQuantile(counts, summary.range, 1 - kLeftOut), JustAbove(summary.range));
  TransferFunction transfer;
  for (const auto& [at, color] : map.points) transfer.colors.push_back({std::lerp(from, to, at), color});
  transfer.opacities = Automatic(summary).opacities;
  return transfer;
}

std::vector<TransferPreset> AllPresets() {
  std::vector<TransferPreset> presets = {
      {"auto", "from the histogram: all that differs from the background", Automatic},
      {"gray-ramp", "black to white and clear to opaque over the value range", GrayRamp},
      {"window", "black to white and opaque, from the background to the brightest material: slices", Window},
      {"opaque", "everything above the lowest value, solid: masks, voxelised objects", Opaque},
      {"ct-bone", "CT: bones", CtBone},
      {"ct-soft-tissue", "CT: bones in a veil of muscle", CtSoftTissue},
      {"ct-skin", "CT: the skin, solid", CtSkin},
      {"ct-bone-2d", "CT, by value and gradient: borders of bones, their insides as a veil", CtBoneBorders, nullptr, true},
      {"ct-skin-2d", "CT, by value and gradient: the skin as a veil round the bones", CtSkinVeil, nullptr, true},
      {"ct-vessels-2d", "CT angiography, by value and gradient: vessels without the borders of bones", CtVessels, nullptr, true},
      {"mri-brain", "MRI: the surface of a brain whose skull was removed", MriBrain},
      {"mri-head", "MRI: a whole head, the skin as a veil", MriHead},
      {"angiography", "CT or MR angiography: the vessels", Angiography},
      {"simulation", "simulations: glowing gas", Simulation},
      {kNoTransfer, "nothing is visible, so that isosurfaces (--isovalue) stand alone", None},
  };
  for (const ColorMap& map : NamedColorMaps()) {
    presets.push_back({map.name, map.purpose, [&map](const VolumeSummary& summary) { return Mapped(map, summary); }, &map});
  }
  return presets;
}

}  // namespace

const std::vector<TransferPreset>& TransferPresets() {
  static const std::vector<TransferPreset> presets = AllPresets();
  return presets;
}

ScalarRange InDataValues(const ScalarRange& range, const VolumeSummary& summary) {
  if (!range.percentiles) return range;
  const VolumeSummary usual = WithoutOutliers(summary);
  const MaterialBins material = MaterialOf(usual);
  return {Quantile(usual, material, range.min / 100), Quantile(usual, material, range.max / 100)};
}

Result<TransferFunction> MakePreset(std::string_view name, const VolumeSummary& summary) {
  if (const TransferPreset* preset = FindNamed(TransferPresets(), name)) return preset->make(WithoutOutliers(summary));
  return Status::NotFound(fmt::format("no transfer function is named '{}', there are {}{}", name, NamesOf(TransferPresets()),
                                      DidYouMean(name, TransferPresets())));
}

}  // namespace slabstream
