// The levels that a writer makes of a volume. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/volume.h"

namespace slabstream {

struct WrittenLevel {
  Index3 size;               // voxels
  Index3 step = {1, 1, 1};   // voxels of the level before in one of these, 1 or 2 along each axis; the last ones may hold fewer
  Vec3 spacing = {1, 1, 1};  // the distance of their centres
  Vec3 first;                // centre of the first voxel, from that of level 0, along the axes of the volume
};

// Level 0 is the volume; the last one is no longer than `chunk_side` >= 2 along any axis. Each level halves the axis that has the smallest
// spacing of those longer than that, and with it every axis whose spacing is at most 1.5 times as large. So voxels of an anisotropic volume
// become about cubes first, and keep that shape.
std::vector<WrittenLevel> PlanLevels(const VolumeGeometry& geometry, std::int32_t chunk_side);

}  // namespace slabstream
