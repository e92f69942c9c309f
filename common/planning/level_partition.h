// LevelPartition: boxes of a picture that is drawn from several levels. Each box lies in zones of one level (LevelMap), or of several, of
// which it has the finest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/decomposition/partition.h"
#include "common/frame/frame_setup.h"
#include "common/planning/level_map.h"

namespace slabstream {

struct LevelPartition {
  Partition partition;
  std::vector<std::uint8_t> levels;  // by box, as in LevelMap::of_zone; no zone of a box has a finer one
};

struct LevelPartitionRequest {
  const LevelMap* map = nullptr;  // a map of several levels
  Index3 size;                    // the size of the frame's grid
  int least_boxes = 1;            // the least number of boxes that the picture shows, as far as zones can be divided
  std::int64_t most_bytes = 0;    // the most bytes of one box
  std::function<std::int64_t(const LevelBox&)> bytes_of;
  // A box that is divided within a zone is divided at multiples of this, if there is one within: of a level's blocks, in voxels of the
  // grid.
  std::function<Index3(std::uint8_t level)> blocks_of;
};

// Pure. A kd-tree: planes between zones first part levels, where they part most, into about 768 boxes at most; then they halve what is too
// large. Which level a place is drawn from depends on the map, its bytes and the grid alone.
LevelPartition DivideByLevels(const LevelPartitionRequest& request);

}  // namespace slabstream
