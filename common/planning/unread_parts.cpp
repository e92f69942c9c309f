#include "common/planning/unread_parts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/parallel/parallel.h"
#include "common/planning/brick_visibility.h"
#include "common/volume/box_assembly.h"
#include "common/volume/bricks.h"
#include "common/volume/indices.h"

namespace slabstream {
namespace {

constexpr std::size_t kTogetherBytes = 1 << 20;

float StoredSample(double value, const VolumeDescription& description) {
  const ValueMapping& mapping = description.mapping;
  if (mapping.scale == 0) return 0;  // every sample has the same value
  const double sample = (value - mapping.offset) / mapping.scale;
  return float(description.type == ScalarType::kFloat32 ? sample : std::round(sample));
}

}  // namespace

UnreadParts::UnreadParts(const VolumeSummary& summary, ClassificationTable drawn, std::int32_t reach,
                         const std::vector<std::uint8_t>& layers)
    : summary_(summary),
      bounds_(summary.description.geometry.bounds()),
      reach_(reach),
      blocks_(BlocksTogether(summary.stored->block.end, bounds_.end, BytesPerSample(summary.description.type), kTogetherBytes)),
      drawn_(summary.indexed->size()) {
  const BrickVisibility visibility(summary, *summary.indexed, std::move(drawn), layers);
  constexpr std::size_t kGrain = 4096;  // bricks
  ParallelForRanges(0, drawn_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) drawn_[i] = visibility.AnyVisible(i) ? 1 : 0;
  });
}

bool UnreadParts::AnyDrawn(const Box& box) const {
  const auto [first, end] = CubesTouched(box, kBrick);
  for (std::int32_t z = first.z; z < end.z; ++z) {
    for (std::int32_t y = first.y; y < end.y; ++y) {
      const auto row = drawn_.begin() + std::ptrdiff_t(NumberIn(summary_.brick_counts, {0, y, z}));
      if (std::find(row + first.x, row + end.x, 1) != row + end.x) return true;
    }
  }
  return false;
}

std::vector<FilledBox> UnreadParts::Of(const Box& padded) const {
  std::vector<FilledBox> filled;
  for (const Box& part : CutAtBlocks(padded, blocks_)) {
    if (filled.size() < kMaxFilled && !AnyDrawn(Grown(part, 2 * reach_, bounds_))) AddFill(part, filled);
  }
  return filled;
}

// Takes the sample of any brick that has finite ones.
void UnreadParts::AddFill(const Box& part, std::vector<FilledBox>& filled) const {
  for (const Index3& brick : IndicesIn(CubesTouched(part, kBrick))) {
    const ValueRange& range = (*summary_.indexed)[NumberIn(summary_.brick_counts, brick)];
    if (range.min > range.max) continue;
    filled.push_back({part, StoredSample(double(range.min), summary_.description)});
    return;
  }
}

}  // namespace slabstream
