// What the Z-buffer calls opaque, for both of its halves.
#pragma once

#include "common/classification/classification_table.h"

namespace slabstream::zbuffer {

// The least opacity of an opaque voxel: half of the largest that the volume's range of values has.
inline float LeastOpaque(const ClassificationTable& table, const VolumeDescription& description, ValueRange range) {
  return 0.5F * MaxOpacity(table, description, range);
}

}  // namespace slabstream::zbuffer
