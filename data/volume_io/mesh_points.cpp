#include "data/volume_io/mesh_points.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cstring>

namespace slabstream {
namespace {

constexpr PointNumber kNone = ~PointNumber{0};

}  // namespace

PointNumber& MeshPoints::SlotOf(const MeshPoint& point) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = XXH3_64bits(&point, sizeof point) & mask;
  // Bytes, since NaN as a value is the same as NaN.
  while (slots_[slot] != kNone && std::memcmp(&all_[slots_[slot]], &point, sizeof point) != 0) slot = (slot + 1) & mask;
  return slots_[slot];
}

void MeshPoints::BeginPiece(std::size_t more) {
  if (const std::size_t wanted = all_.size() + more; wanted > all_.capacity()) all_.reserve(std::max(wanted, all_.size() * 3 / 2));
  if (all_.empty()) return;
  if (const std::size_t slots = std::bit_ceil(2 * all_.size()); slots > slots_.size()) {
    slots_.assign(slots, kNone);
    found_ = 0;
  }
  for (; found_ < all_.size(); ++found_) {
    if (PointNumber& slot = SlotOf(all_[found_]); slot == kNone) slot = PointNumber(found_);
  }
}

PointNumber MeshPoints::Add(MeshPoint point) {
  for (double& number : point) number += 0.0;  // -0 is 0
  if (!slots_.empty()) {
    if (const PointNumber same = SlotOf(point); same != kNone) return same;
  }
  all_.push_back(point);
  return PointNumber(all_.size() - 1);
}

}  // namespace slabstream
