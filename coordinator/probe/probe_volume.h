// ProbeVolume: the voxels of a dataset and of its layers, one by one and between voxels. For few points: renderers read rows.
#pragma once

#include "common/volume/bricks.h"
#include "common/volume/layers.h"
#include "common/volume/summary.h"
#include "coordinator/probe/volume_sample.h"

namespace slabstream {

struct ProbeVolume {
  VoxelBricks voxels;                                         // of the whole volume
  const BrickedVoxels *labels = nullptr, *overlay = nullptr;  // null: there is no such layer

  // Of a voxel inside the volume. Stored samples of a layer are numbers of labels and data values.
  double StoredAt(const Index3& voxel) const;
  std::uint32_t LabelNumberAt(const Index3& voxel) const;  // 0: none, or no labels

  // Trilinear between the voxels around p (data space); beyond the outermost centres the nearest voxel counts. NaN: one of them is.
  double Interpolated(const Vec3& p) const;
};

// The voxel whose cell, [v - 0.5, v + 0.5), holds p (data space).
Index3 VoxelAt(const Vec3& p);

// Where a point of the world lies in data space.
Vec3 DataPoint(const VolumeGeometry& geometry, const Vec3& at);

// `at` is a point of the world. `summary` is that of the dataset.
VolumeSample SampleAt(const ProbeVolume& volume, const VolumeSummary& summary, const Vec3& at);
// What the voxel, which may lie outside, holds, as the sample at this point.
VolumeSample SampleAtVoxel(const ProbeVolume& volume, const VolumeSummary& summary, const Vec3& at, const Index3& voxel);

}  // namespace slabstream
