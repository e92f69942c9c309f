#include "common/volume/sphere.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

constexpr int kMinSize = 2, kMaxSize = 4096;
constexpr double kMinHollow = 0.001, kMaxHollow = 0.3, kMaxFilled = 0.52;
constexpr double kHollowOuterRadius = 0.45;  // times N

// Distances are measured in half voxels from the centre (N-1)/2, so that they are integers for even and odd N alike.
std::int64_t HalfVoxels(int index, int size) { return 2 * std::int64_t{index} - (size - 1); }

// Occupied: low <= squared distance <= high, in half voxels squared.
struct Shells {
  std::int64_t low = 0, high = 0;
};

// Number of voxels at each squared distance of at most `high`.
std::vector<std::int64_t> CountShells(int size, std::int64_t high) {
  std::vector<std::int64_t> counts(std::size_t(high) + 1);
  // One octant stands for eight: an index above the centre has a mirror image below it, the centre itself (odd N) has none.
  const auto weight = [&](int index) { return HalfVoxels(index, size) == 0 ? 1 : 2; };
  for (int z = size / 2; z < size; ++z) {
    const std::int64_t dz = HalfVoxels(z, size);
    for (int y = size / 2; y < size; ++y) {
      const std::int64_t dy = HalfVoxels(y, size);
      if (dz * dz + dy * dy > high) break;
      for (int x = size / 2; x < size; ++x) {
        const std::int64_t dx = HalfVoxels(x, size);
        const std::int64_t distance = dx * dx + dy * dy + dz * dz;
        if (distance > high) break;
        counts[std::size_t(distance)] += weight(x) * weight(y) * weight(z);
      }
    }
  }
  return counts;
}

// Adds shells from `first` on in the direction of `step` until the count of voxels is as near to `wanted` as whole shells allow (at least
// one that is not empty), and returns the last one added.
std::int64_t LastShell(const std::vector<std::int64_t>& counts, std::int64_t first, int step, double wanted) {
  std::int64_t voxels = 0, last = first;
  for (std::int64_t shell = first; shell >= 0 && shell < std::int64_t(counts.size()); shell += step) {
    const std::int64_t next = voxels + counts[std::size_t(shell)];
    if (next == voxels) continue;
    if (voxels > 0 && std::abs(double(next) - wanted) >= std::abs(double(voxels) - wanted)) break;
    voxels = next;
    last = shell;
  }
  return last;
}

Shells ChooseShells(const SphereRequest& request) {
  const int n = request.size;
  const double wanted = request.occupancy * n * n * n;
  if (request.sphere_class == SphereClass::kFilled) {
    const std::int64_t corner = 3 * std::int64_t{n - 1} * (n - 1);
    const double radius =
        2 * std::cbrt(wanted * 3 / (4 * std::numbers::pi)) + 4;  // of a ball of that many voxels, and room for the lattice
    const auto limit = std::min<std::int64_t>(corner, std::int64_t(radius * radius));
    return {0, LastShell(CountShells(n, limit), 0, +1, wanted)};
  }
  const double outer = 2 * kHollowOuterRadius * n;
  const auto limit = std::max<std::int64_t>(3, std::int64_t(outer * outer));  // 3: all eight voxels of the smallest volume
  const std::vector<std::int64_t> counts = CountShells(n, limit);
  return {LastShell(counts, limit, -1, wanted), limit};
}

Status CheckOccupancy(double value, double low, bool low_allowed, double high, const char* name) {
  if ((low_allowed ? value >= low : value > low) && value <= high) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("occupancy of a {} sphere is {:g}, must be in {}{:g}, {:g}]", name, value, low_allowed ? '[' : '(', low, high));
}

Status Validate(const SphereRequest& request) {
  if (request.size < kMinSize || request.size > kMaxSize) {
    return Status::InvalidArgument(fmt::format("size of a sphere is {}, must be in [{}, {}]", request.size, kMinSize, kMaxSize));
  }
  switch (request.sphere_class) {
    case SphereClass::kHollow: return CheckOccupancy(request.occupancy, kMinHollow, true, kMaxHollow, "hollow");
    case SphereClass::kFilled: return CheckOccupancy(request.occupancy, 0, false, kMaxFilled, "filled");
  }
  return Status::InvalidArgument(fmt::format("class of a sphere is {}, must be 1 or 2", int(request.sphere_class)));
}

}  // namespace

Result<Volume> MakeSphere(const SphereRequest& request) {
  if (Status status = Validate(request); !status.ok()) return status;
  const int n = request.size;
  Volume volume;
  volume.description.geometry.size = {n, n, n};
  volume.description.type = ScalarType::kUint8;
  if (Status status = CheckFitsMemory(volume.description.voxel_bytes(), fmt::format("a sphere of size {}", n)); !status.ok()) return status;

  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), ScalarType::kUint8);
  const Shells shells = ChooseShells(request);
  std::uint8_t* sample = volume.block.samples<std::uint8_t>();
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      const std::int64_t dy = HalfVoxels(y, n), dz = HalfVoxels(z, n);
      for (int x = 0; x < n; ++x, ++sample) {
        const std::int64_t dx = HalfVoxels(x, n);
        const std::int64_t distance = dx * dx + dy * dy + dz * dz;
        if (distance >= shells.low && distance <= shells.high) *sample = std::uint8_t(128 + 127 * x / (n - 1));
      }
    }
  }
  return volume;
}

double MeasureOccupancy(const Volume& volume) {
  return VisitScalarType(volume.block.type, [&]<class T>(const T*) {
    const T* samples = volume.block.samples<T>();
    const std::int64_t count = volume.block.box.voxel_count();
    const std::int64_t empty = std::count(samples, samples + count, T{0});
    return count == 0 ? 0 : double(count - empty) / double(count);
  });
}

}  // namespace slabstream
