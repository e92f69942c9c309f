#include "worker/renderers/raycast/empty_distance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace slabstream {
namespace {

// A distance transform in one sweep over all cells, from those that rays of the octant reach last: exact for this distance (Borgefors
// 1986).
class Sweep {
 public:
  Sweep(const Index3& counts, unsigned octant, std::uint8_t* distance)
      : counts_(counts), octant_(octant), distance_(distance), nearest_(std::size_t(counts.x) + 2) {}

  void Run() {
    for (std::int32_t i = 0; i < counts_.z; ++i) {
      for (std::int32_t j = 0; j < counts_.y; ++j) Visit(FromLast(j, 1), FromLast(i, 2));
    }
  }

 private:
  static std::uint8_t Next(std::uint8_t distance) { return std::uint8_t(distance + (distance < 255 ? 1 : 0)); }
  std::int32_t Towards(int axis) const { return (octant_ >> axis & 1) != 0 ? -1 : 1; }
  std::int32_t FromLast(std::int32_t i, int axis) const { return Towards(axis) < 0 ? i : counts_[axis] - 1 - i; }
  std::uint8_t* Row(std::int32_t y, std::int32_t z) {
    return distance_ + (std::size_t(z) * std::size_t(counts_.y) + std::size_t(y)) * std::size_t(counts_.x);
  }

  // Updates the row's cells from the rows that the sweep has already visited.
  void Visit(std::int32_t y, std::int32_t z) {
    std::fill(nearest_.begin(), nearest_.end(), std::uint8_t{255});
    const std::int32_t next_y = y + Towards(1), next_z = z + Towards(2);
    Include(next_y, z);
    Include(y, next_z);
    Include(next_y, next_z);
    std::uint8_t* const row = Row(y, z);
    const auto width = std::size_t(counts_.x);
    const std::size_t ahead = Towards(0) < 0 ? 0 : 2;  // from nearest_[x]
    for (std::size_t x = 0; x < width; ++x) row[x] = std::min(row[x], Next(std::min(nearest_[x + 1], nearest_[x + ahead])));
    if (Towards(0) < 0) {
      for (std::size_t x = 1; x < width; ++x) row[x] = std::min(row[x], Next(row[x - 1]));
    } else {
      for (std::size_t x = width - 1; x-- > 0;) row[x] = std::min(row[x], Next(row[x + 1]));
    }
  }
  void Include(std::int32_t y, std::int32_t z) {
    if (y < 0 || z < 0 || y >= counts_.y || z >= counts_.z) return;
    const std::uint8_t* const row = Row(y, z);
    for (std::size_t x = 0; x < std::size_t(counts_.x); ++x) nearest_[x + 1] = std::min(nearest_[x + 1], row[x]);
  }

  const Index3 counts_;
  const unsigned octant_;
  std::uint8_t* const distance_;
  std::vector<std::uint8_t> nearest_;  // by column from -1 on
};

}  // namespace

OctantSet OctantsOf(const ViewRays& rays) {
  bool up[3], down[3];
  for (std::size_t i = 0; i < 3; ++i) {
    // Pixels lie at most `centre_x` and `centre_y` from the middle. The slack covers rounding.
    const float spread = rays.perspective ? std::abs(rays.right[i]) * rays.centre_x + std::abs(rays.down[i]) * rays.centre_y : 0;
    const float slack = 1e-5F * (std::abs(rays.forward[i]) + spread);
    up[i] = rays.forward[i] + spread + slack >= 0;
    down[i] = rays.forward[i] - spread - slack < 0;
  }
  OctantSet octants = 0;
  for (unsigned octant = 0; octant < kOctants; ++octant) {
    bool occurs = true;
    for (unsigned i = 0; i < 3; ++i) occurs = occurs && ((octant >> i & 1) != 0 ? down[i] : up[i]);
    if (occurs) octants |= 1U << octant;
  }
  return octants;
}

EmptyDistances::EmptyDistances(const Index3& counts, std::vector<std::uint8_t> visible) : counts_(counts), visible_(std::move(visible)) {
  eighths_.resize(visible_.size());
  std::ranges::transform(visible_, eighths_.begin(), [](std::uint8_t cell) { return std::uint8_t(~cell); });
}

void EmptyDistances::SetEighths(std::vector<std::uint8_t> eighths) {
  eighths_ = std::move(eighths);
  found_ = 0;
}

void EmptyDistances::Find(OctantSet octants) {
  if ((octants & ~found_) == 0) return;
  found_ = octants;
  const std::size_t count = visible_.size();
  cells_.resize(std::size_t(std::popcount(octants)) * count + 1);  // kernels read two at a time
  const auto shown = std::size_t(std::ranges::count(visible_, 0));
  const bool mixed = shown != 0 && shown != count;  // unlike in most boxes of a large volume
  std::vector<unsigned> wanted;
  for (unsigned octant = 0; octant < kOctants; ++octant) {
    if ((octants >> octant & 1) == 0) continue;
    starts_[octant] = std::int32_t(wanted.size() * count);
    wanted.push_back(octant);
  }
  ParallelFor(0, wanted.size(), [&](std::size_t i) {
    std::vector<std::uint8_t> distances = visible_;
    if (mixed) Sweep(counts_, wanted[i], distances.data()).Run();
    std::ranges::transform(distances, eighths_, cells_.begin() + std::ptrdiff_t(i * count),
                           [](std::uint8_t distance, std::uint8_t eighths) { return std::uint16_t(distance << 8 | eighths); });
  });
}

}  // namespace slabstream
