// BrickIndex: the ranges of the bricks of all levels of a source. It says which voxels cannot show anything under a
// transfer function, so that they need not be read. It says nothing else: pictures are the same without it.
//
// As bytes: kIndexMagic, the length of a name (32 bits, little endian) and the name, which says of which source the
// index is, then for each level the length of its ranges (64 bits, little endian) and the ranges: the least samples of
// all bricks, then the largest ones, of the level's type, little endian, packed by Blosc (shuffle, zstd), and their
// CRC-32C. If nobody has read a brick, its least sample is above its largest one.
//
// Pure. Any thread.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/volume/summary.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// The range of a brick that nobody has read.
inline constexpr ValueRange kNotRead = {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};

struct BrickIndex {
  std::vector<BrickRangeList> levels;  // ranges of stored samples, kNoFiniteValue or kNotRead

  friend bool operator==(const BrickIndex&, const BrickIndex&) = default;
};

// The index of a source that nobody has read. ResourceExhausted: there is no memory for it.
Result<BrickIndex> EmptyIndex(const SourceInfo& source);

// Share of the voxels' bricks that were read, [0, 1].
double ShareRead(const BrickIndex& index);

// Ranges of data values, as VolumeSummary::indexed has them: bricks that nobody has read have any value.
BrickRangeList DataRanges(const BrickRangeList& indexed, const VolumeDescription& level);

inline constexpr std::string_view kIndexMagic = "SLABIDX1";

// `index` is of `source`. ResourceExhausted: a level has more bricks than can be packed in one piece (2 GiB).
Result<std::vector<std::byte>> EncodeIndex(const BrickIndex& index, const SourceInfo& source, std::string_view name);
// NotFound: it is the index of something else than `name` and `source`. DataLoss: it is damaged. ResourceExhausted: there is no memory for
// it. Takes no more memory than an index of `source` has.
Result<BrickIndex> DecodeIndex(std::span<const std::byte> bytes, const SourceInfo& source, std::string_view name);

}  // namespace slabstream
