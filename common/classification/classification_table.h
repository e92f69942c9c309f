// ClassificationTable: the transfer function sampled once per frame setup, so that renderers classify a stored sample by one look-up.
//
// Bin of a stored sample s: BinOf(s), in [0, size). Each stored value has its own bin in 8-bit volumes, and in 16-bit volumes whose range
// has at most kMaxBins values. Otherwise kMaxBins bin centres lie at equal distances over the value range, the first at its beginning and
// the last at its end (so a background at the very beginning of an opacity ramp stays empty), and a sample belongs to the nearest centre.
// Bins ascend with the stored value. Samples that are not finite have no bin: they are empty.
#pragma once

#include <vector>

#include "common/classification/transfer_function.h"

namespace slabstream {

inline constexpr int kMaxBins = 4096;

struct ClassificationTable {
  double bin_from_stored_scale = 1;  // bin = clamp(floor((stored - origin) * scale + 0.5))
  double stored_origin = 0;
  std::vector<float> opacity;   // by bin: of opacity_distance voxel lengths, in [0, 1]
  std::vector<Rgb> color;       // by bin: straight
  double opacity_distance = 1;  // voxel lengths
  float max_opacity = 0;        // over all bins

  int size() const { return int(opacity.size()); }
  // The data value in the middle of a bin.
  double ValueOf(int bin, const ValueMapping& mapping) const { return mapping.FromStored(stored_origin + bin / bin_from_stored_scale); }
  int BinOf(double stored) const {
    const double bin = (stored - stored_origin) * bin_from_stored_scale + 0.5;
    return bin <= 0 ? 0 : bin >= size() - 1 ? size() - 1 : int(bin);
  }
};

// An isovalue among stored samples, in their precision. It is less by 2^-20 of itself: where all voxels have the value, rounding must not
// move interpolated samples below it. It may be infinite: then no surface has it.
float StoredIsovalue(double value, const ValueMapping& mapping);

// `range` is in data values and comes from the volume's summary, so that all workers build the same table.
ClassificationTable Classify(const TransferFunction& transfer, const VolumeDescription& description, ValueRange range);

// Largest opacity that the table gives to a sample with a data value in `values`, such as a brick of the summary (0 for kNoFiniteValue). If
// it is 0, the values are empty for every renderer; MaxOpacity(TransferFunction) may differ by what happens within one bin.
float MaxOpacity(const ClassificationTable& table, const VolumeDescription& description, ValueRange values);

}  // namespace slabstream
