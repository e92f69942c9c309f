// FilledBox: voxels of a level that is read in parts which nobody reads, because nothing in them or near them shows. Whoever renders gives
// them all one sample.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/volume/box.h"

namespace slabstream {

inline constexpr std::size_t kMaxFilled = 4096;  // filled boxes of one padded box

struct FilledBox {
  Box box;
  // Stored; within the range of a brick in the box. So if a transfer function shows the sample, it may show the brick, and the box is read.
  float sample = 0;
  friend bool operator==(const FilledBox&, const FilledBox&) = default;
};

// `boxes` without what is filled: disjoint if they are. Cut as Difference cuts.
std::vector<Box> Without(std::vector<Box> boxes, std::span<const FilledBox> filled);

// Whether each part of `box` that one of `filled` fills lies inside one of `may_be_filled`.
bool FillsNoMoreThan(std::span<const FilledBox> filled, const Box& box, std::span<const FilledBox> may_be_filled);

// Blocks of a source that are read or left out together: as many as take at most `most_bytes`, in the shape of a cube as far as the volume
// allows that. A block that is larger stays alone.
Index3 BlocksTogether(const Index3& block, const Index3& volume, std::size_t bytes_per_voxel, std::size_t most_bytes);

}  // namespace slabstream
