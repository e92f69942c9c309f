// What the histogram of a volume says about its content: which values are background, and how those of the material are distributed. The
// presets for data without a standard unit (MRI, simulations, unknown volumes) are fitted with it.
#pragma once

#include "common/volume/summary.h"

namespace slabstream {

// A data value that stands for a bin: the ends of the range for the first and the last bin (values that do occur), else the bin's centre.
double BinValue(const ValueRange& range, int bin);

// Where a bin begins; bin kHistogramBins: where the last one ends.
double BinBorder(const ValueRange& range, int bin);

// Description, range and histogram without a few voxels that lie far beyond all others (a hot pixel, a mark of no data): they would leave
// the others a few bins of the whole range. What the histogram lacks then comes from the ranges of the bricks: each brick's voxels count as
// spread over its range. The same range and histogram if there are no such voxels, or no ranges of bricks.
VolumeSummary WithoutOutliers(const VolumeSummary& summary);

// Consecutive bins on one side of the background, [first, last]; first > last: none.
struct MaterialBins {
  int first = 0, last = -1;
  double share = 0;  // their share of all voxels, in [0, 1]
};

struct Foreground {
  MaterialBins above, below;  // values higher and lower than the background
};

// The background is the peak of the smoothed histogram, or its lowest bin if that alone holds 5 % of the voxels and stands apart (air cut
// to the smallest value; the outside of a mask). Each side of it ends where the triangle method (Zack, Rogers and Latt 1977) puts the foot
// of the peak. If one side holds less than a fifth of the voxels of the other, it counts as noise of the background and is left out.
// Without a clear peak, everything but the lowest bin is material; a volume of one value has none.
Foreground FindForeground(const VolumeSummary& summary);

// The data value below which the share q, in [0, 1], of the voxels of these bins lies. `bins` is not empty.
double Quantile(const VolumeSummary& summary, const MaterialBins& bins, double q);

}  // namespace slabstream
