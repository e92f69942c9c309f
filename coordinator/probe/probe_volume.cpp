#include "coordinator/probe/probe_volume.h"

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

double SampleOf(const VoxelBricks& voxels, const Index3& voxel) {
  return VisitScalarType(voxels.type(), [&]<class T>(const T*) {
    const BrickView<T> brick = voxels.View<T>(voxel / kBrick);
    return double(brick.Row(voxel.y, voxel.z)[voxel.x - brick.begin.x]);
  });
}

}  // namespace

Vec3 DataPoint(const VolumeGeometry& geometry, const Vec3& at) {
  return geometry.orientation.FromWorld(at - geometry.orientation.origin) / geometry.spacing;
}

double ProbedVoxels::At(const Index3& voxel) const { return held_ ? SampleOf(*held_, voxel) : find_(voxel); }

double ProbeVolume::StoredAt(const Index3& voxel) const { return voxels.At(voxel); }

std::uint32_t ProbeVolume::LabelNumberAt(const Index3& voxel) const {
  return labels == nullptr ? 0 : std::uint32_t(SampleOf(VoxelBricks(*labels), voxel));
}

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
  return SampleAtVoxel(volume, summary, at, VoxelAt(DataPoint(summary.description.geometry, at)));
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
  sample.interpolated = finite(mapping.FromStored(volume.Interpolated(DataPoint(summary.description.geometry, at))));
  if (volume.labels != nullptr && summary.label_table != nullptr) {
    const std::uint32_t number = volume.LabelNumberAt(voxel);
    const std::vector<Label>& labels = summary.label_table->labels;
    sample.label.emplace();
    if (number > 0 && number <= labels.size()) *sample.label = {labels[number - 1].value, labels[number - 1].name};
  }
  return sample;
}

}  // namespace slabstream
