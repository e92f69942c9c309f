// Transfer function: data value -> colour and opacity, as ParaView exports it: a piecewise-linear colour map (RGBPoints) and an opacity
// curve (Points) whose segments have a midpoint and a sharpness (0: linear, 1: a step at the midpoint; between them a Hermite curve,
// as in vtkPiecewiseFunction). Outside the first and the last point the end value holds; at a step, the last of the points at that value.
//
// Opacity is that of `opacity_distance` voxel lengths of material (the smallest spacing), so a value's extinction per voxel length is
// -ln(1 - opacity) / opacity_distance; renderers correct it for the distance between their samples.
// Colours are straight (not premultiplied) and taken as linear: an opaque, unshaded voxel shows exactly these values.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/volume/summary.h"

namespace slabstream {

inline constexpr int kMaxTransferPoints = 4096;     // of each curve
inline constexpr double kMaxOpacityDistance = 1e6;  // voxel lengths

struct Rgb {
  float r = 0, g = 0, b = 0;
  friend bool operator==(const Rgb&, const Rgb&) = default;
};

struct ColorPoint {
  double value = 0;  // data value, finite; points ascend (equal values make a step)
  Rgb color;         // each in [0, 1]
  friend bool operator==(const ColorPoint&, const ColorPoint&) = default;
};

struct OpacityPoint {
  double value = 0;       // data value, finite; points ascend (equal values make a step)
  double opacity = 0;     // [0, 1]
  double midpoint = 0.5;  // (0, 1): where between this point and the next the curve is half way
  double sharpness = 0;   // [0, 1]
  friend bool operator==(const OpacityPoint&, const OpacityPoint&) = default;
};

struct TransferFunction {
  std::vector<ColorPoint> colors;       // 1 ... kMaxTransferPoints
  std::vector<OpacityPoint> opacities;  // 1 ... kMaxTransferPoints
  double opacity_distance = 1;          // voxel lengths, (0, kMaxOpacityDistance]

  Rgb Color(double value) const;       // value finite
  double Opacity(double value) const;  // value finite; in [0, 1]
  friend bool operator==(const TransferFunction&, const TransferFunction&) = default;
};

struct ScalarRange {
  double min = 0, max = 1;  // data values
  friend bool operator==(const ScalarRange&, const ScalarRange&) = default;
};
// The same curves, moved and stretched so that their points lie between range.min (the least one) and range.max (the greatest). min < max,
// both finite. A function whose points all have one value puts them at range.min.
TransferFunction Stretched(TransferFunction transfer, const ScalarRange& range);

// InvalidArgument naming the point, the value and the limit, unless everything stated above holds.
Status Validate(const TransferFunction& transfer);

// Largest opacity of any value in [low, high] (exact: at curve points and segment ends; the curves are monotone between points; of a step
// above `low` both sides count). 0 if low > high. To decide whether a brick can be skipped, ask the ClassificationTable, which renderers
// use.
double MaxOpacity(const TransferFunction& transfer, double low, double high);

// Parses ParaView's colour-map JSON: an array of presets (the first counts) or one preset object, with "RGBPoints" (x, r, g, b, ...) and
// optional "Points" (x, opacity, midpoint, sharpness, ...); without "Points" the opacity rises linearly over the colour range.
// Colours are interpolated in RGB, whatever the map's ColorSpace. Errors: InvalidArgument, beginning with `name`.
Result<TransferFunction> ParseParaViewColorMap(std::string_view json, std::string_view name);

// The inverse, as a preset called `name`. `transfer` valid; its opacity_distance has no place there.
std::string FormatParaViewColorMap(const TransferFunction& transfer, std::string_view name);

// Built-in transfer functions, chosen by name; "auto" is made from the histogram of the volume.
struct TransferPreset {
  std::string_view name;     // what --transfer takes
  std::string_view purpose;  // one line for --help
  TransferFunction (*make)(const VolumeSummary&);
};
// The only list.
const std::vector<TransferPreset>& TransferPresets();

// NotFound naming the presets there are.
Result<TransferFunction> MakePreset(std::string_view name, const VolumeSummary& summary);

// Share of voxels with an opacity above zero, in [0, 1]: exact for integer samples whose range has at most kHistogramBins values, else
// estimated from the histogram (the first and the last bin by the ends of the range, the others by their centres). Samples that are not
// finite are empty.
double EstimateOccupancy(const VolumeSummary& summary, const TransferFunction& transfer);

}  // namespace slabstream
