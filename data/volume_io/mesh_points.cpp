#include "data/volume_io/mesh_points.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>

#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

constexpr PointNumber kNone = ~PointNumber{0};

}  // namespace

Result<bool> MeshPoints::IsSame(PointNumber number, const MeshPoint& point) {
  const MeshPoint* other = nullptr;
  if (number >= moved_) {
    other = &held_[number - moved_];
  } else {
    // Neighbours are likely to be asked for next.
    if (number < block_begin_ || number >= block_begin_ + block_.size()) {
      block_begin_ = number / kBlockRecords * kBlockRecords;
      block_.resize(std::size_t(std::min<std::uint64_t>(kBlockRecords, moved_ - block_begin_)));
      if (Status read = file_->Read(block_begin_, std::span(block_)); !read.ok()) return read;
    }
    other = &block_[number - block_begin_];
  }
  // Bytes, since NaN as a value is the same as NaN.
  return std::memcmp(other, &point, sizeof point) == 0;
}

Result<MeshPoints::Slot*> MeshPoints::SlotOf(const MeshPoint& point) {
  const std::uint64_t digest = XXH3_64bits(&point, sizeof point);
  const auto tag = std::uint32_t(digest >> 32);
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t slot = digest & mask;; slot = (slot + 1) & mask) {
    Slot& at = slots_[slot];
    if (at.number != kNone) {
      if (at.tag != tag) continue;
      const Result<bool> same = IsSame(at.number, point);
      if (!same.ok()) return same.status();
      if (!*same) continue;
    } else {
      at.tag = tag;
    }
    return &at;
  }
}

Status MeshPoints::Find(const MeshPoint& point, PointNumber number) {
  const Result<Slot*> slot = SlotOf(point);
  if (!slot.ok()) return slot.status();
  if ((*slot)->number == kNone) (*slot)->number = number;
  return Status::Ok();
}

Status MeshPoints::BeginPiece(std::size_t more) {
  if (const std::size_t wanted = held_.size() + more; wanted > held_.capacity()) held_.reserve(std::max(wanted, held_.size() * 3 / 2));
  if (size() == 0) return Status::Ok();
  if (const std::size_t slots = std::bit_ceil(size() / 3 * 4 + 4); slots > slots_.size()) {
    if (Status fits = CheckFitsMemory(std::int64_t(slots * sizeof(Slot)), "a table of a grid's points"); !fits.ok()) return fits;
    slots_.assign(slots, {kNone, 0});
    found_ = 0;
  }
  std::vector<MeshPoint> block;
  while (found_ < moved_) {
    block.resize(std::min(kBlockRecords - found_ % kBlockRecords, moved_ - found_));
    if (Status read = file_->Read(found_, std::span(block)); !read.ok()) return read;
    for (const MeshPoint& point : block) {
      if (Status found = Find(point, PointNumber(found_++)); !found.ok()) return found;
    }
  }
  for (; found_ < size(); ++found_) {
    if (Status found = Find(held_[found_ - moved_], PointNumber(found_)); !found.ok()) return found;
  }
  return Status::Ok();
}

Result<PointNumber> MeshPoints::Add(MeshPoint point) {
  for (double& number : point) number += 0.0;  // -0 is 0
  if (!slots_.empty()) {
    const Result<Slot*> same = SlotOf(point);
    if (!same.ok()) return same.status();
    if ((*same)->number != kNone) return (*same)->number;
  }
  held_.push_back(point);
  return PointNumber(size() - 1);
}

Status MeshPoints::MoveTo(Records<MeshPoint>& file) {
  if (Status written = file.Append(std::span<const MeshPoint>(held_)); !written.ok()) return written;
  moved_ += held_.size();
  held_.clear();
  file_ = &file;
  return Status::Ok();
}

}  // namespace slabstream
