// Percentiles of a dataset's values, by its histogram.
#pragma once

#include <array>

#include "common/volume/summary.h"

namespace slabstream {

inline constexpr std::array kPercents = {0.1, 1.0, 2.0, 5.0, 10.0, 25.0, 50.0, 75.0, 90.0, 95.0, 98.0, 99.0, 99.9};

// The data value that `percent`, in [0, 100], of the finite voxels do not exceed, interpolated within a bin of the histogram, so right to
// within its width; range.min if there are none.
double PercentileOf(const VolumeSummary& summary, double percent);

}  // namespace slabstream
