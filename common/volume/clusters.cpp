#include "common/volume/clusters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <utility>
#include <vector>

#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

constexpr int kMinSize = 8, kMaxSize = 4096, kMaxBalls = 1000;
constexpr double kMinOccupancy = 0.001, kMaxOccupancy = 0.3;
constexpr double kNearEnough = 1e-3;  // times the wanted number of voxels
constexpr double kLeastStep = 1e-6;   // of the radius, voxels

Status Validate(const ClusterRequest& request) {
  const auto check = [](const char* field, double value, double low, double high) {
    if (value >= low && value <= high) return Status::Ok();
    return Status::InvalidArgument(fmt::format("{} of clusters is {:g}, must be in [{:g}, {:g}]", field, value, low, high));
  };
  if (Status status = check("size", request.size, kMinSize, kMaxSize); !status.ok()) return status;
  if (Status status = check("occupancy", request.occupancy, kMinOccupancy, kMaxOccupancy); !status.ok()) return status;
  if (Status status = check("balls", request.balls, 1, kMaxBalls); !status.ok()) return status;
  return check("time", request.time, 0, 1);
}

// Centres in voxels. Squares of numbers that are spread evenly over [0, 1) are dense near 0.
std::vector<Vec3> CentresOf(const ClusterRequest& request) {
  std::mt19937_64 bits(request.seed);
  const auto next = [&] {
    const double even = double(bits() >> 11) * 0x1p-53;
    return even * even;
  };
  std::vector<Vec3> centres;
  centres.reserve(std::size_t(request.balls));
  for (int i = 0; i < request.balls; ++i) {
    const double x = next(), y = next(), z = next();
    const double drifted = (1 - request.time) * x + request.time * (1 - x);
    centres.push_back({drifted * (request.size - 1), y * (request.size - 1), z * (request.size - 1)});
  }
  return centres;
}

// Calls `fill(y, z, begin, end)` for the voxels in balls, each once: intervals of rows along x.
template <class Fill>
void ForEachRow(const std::vector<Vec3>& centres, double radius, int n, Fill fill) {
  std::vector<Vec3> near;  // balls that meet the slice
  std::vector<std::pair<int, int>> row;
  for (int z = 0; z < n; ++z) {
    near.clear();
    std::ranges::copy_if(centres, std::back_inserter(near), [&](const Vec3& centre) { return std::abs(z - centre.z) <= radius; });
    for (int y = 0; y < n; ++y) {
      row.clear();
      for (const Vec3& centre : near) {
        const double dy = y - centre.y, dz = z - centre.z, left = radius * radius - dy * dy - dz * dz;
        if (left < 0) continue;
        const double half = std::sqrt(left);
        row.emplace_back(std::max(0, int(std::ceil(centre.x - half))), std::min(n, int(std::floor(centre.x + half)) + 1));
      }
      std::ranges::sort(row);
      int done = 0;
      for (const auto& [begin, end] : row) {
        if (end <= std::max(begin, done)) continue;
        fill(y, z, std::max(begin, done), end);
        done = end;
      }
    }
  }
}

// By halving the interval in which it lies: larger balls hold more voxels.
double RadiusFor(const std::vector<Vec3>& centres, int n, double wanted) {
  double low = 0, high = 2.0 * n;
  while (high - low > kLeastStep) {
    const double middle = (low + high) / 2;
    double voxels = 0;
    ForEachRow(centres, middle, n, [&](int, int, int begin, int end) { voxels += end - begin; });
    if (std::abs(voxels - wanted) <= kNearEnough * wanted) return middle;
    (voxels < wanted ? low : high) = middle;
  }
  return high;
}

}  // namespace

Result<Volume> MakeClusters(const ClusterRequest& request) {
  if (Status status = Validate(request); !status.ok()) return status;
  const int n = request.size;
  Volume volume;
  volume.description.geometry.size = {n, n, n};
  volume.description.type = ScalarType::kUint8;
  if (Status status = CheckFitsMemory(volume.description.voxel_bytes(), fmt::format("clusters of size {}", n)); !status.ok()) return status;

  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), ScalarType::kUint8);
  const std::vector<Vec3> centres = CentresOf(request);
  const double radius = RadiusFor(centres, n, request.occupancy * n * n * n);
  std::uint8_t* const samples = volume.block.samples<std::uint8_t>();
  ForEachRow(centres, radius, n, [&](int y, int z, int begin, int end) {
    std::uint8_t* const row = samples + (std::int64_t{z} * n + y) * n;
    for (int x = begin; x < end; ++x) row[x] = std::uint8_t(128 + 127 * x / (n - 1));
  });
  return volume;
}

}  // namespace slabstream
