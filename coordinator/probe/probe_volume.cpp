#include "coordinator/probe/probe_volume.h"

#include <algorithm>
#include <cmath>

namespace slabstream {

Vec3 VoxelPoint(const VolumeGeometry& geometry, const Vec3& at) {
  return geometry.stretch.ToVoxel(geometry.orientation.FromWorld(at - geometry.orientation.origin) / geometry.spacing);
}

double ProbedVoxels::At(const Index3& voxel) const { return held_ ? SampleOf<double>(*held_, voxel) : find_(voxel); }

double ProbeVolume::Interpolated(const Vec3& p) const {
  const Index3 last = voxels.size() - Uniform(1);
  Index3 low, high;
  Vec3 t;
  for (int i = 0; i < 3; ++i) {
    const double inside = std::clamp(p[i], 0.0, double(last[i]));
    low[i] = std::min(std::int32_t(inside), last[i]);
    high[i] = std::min(low[i] + 1, last[i]);
    t[i] = inside - low[i];
  }
  const auto row = [&](std::int32_t y, std::int32_t z) {
    const double a = StoredAt({low.x, y, z});
    return t.x == 0 ? a : a + t.x * (StoredAt({high.x, y, z}) - a);
  };
  const auto slice = [&](std::int32_t z) {
    const double a = row(low.y, z);
    return t.y == 0 ? a : a + t.y * (row(high.y, z) - a);
  };
  const double a = slice(low.z);
  return t.z == 0 ? a : a + t.z * (slice(high.z) - a);
}

Index3 VoxelAt(const Vec3& p) {
  Index3 voxel;
  // Points far outside stay outside.
  for (int i = 0; i < 3; ++i) voxel[i] = std::int32_t(std::clamp(std::floor(p[i] + 0.5), -1.0, double(kMaxVolumeSide)));
  return voxel;
}

VolumeSample SampleAt(const ProbeVolume& volume, const VolumeSummary& summary, const Vec3& at) {
  return SampleAtVoxel(volume, summary, at, VoxelAt(VoxelPoint(summary.description.geometry, at)));
}

VolumeSample SampleAtVoxel(const ProbeVolume& volume, const VolumeSummary& summary, const Vec3& at, const Index3& voxel) {
  VolumeSample sample{.at = at};
  sample.inside = summary.description.geometry.bounds().Contains(voxel);
  if (!sample.inside) return sample;
  sample.voxel = voxel;
  const auto finite = [](double value) { return std::isfinite(value) ? std::optional<double>(value) : std::nullopt; };
  const ValueMapping& mapping = summary.description.mapping;
  const ExactValue value = volume.exact ? volume.exact(voxel) : ExactValue{mapping.FromStored(volume.StoredAt(voxel))};
  sample.value = finite(value.value);
  sample.rest = value.rest;
  if (!IsOfLabels(summary.description.type))
    sample.interpolated = finite(mapping.FromStored(volume.Interpolated(VoxelPoint(summary.description.geometry, at))));
  if (volume.label) sample.label = LabelAt{volume.label(voxel), {}};
  return sample;
}

}  // namespace slabstream
