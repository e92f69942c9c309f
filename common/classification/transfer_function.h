// Transfer function: data value -> colour and opacity, as ParaView exports it: a piecewise-linear colour map (RGBPoints) and an opacity
// curve (Points) whose segments have a midpoint and a sharpness (0: linear, 1: a step at the midpoint; between them a Hermite curve,
// as in vtkPiecewiseFunction). Outside the first and the last point the end value holds; at a step, the last of the points at that value.
//
// Beside the curves, isosurfaces may stand at single values, a second opacity curve may lie over the gradient's magnitude, and one material
// may say how all that the function shows answers light.
//
// A two-dimensional transfer function has regions of values and slopes in place of the curves. CurvesOf makes curves that go with them:
// where these are 0, no region shows anything. So all that depends on values alone (what is skipped, planned, counted) works by the curves.
//
// Opacity is that of `opacity_distance` voxel lengths of material (the smallest spacing), so a value's extinction per voxel length is
// -ln(1 - opacity) / opacity_distance; renderers correct it for the distance between their samples.
// Colours are straight (not premultiplied) and taken as linear: an opaque, unshaded voxel shows exactly these values.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/classification/rgb.h"
#include "common/classification/transfer_region.h"
#include "common/view/material.h"
#include "common/volume/summary.h"

namespace slabstream {

inline constexpr int kMaxTransferPoints = 4096;     // points of each curve
inline constexpr double kMaxOpacityDistance = 1e6;  // voxel lengths
inline constexpr int kMaxIsosurfaces = 8;
inline constexpr double kMaxScalar = 1e300;  // limit of isovalues, slopes and the ends of scalar ranges; either sign

// Each channel times the factor, at most 1 (FrameRequest::brightness).
Rgb Brightened(Rgb color, double factor);

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

// The surface at which the interpolated volume passes `value`: values of at least `value` lie on one side of it.
struct Isosurface {
  double value = 0;    // data value, in [-kMaxScalar, kMaxScalar]
  Rgb color;           // each in [0, 1]
  double opacity = 1;  // [0, 1], of one passage, at any angle
  friend bool operator==(const Isosurface&, const Isosurface&) = default;
};

// A point of the curve over the gradient's magnitude. Between two points the curve is linear; outside the end value holds.
struct GradientOpacityPoint {
  double slope = 0;    // data values per unit of the world (mm of a patient), in [0, kMaxScalar]; points ascend (equal slopes: a step)
  double opacity = 1;  // [0, 1]: a factor of the opacity that the value has
  friend bool operator==(const GradientOpacityPoint&, const GradientOpacityPoint&) = default;
};
// points not empty, slope finite.
double GradientOpacity(const std::vector<GradientOpacityPoint>& points, double slope);

struct TransferFunction {
  std::vector<ColorPoint> colors;                             // 1 ... kMaxTransferPoints; with regions perhaps none
  std::vector<OpacityPoint> opacities;                        // 1 ... kMaxTransferPoints; with regions perhaps none
  double opacity_distance = 1;                                // voxel lengths, (0, kMaxOpacityDistance]
  std::vector<Isosurface> isosurfaces = {};                   // at most kMaxIsosurfaces, their values ascend
  std::vector<GradientOpacityPoint> gradient_opacities = {};  // at most kMaxTransferPoints; empty: the factor is 1
  std::optional<Material> material = {};                      // none: the standard one; Shading may replace its numbers
  std::vector<TransferRegion> regions = {};                   // at most kMaxTransferRegions

  // It has nothing but the two curves over values, and perhaps a material.
  bool curves_alone() const { return isosurfaces.empty() && gradient_opacities.empty() && regions.empty(); }

  // By the curves; value finite.
  Rgb Color(double value) const;
  double Opacity(double value) const;  // [0, 1]
  friend bool operator==(const TransferFunction&, const TransferFunction&) = default;
};

// The same function with the curves that go with its regions: at each value the opacity of the most opaque region, and the mean of the
// regions' colours. `transfer` valid; without regions it stays as it is.
TransferFunction WithCurvesOfRegions(TransferFunction transfer);

struct ScalarRange {
  double min = 0, max = 1;   // data values, or
  bool percentiles = false;  // percentiles, [0, 100], of a volume's values above its background (FindForeground)
  friend bool operator==(const ScalarRange&, const ScalarRange&) = default;
};
// The range in data values.
ScalarRange InDataValues(const ScalarRange& range, const VolumeSummary& summary);
// The same curves and regions, moved and stretched so that their points lie between range.min (the least one) and range.max (the greatest):
// data values, finite, min <= max. A function whose points all have one value puts them at range.min.
TransferFunction Stretched(TransferFunction transfer, const ScalarRange& range);

// InvalidArgument naming the point, the value and the limit, unless everything stated above holds.
Status Validate(const TransferFunction& transfer);
Status Validate(const std::vector<Isosurface>& isosurfaces);
Status Validate(const std::vector<GradientOpacityPoint>& points);
Status Validate(const Material& material);

// Largest opacity of any value in [low, high] (exact: at curve points and segment ends; the curves are monotone between points; of a step
// above `low` both sides count). 0 if low > high. To decide whether a brick can be skipped, ask the ClassificationTable, which renderers
// use.
double MaxOpacity(const TransferFunction& transfer, double low, double high);

// Parses ParaView's colour-map JSON: an array of presets (the first counts) or one preset object, with "RGBPoints" (x, r, g, b, ...) and
// optional "Points" (x, opacity, midpoint, sharpness, ...); without "Points" the opacity rises linearly over the colour range. Beyond what
// ParaView writes, "Material" may have "ambient", "diffuse", "specular" and "shininess"; those that are left out are the standard ones. In
// place of the curves, "Regions" may be an array of objects with "Corners" (value, slope, ...) or with "Values" and "Slopes" (from, to: a
// box), and "Color" (r, g, b), "Opacity" and "Softness"; the result has their curves (WithCurvesOfRegions).
// Colours are interpolated in RGB; the map's ColorSpace is ignored. Errors: InvalidArgument, beginning with `name`.
Result<TransferFunction> ParseParaViewColorMap(std::string_view json, std::string_view name);

// The inverse, as a preset called `name`. `transfer` valid; only its curves over data values, or its regions, and its material have a place
// there.
std::string FormatParaViewColorMap(const TransferFunction& transfer, std::string_view name);

struct ColorMap;

// Built-in transfer functions, chosen by name; "auto" is made from the histogram of the volume, kNoTransfer shows nothing.
inline constexpr std::string_view kNoTransfer = "none";
struct TransferPreset {
  std::string_view name;     // what --transfer takes
  std::string_view purpose;  // one line for --help
  std::function<TransferFunction(const VolumeSummary&)> make;
  const ColorMap* map = nullptr;  // it spreads these colours over the values that show; all show in slices
  bool has_regions = false;       // two-dimensional, for any volume
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
