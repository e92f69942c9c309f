// ClassificationTable: the transfer function sampled once per frame setup, so that renderers classify a stored sample by one look-up.
//
// Bin of a stored sample s: BinOf(s), in [0, size). Each stored value has its own bin in 8-bit volumes, and in 16-bit volumes whose range
// needs at most kMaxBins of them. Otherwise kMaxBins bin centres lie at equal distances, and a sample belongs to the nearest centre. Bins
// ascend with the stored value. Samples that are not finite have no bin: they are empty.
//
// Bins cover what the function distinguishes, not all values that the volume has: from a bin below its first point, colour or isosurface to
// a bin above its last one, as far as the volume's values reach. So one voxel far away from the others (a hot pixel, a fill value) takes no
// bin from them. The first and the last bin stand for all values beyond. The bins round the function's first and last point have exactly
// their value, so a background at the very beginning of an opacity ramp stays empty.
#pragma once

#include <limits>
#include <vector>

#include "common/classification/transfer_function.h"

namespace slabstream {

inline constexpr int kMaxBins = 4096;

struct ClassificationTable {
  double bin_from_stored_scale = 1;  // bin = clamp(floor((stored - origin) * scale + 0.5))
  double stored_origin = 0;
  std::vector<float> opacity;   // by bin: of opacity_distance voxel lengths, in [0, 1]
  std::vector<Rgb> color;       // by bin: straight
  std::vector<double> value;    // by bin: the data value that it stands for
  double opacity_distance = 1;  // voxel lengths
  float max_opacity = 0;        // over all bins
  double stored_extent = 1;     // > 0: between the stored samples that it tells apart, at least 2^-60 of that between all of them

  int size() const { return int(opacity.size()); }
  int BinOf(double stored) const {
    const double bin = (stored - stored_origin) * bin_from_stored_scale + 0.5;
    return bin <= 0 ? 0 : bin >= size() - 1 ? size() - 1 : int(bin);
  }
};

// The data values between which a function changes: beyond them its curves are constant, and no isosurface stands. If
// the function has no points, first > last.
struct NodeRange {
  double first = std::numeric_limits<double>::infinity(), last = -first;
};
NodeRange NodesOf(const TransferFunction& transfer);

// An isovalue among stored samples, in their precision. It is less by 2^-20 of itself: where all voxels have the value, rounding must not
// move interpolated samples below it. It may be infinite: then no surface has it.
float StoredIsovalue(double value, const ValueMapping& mapping);

// `range` is in data values and comes from the volume's summary, so that all workers build the same table.
ClassificationTable Classify(const TransferFunction& transfer, const VolumeDescription& description, ValueRange range);

// The first and the last bin of samples with a data value in `values`, such as a brick of the summary. None: first > last.
struct BinRange {
  int first = 0, last = -1;
};
BinRange BinsOf(const ClassificationTable& table, const VolumeDescription& description, ValueRange values);

// Largest opacity that the table gives to a sample with a data value in `values`, such as a brick of the summary (0 for kNoFiniteValue). If
// it is 0, the values are empty for every renderer; MaxOpacity(TransferFunction) may differ by what happens within one bin.
float MaxOpacity(const ClassificationTable& table, const VolumeDescription& description, ValueRange values);

}  // namespace slabstream
