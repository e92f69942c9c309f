// What an intensity projection shows of the samples along a ray.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/classification/classification_table.h"
#include "common/frame/frame_setup.h"

namespace slabstream::mip {

enum class ProjectionMode : std::uint8_t { kMaximum = 0, kMinimum = 1, kMean = 2 };

// The renderer's parameters, in the order of RendererKind::parameters.
inline double SamplesPerVoxel(const FrameSetup& setup) { return setup.parameters.at(0); }
inline ProjectionMode ModeOf(const FrameSetup& setup) { return ProjectionMode(int(setup.parameters.at(1))); }
inline bool TakesNearestVoxel(const FrameSetup& setup) { return setup.parameters.at(2) != 0; }

// The data values that count as 0 and 1; values beyond count as these.
struct ProjectedValues {
  double least, largest;
};
// The volume's least and largest value, or values far beyond all that the transfer function tells apart: so one voxel far away from the
// others (a hot pixel, a fill value) leaves them their precision, and means their values.
inline ProjectedValues ProjectedValuesOf(const TransferFunction& transfer, const ValueRange& range) {
  constexpr double kFar = 1024;  // times what it tells apart
  const NodeRange nodes = NodesOf(transfer);
  const ProjectedValues all = {double(range.min), double(range.max)};
  const double reach = kFar * std::max(nodes.last - nodes.first, 0x1p-20 * std::max(std::abs(nodes.first), std::abs(nodes.last)));
  if (!(reach > 0)) return all;  // one value, 0, or no function
  const ProjectedValues near = {std::max(all.least, nodes.first - reach), std::min(all.largest, nodes.last + reach)};
  return near.least < near.largest ? near : all;
}

// What the four channels of a pixel hold. Value: data values from the least (0) to the largest (1) of ProjectedValuesOf.
//   maximum  kMaximum  (value, 0, 0, 1)
//   minimum  kMaximum  (1 - value, 0, 0, 1)
//   mean     kSum      the sum of all values and their number (SumOfValues, common/renderers/projection_kind.h)
// With other fields (FrameSetup::fields) a channel holds what one field has: the volume the first one, and the others those after it.
//   field            kMaximum  (1 + value) / 2, or (1 + (1 - value)) / 2; below 1/2: there is no value
//   the last channel           at least kOfOthers, since a pixel with 0 there is empty
inline constexpr std::size_t kMostFields = 4;
inline constexpr float kOfOthers = 0.25F;

}  // namespace slabstream::mip
