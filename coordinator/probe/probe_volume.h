// ProbeVolume: the voxels of a dataset, and their labels, one by one and between voxels. For few points: renderers read rows.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "common/stats/probe_results.h"
#include "common/volume/bricks.h"
#include "common/volume/exact_value.h"
#include "common/volume/summary.h"

namespace slabstream {

// A stored sample as a double, which holds those of values exactly, or as std::uint64_t, which holds labels.
template <class Value>
Value SampleOf(const VoxelBricks& voxels, const Index3& voxel) {
  return VisitStoredType(voxels.type(), [&]<class T>(const T*) {
    const BrickView<T> brick = voxels.View<T>(voxel / kBrick);
    return Value(brick.Row(voxel.y, voxel.z)[voxel.x - brick.begin.x]);
  });
}

// The stored samples of a whole volume: in memory, or found one by one.
class ProbedVoxels {
 public:
  ProbedVoxels(const VoxelBricks& voxels)  // NOLINT(google-explicit-constructor): voxels in memory are probed, too
      : size_(voxels.box().end), held_(voxels) {}
  using Find = std::function<double(const Index3& voxel)>;  // the stored sample of a voxel inside the volume
  ProbedVoxels(const Index3& size, Find find) : size_(size), find_(std::move(find)) {}

  const Index3& size() const { return size_; }
  const VoxelBricks* held() const { return held_ ? &*held_ : nullptr; }  // null: not in memory
  double At(const Index3& voxel) const;

 private:
  Index3 size_;
  std::optional<VoxelBricks> held_;
  Find find_;
};

struct ProbeVolume {
  ProbedVoxels voxels;
  std::function<std::uint64_t(const Index3& voxel)> label = nullptr;  // of a voxel inside the volume; 0: none. Null: there are no labels
  // The data value of a voxel inside the volume, where its stored sample may be rounded. Null: it never is.
  std::function<ExactValue(const Index3& voxel)> exact = nullptr;

  double StoredAt(const Index3& voxel) const { return voxels.At(voxel); }  // the stored sample of a voxel inside the volume

  // Trilinear between the voxels around p (voxel coordinates); beyond the outermost centres the nearest voxel counts. NaN: one of them is.
  double Interpolated(const Vec3& p) const;
};

// The voxel whose cell, [v - 0.5, v + 0.5), holds p (voxel coordinates).
Index3 VoxelAt(const Vec3& p);

// The voxel coordinates of a point of the world.
Vec3 VoxelPoint(const VolumeGeometry& geometry, const Vec3& at);

// `at` is a point of the world. `summary` is that of the dataset. A label gets its name later: the labels' own summary has it.
VolumeSample SampleAt(const ProbeVolume& volume, const VolumeSummary& summary, const Vec3& at);
// What the voxel, which may lie outside, holds, as the sample at this point.
VolumeSample SampleAtVoxel(const ProbeVolume& volume, const VolumeSummary& summary, const Vec3& at, const Index3& voxel);

}  // namespace slabstream
