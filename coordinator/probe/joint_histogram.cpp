#include "coordinator/probe/joint_histogram.h"

#include <algorithm>
#include <cmath>

#include "common/volume/indices.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 32;  // of a box, without the voxels around it
constexpr std::int64_t kMostBoxes = 64;

// Boxes at multiples of kSide, as evenly spread as whole numbers allow. At least one along each axis.
std::vector<Box> SpreadBoxes(const Index3& size) {
  const Index3 all = CubesOver(size, kSide);
  Index3 counts = all;
  while (std::int64_t{counts.x} * counts.y * counts.z > kMostBoxes) {
    std::int32_t& most = counts.x >= counts.y && counts.x >= counts.z ? counts.x : counts.y >= counts.z ? counts.y : counts.z;
    --most;
  }
  const auto at = [](std::int32_t i, std::int32_t count, std::int32_t of) {
    return kSide * std::int32_t((std::int64_t{2} * i + 1) * of / (2 * count));
  };
  std::vector<Box> boxes;
  for (const Index3& i : IndicesIn(counts)) {
    const Index3 begin = {at(i.x, counts.x, all.x), at(i.y, counts.y, all.y), at(i.z, counts.z, all.z)};
    boxes.push_back(Intersection({begin, begin + Uniform(kSide)}, Box{{}, size}));
  }
  return boxes;
}

struct Pair {
  float value, slope;  // stored samples, and per unit of the world
};

template <class T>
void AddPairs(const VoxelBlock& block, const Box& box, const Vec3& spacing, std::vector<Pair>& pairs) {
  const T* const samples = block.samples<T>();
  const std::ptrdiff_t row = block.box.size().x, slice = row * block.box.size().y;
  const double per_x = 0.5 / spacing.x, per_y = 0.5 / spacing.y, per_z = 0.5 / spacing.z;
  for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
      const T* v = samples + block.Offset({box.begin.x, y, z});
      for (std::int32_t x = box.begin.x; x < box.end.x; ++x, ++v) {
        const auto difference = [&](std::ptrdiff_t step) { return double(v[step]) - double(v[-step]); };
        // Not std::hypot of three numbers, which libstdc++ takes for 0 if two are 0 and the third is not a number.
        const double slope = Length(Vec3{difference(1) * per_x, difference(row) * per_y, difference(slice) * per_z});
        if (std::isfinite(slope) && std::isfinite(double(*v))) pairs.push_back({float(*v), float(slope)});
      }
    }
  }
}

}  // namespace

Result<JointHistogram> CountJointly(const VolumeDescription& volume, ValueRange range, const ReadJointBox& read) {
  if (volume.geometry.rectilinear()) {
    return Status::InvalidArgument("values are counted with slopes on even grids alone; --resample even resamples a rectilinear one");
  }
  const Index3 size = volume.geometry.size;
  std::vector<Pair> pairs;
  for (const Box& box : SpreadBoxes(size)) {
    const Box inner = Intersection(box, {Uniform(1), size - Uniform(1)});
    if (inner.empty()) continue;
    const Result<VoxelBlock> block = read({inner.begin - Uniform(1), inner.end + Uniform(1)});
    if (!block.ok()) return block.status();
    VisitScalarType(block->type, [&]<class T>(const T*) { AddPairs<T>(*block, inner, volume.geometry.spacing, pairs); });
  }
  JointHistogram of;
  const double scale = std::abs(volume.mapping.scale);
  for (const Pair& pair : pairs) of.steepest = std::max(of.steepest, double(pair.slope) * scale);
  const double least = double(range.min), width = double(range.max) - least;
  for (const Pair& pair : pairs) {
    const double share = width > 0 ? (volume.mapping.FromStored(double(pair.value)) - least) / width : 0;
    const double steep = of.steepest > 0 ? std::sqrt(double(pair.slope) * scale / of.steepest) : 0;
    const auto bin = [](double at, int bins) { return std::size_t(std::clamp(at * bins, 0.0, double(bins - 1))); };
    ++of.counts[bin(share, kJointValues) * kJointSlopes + bin(steep, kJointSlopes)];
  }
  return of;
}

}  // namespace slabstream
